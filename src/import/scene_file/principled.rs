//! `principled`: the parameters that glTF and Blender have for most materials.

use super::at::At;
use super::material_images::{ImagesOf, SharesOf};
use super::number::{Ior, Share};
use super::texture::{self, ChannelName, MappedShare, Named, NamedTexture, NormalTexture};
use super::vector::{Light as Amount, OneOr, Reflectance};
use crate::math::Rgb;
use crate::scene::{Fresnel, Glass, Material, TextureId};
use schemars::JsonSchema;
use serde::Deserialize;

/// What glTF's and Blender's principled materials say of reflection.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Principled {
    /// Diffuse reflectance, and what metal reflects at normal incidence; linear RGB or one number for grey. Absent: 0.8,
    /// or 1 where there is a `base_texture` or `vertex_colours`.
    base_colour: Option<Reflectance>,
    /// Image file, relative to the scene file, that multiplies `base_colour`; or a table of the file and how it lies on
    /// the surface.
    pub base_texture: Option<At<NamedTexture>>,
    /// Share that is metal: 0 is plastic or wood, 1 metal. Or an image file of it, whose blue counts as it stands; or a table of
    /// the file, the channel, a factor and how it lies on the surface. Absent: 0.
    pub metallic: Option<At<MappedShare>>,
    /// Roughness of the reflection: 0 is polished, 1 nearly matte. Or an image file of it, whose green counts as it stands; or
    /// a table. Absent: 0.5.
    pub roughness: Option<At<MappedShare>>,
    /// Index of refraction of what is no metal: it reflects ((ior - 1) / (ior + 1))² at normal incidence.
    #[serde(default = "plastic")]
    ior: Ior,
    /// Factor on the reflection of what is no metal: 0 is none, so that it is diffuse alone. Or an image file of it, whose red
    /// counts as it stands; or a table. Absent: 1.
    pub specular: Option<At<MappedShare>>,
    /// Factor on the reflection of what is no metal at normal incidence, linear RGB or one number for grey. Absent: 1.
    specular_colour: Option<Reflectance>,
    /// Image file, relative to the scene file, that multiplies `specular_colour`; or a table of the file and how it lies on
    /// the surface.
    pub specular_texture: Option<At<NamedTexture>>,
    /// Share that lies under a clear coat, as of car paint. Or an image file of it, whose red counts as it stands; or a table. Absent: 0.
    pub clearcoat: Option<At<MappedShare>>,
    /// Roughness of the clear coat. Or an image file of it, whose green counts as it stands; or a table. Absent: 0.03.
    pub clearcoat_roughness: Option<At<MappedShare>>,
    /// Image file, relative to the scene file, of normals of the clear coat, as of `normal_map`, or a table. Absent: the coat is as
    /// smooth as the mesh, whatever `normal_map` says of what lies under it.
    pub clearcoat_normal_map: Option<At<Named<NormalTexture>>>,
    /// Share of what is no metal that is glass of this `ior` and `roughness`, in place of the diffuse part and its reflection.
    /// Or an image file of it, whose red counts as it stands; or a table. No normal map stands beside it, and `alpha` only if it is thin. Absent: 0.
    pub transmission: Option<At<MappedShare>>,
    /// Share of light that each crossing of the glass lets through: twice of a body, once of a thin pane. `base_texture` and
    /// vertex colours multiply it. Absent: `base_colour`.
    tint: Option<Reflectance>,
    /// Absorption coefficient of the glass, per unit of length, linear RGB or one number for grey. The surface must be closed.
    pub absorption: Option<At<Amount>>,
    /// Whether the surface is a whole pane without thickness, such as a window. `absorption` does not stand beside it.
    #[serde(default)]
    pub thin: bool,
}

/// Roughness where none is given, of the reflection and of the clear coat.
const USUAL_ROUGHNESS: f64 = 0.5;
const USUAL_COAT_ROUGHNESS: f64 = 0.03;
/// Grey of a surface without a colour.
const USUAL_GREY: Share = Share(0.8);

fn plastic() -> Ior {
    Ior(1.5)
}

