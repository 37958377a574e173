//! Images of a material.

use super::at::At;
use super::file_name;
use super::number::{Coordinate, Degrees, Factor, NotNegative, Share};
use super::schema::inline_schema;
use super::vector::{List, OneOr};
use crate::import::texture::ImageChannel;
use crate::math::{DAffine2, DVec2};
use crate::scene::{NormalMap, TextureId, TextureMap, Wrap};
use schemars::{JsonSchema, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::marker::PhantomData;

/// A table of an image file and how it lies on the surface, with keys of its own after these.
macro_rules! image_table {
    ($(#[$doc:meta])* $name:ident { $($(#[$own_doc:meta])* $own:ident: $type:ty,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields, expecting = "a file name or a table")]
        pub(super) struct $name {
            /// Image file, relative to the scene file.
            #[serde(deserialize_with = "file_name::required")]
            file: String,
            /// What is seen beyond the image's edges.
            #[serde(default)]
            wrap: Wrapping,
            /// Factors on the texture coordinates, or one for both: with `[2, 3]` the image is seen twice side by side and three times one over the other.
            #[serde(default = "unscaled")]
            scale: OneOr<Factor, 2>,
            /// Turn of the texture coordinates about (0, 0), degrees, counter-clockwise; after `scale`.
            #[serde(default = "unturned")]
            rotate: Degrees,
            /// Added to the texture coordinates; after `scale` and `rotate`.
            #[serde(default = "at_zero")]
            offset: List<Coordinate, 2>,
            /// The set of the mesh's texture coordinates that the image lies by, from 0: in a ply file 0 is `s` and `t`, 1 `s1` and `t1`.
            #[serde(default)]
            uv_set: u8,
            $($(#[$own_doc])* #[serde(default)] pub $own: $type,)*
        }

        impl ImageTable for $name {
            fn of_file(file: String) -> Self {
                let (wrap, scale, rotate, offset) = (Wrapping::Repeat, unscaled(), unturned(), at_zero());
                Self { file, wrap, scale, rotate, offset, uv_set: 0, $($own: Default::default(),)* }
            }

            fn file(&self) -> &str {
                &self.file
            }

            fn map(&self, image: TextureId) -> TextureMap {
                let map = map(image, self.wrap, (&self.scale, self.rotate, &self.offset));
                TextureMap { uv_set: self.uv_set, ..map }
            }
        }
    };
}

image_table!(
    /// An image file, and how it lies on the surface.
    Texture {}
);
image_table!(
    /// An image file of numbers, and how it lies on the surface.
    DataTexture {
        /// Where the numbers are: in red, green, blue or alpha. Absent: in green, or where glTF has them.
        channel: Option<ChannelName>,
        /// Factor on the numbers, from 0 to 1.
        factor: ShareFactor,
    }
);

image_table!(
    /// An image file of normals in tangent space, and how it lies on the surface.
    NormalTexture {
        /// Factor on the normals' parts along the surface: 0 is flat, 1 what the image holds.
        strength: Strength,
    }
);

/// Factor on a normal map.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub(super) struct Strength(pub NotNegative);

impl Default for Strength {
    fn default() -> Self {
        Self(NotNegative(1.0))
    }
}

/// Factor on shares of an image.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub(super) struct ShareFactor(pub Share);

impl Default for ShareFactor {
    fn default() -> Self {
        Self(Share(1.0))
    }
}

/// A channel of an image.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, JsonSchema)]
pub(super) enum ChannelName {
    /// Red.
    #[serde(rename = "r")]
    Red,
    /// Green, where glTF has the roughness.
    #[serde(rename = "g")]
    Green,
    /// Blue, where glTF has the metal.
    #[serde(rename = "b")]
    Blue,
    /// Alpha.
    #[serde(rename = "a")]
    Alpha,
}

impl ChannelName {
    /// As the image's reader has it.
    pub fn channel(self) -> ImageChannel {
        match self {
            Self::Red => ImageChannel::Red,
            Self::Green => ImageChannel::Green,
            Self::Blue => ImageChannel::Blue,
            Self::Alpha => ImageChannel::Alpha,
        }
    }
}

/// What all tables of images have.
pub(super) trait ImageTable {
    /// The table with the file alone.
    fn of_file(file: String) -> Self;
    fn file(&self) -> &str;
    /// As scene data, with the decoded image's index.
    fn map(&self, image: TextureId) -> TextureMap;
}

/// What is seen beyond the edges of an image.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Wrapping {
    /// The image again.
    #[default]
    Repeat,
    /// The nearest texel of the edge.
    Clamp,
    /// The image again, every other one mirrored.
    Mirror,
}

fn unscaled() -> OneOr<Factor, 2> {
    OneOr([Factor(1.0); 2])
}

fn unturned() -> Degrees {
    Degrees(0.0)
}

fn at_zero() -> List<Coordinate, 2> {
    List([Coordinate(0.0); 2])
}

fn map(
    image: TextureId,
    wrap: Wrapping,
    (scale, rotate, offset): (&OneOr<Factor, 2>, Degrees, &List<Coordinate, 2>),
) -> TextureMap {
    let scale = DVec2::from_array(scale.0.map(|s| s.0));
    let offset = DVec2::from_array(offset.0.map(|o| o.0));
    let wrap = match wrap {
        Wrapping::Repeat => Wrap::Repeat,
        Wrapping::Clamp => Wrap::Clamp,
        Wrapping::Mirror => Wrap::Mirror,
    };
    let angle = rotate.0.to_radians();
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let axes = [DVec2::new(cos, sin) * scale.x, DVec2::new(-sin, cos) * scale.y];
    let transform = DAffine2::from_cols(axes[0], axes[1], offset);
    TextureMap { wrap: [wrap; 2], transform, ..TextureMap::of(image) }
}

/// A table, of which the file's name alone may stand for all.
#[derive(Debug, Clone)]
pub(super) struct Named<T>(pub T);

pub(super) type NamedTexture = Named<Texture>;

/// The image that `key` says, as scene data, with the decoded image's index.
pub(super) fn laid(key: &Option<At<NamedTexture>>, image: Option<TextureId>) -> Option<TextureMap> {
    Some(key.as_ref()?.0.map(image?))
}

/// The normals that `key` says, as scene data, with the decoded image's index.
pub(super) fn normals(
    key: &Option<At<Named<NormalTexture>>>,
    image: Option<TextureId>,
) -> Option<NormalMap> {
    let table = &key.as_ref()?.0;
    Some(NormalMap { image: table.map(image?), strength: table.strength.0.0 })
}

impl<T: ImageTable> At<Named<T>> {
    /// The image's file at the place of the whole value.
    pub fn image_file(&self) -> At<String> {
        At { value: self.value.0.file().to_owned(), span: self.span.clone() }
    }
}

struct NamedVisitor<T>(PhantomData<T>);

impl<'de, T: ImageTable + Deserialize<'de>> Visitor<'de> for NamedVisitor<T> {
    type Value = Named<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a file name or a table")
    }

    fn visit_str<E: Error>(self, file: &str) -> Result<Named<T>, E> {
        file_name::checked(file).map(T::of_file).map(Named)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Named<T>, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Named)
    }
}

