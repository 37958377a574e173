//! `texture` of a material.

use super::at::At;
use super::number::{Coordinate, Degrees, Factor};
use super::schema::inline_schema;
use super::vector::{List, OneOr};
use crate::math::{DAffine2, DVec2};
use crate::scene::{TextureId, TextureMap, Wrap};
use schemars::{JsonSchema, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;

/// An image file, and how it lies on the surface.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a file name or a table")]
pub(super) struct Texture {
    /// Image file, relative to the scene file.
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

/// A [`Texture`], of which the file's name alone may stand for all.
#[derive(Debug, Clone)]
pub(super) struct NamedTexture(Texture);

impl NamedTexture {
    /// The image's file at the place of the whole value.
    pub fn file(this: &At<Self>) -> At<String> {
        At { value: this.0.file.clone(), span: this.span.clone() }
    }

    /// As scene data, with the decoded image's index.
    pub fn build(&self, image: TextureId) -> TextureMap {
        let Texture { file: _, wrap, scale, rotate, offset } = &self.0;
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
        TextureMap { image, wrap, transform: DAffine2::from_cols(axes[0], axes[1], offset) }
    }
}

struct NamedTextureVisitor;

impl<'de> Visitor<'de> for NamedTextureVisitor {
    type Value = NamedTexture;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a file name or a table")
    }

    fn visit_str<E: Error>(self, file: &str) -> Result<NamedTexture, E> {
        let (wrap, scale, rotate, offset) = (Wrapping::Repeat, unscaled(), unturned(), at_zero());
        Ok(NamedTexture(Texture { file: file.to_owned(), wrap, scale, rotate, offset }))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<NamedTexture, A::Error> {
        Texture::deserialize(MapAccessDeserializer::new(map)).map(NamedTexture)
    }
}

impl<'de> Deserialize<'de> for NamedTexture {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NamedTextureVisitor)
    }
}

inline_schema!(NamedTexture, |generator| {
    let table = generator.subschema_for::<Texture>();
    json_schema!({ "anyOf": [{ "type": "string" }, table] })
});