impl Principled {
    /// Whether a key says what its glass is like.
    pub fn says_glass(&self) -> bool {
        self.tint.is_some() || self.absorption.is_some() || self.thin
    }

    /// The keys that may be images, in the order of [`SharesOf`], and the channel of each that counts where none is named.
    pub fn shares(&self) -> SharesOf<(&At<MappedShare>, ChannelName)> {
        let usual = [
            (&self.roughness, ChannelName::Green),
            (&self.metallic, ChannelName::Blue),
            (&self.specular, ChannelName::Red),
            (&self.clearcoat, ChannelName::Red),
            (&self.clearcoat_roughness, ChannelName::Green),
            (&self.transmission, ChannelName::Red),
        ];
        usual.map(|(key, channel)| key.as_ref().map(|key| (key, channel)))
    }

    /// Whether any of the surface may lie under a clear coat.
    pub fn has_coat(&self) -> bool {
        self.clearcoat.as_deref().is_some_and(|key| key.factor() != 0.0)
    }

    /// Whether any of the surface may be glass.
    pub fn has_glass(&self) -> bool {
        self.transmission.as_deref().is_some_and(|key| key.factor() != 0.0)
    }

    /// `material` with this reflection.
    pub fn build(&self, material: Material, images: &ImagesOf<TextureId>) -> Material {
        let ImagesOf { texture: base, specular_texture, coat_normals, shares: images, .. } = images;
        let keys = [
            (&self.roughness, USUAL_ROUGHNESS),
            (&self.metallic, 0.0),
            (&self.specular, 1.0),
            (&self.clearcoat, 0.0),
            (&self.clearcoat_roughness, USUAL_COAT_ROUGHNESS),
            (&self.transmission, 0.0),
        ];
        let parts = std::array::from_fn(|at| {
            let (key, usual) = &keys[at];
            key.as_deref().map_or((*usual, None), |key| key.parts(images[at]))
        });
        let [roughness, metallic, specular, clearcoat, clearcoat_roughness, transmission] = parts;
        let (roughness, roughness_map) = roughness;
        let paints = self.base_texture.is_some() || material.vertex_colours;
        let usual = if paints { Share(1.0) } else { USUAL_GREY };
        let base_colour = self.base_colour.unwrap_or(OneOr([usual; 3]));
        let root = (self.ior.0 - 1.0) / (self.ior.0 + 1.0);
        let colour = self.specular_colour.map_or(Rgb::ONE, |colour| colour.rgb());
        let normal = colour * ((root * root * specular.0) as f32);
        let glass = (transmission.0 != 0.0).then(|| Glass {
            roughness,
            tint: self.tint.unwrap_or(base_colour).rgb(),
            absorption: self.absorption.as_ref().map_or_else(Default::default, |a| a.rgb()),
            thin: self.thin,
            ..Glass::clear(self.ior.0)
        });
        let is_bare = self.base_texture.is_none() && !material.vertex_colours;
        let is_alone = transmission == (1.0, None)
            && metallic.0 == 0.0
            && clearcoat.0 == 0.0
            && roughness_map.is_none();
        if is_bare && is_alone && material.emission == Rgb::ZERO {
            return Material { glass, ..material };
        }
        Material {
            glass,
            diffuse: base_colour.rgb(),
            texture: texture::laid(&self.base_texture, *base),
            mirror: normal,
            roughness,
            roughness_map,
            fresnel: Some(Fresnel {
                grazing: specular.0,
                specular_map: specular.1,
                specular_colour_map: texture::laid(&self.specular_texture, *specular_texture),
                metallic: metallic.0,
                metallic_map: metallic.1,
                clearcoat: clearcoat.0,
                clearcoat_map: clearcoat.1,
                clearcoat_roughness: clearcoat_roughness.0,
                clearcoat_roughness_map: clearcoat_roughness.1,
                clearcoat_normal_map: texture::normals(&self.clearcoat_normal_map, *coat_normals),
                transmission: transmission.0,
                transmission_map: transmission.1,
            }),
            ..material
        }
    }
}