impl<'de, T: ImageTable + Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NamedVisitor(PhantomData))
    }
}

inline_schema!(for [T: JsonSchema] Named<T>, |generator| {
    let table = generator.subschema_for::<T>();
    json_schema!({ "anyOf": [{ "type": "string" }, table] })
});

/// A share such as a roughness: the same everywhere, or from an image.
#[derive(Debug, Clone)]
pub(super) enum MappedShare {
    Same(Share),
    Image(Named<DataTexture>),
}

impl MappedShare {
    /// What multiplies the image, or the number that is the same everywhere.
    pub fn factor(&self) -> f64 {
        match self {
            Self::Same(share) => share.0,
            Self::Image(Named(table)) => table.factor.0.0,
        }
    }

    /// The number that is the same everywhere, and the image that multiplies it; `image` is its number in the world.
    pub fn parts(&self, image: Option<TextureId>) -> (f64, Option<TextureMap>) {
        match self {
            Self::Same(_) => (self.factor(), None),
            Self::Image(Named(table)) => (self.factor(), image.map(|id| table.map(id))),
        }
    }
}

impl At<MappedShare> {
    /// The image's file at the place of the whole value, and the channel of it, `usual` where none is named.
    pub fn data_file(&self, usual: ChannelName) -> Option<(At<String>, ImageChannel)> {
        match &self.value {
            MappedShare::Same(_) => None,
            MappedShare::Image(Named(table)) => {
                let file = At { value: table.file().to_owned(), span: self.span.clone() };
                Some((file, table.channel.unwrap_or(usual).channel()))
            }
        }
    }
}

struct MappedShareVisitor;

impl<'de> Visitor<'de> for MappedShareVisitor {
    type Value = MappedShare;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number from 0 to 1, a file name or a table")
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<MappedShare, E> {
        Share::deserialize(x.into_deserializer()).map(MappedShare::Same)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<MappedShare, E> {
        Share::deserialize(x.into_deserializer()).map(MappedShare::Same)
    }

    fn visit_str<E: Error>(self, file: &str) -> Result<MappedShare, E> {
        NamedVisitor(PhantomData).visit_str(file).map(MappedShare::Image)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MappedShare, A::Error> {
        NamedVisitor(PhantomData).visit_map(map).map(MappedShare::Image)
    }
}

impl<'de> Deserialize<'de> for MappedShare {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MappedShareVisitor)
    }
}

inline_schema!(MappedShare, |generator| {
    let (number, image) =
        (generator.subschema_for::<Share>(), generator.subschema_for::<DataTexture>());
    json_schema!({ "anyOf": [number, { "type": "string" }, image] })
});
