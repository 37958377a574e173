//! `[material.NAME]`.

use super::at::At;
use super::material_images::ImagesOf;
use super::number::{Int, Ior};
use super::principled::Principled;
use super::report::Source;
use super::texture::{self, ChannelName, MappedShare, Named, NamedTexture, NormalTexture};
use super::vector::{Light as Amount, Reflectance};
use crate::error::Result;
use crate::import::images::ImageUse;
use crate::math::Rgb;
use crate::scene;
use schemars::JsonSchema;
use serde::Deserialize;

/// A material. `diffuse` and `mirror` add up, to at most 1 in each channel; `glass` excludes all other
/// keys, but for `alpha` on a thin pane, `principled` those that say how light is reflected.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Material {
    /// Diffuse reflectance (albedo), linear RGB or one number for grey. Absent: 0, or 1 where
    /// there is a `texture` or `vertex_colours`.
    pub diffuse: Option<Reflectance>,
    /// Image file, relative to the scene file, that multiplies `diffuse`; or a table of the file and how it
    /// lies on the surface.
    pub texture: Option<At<NamedTexture>>,
    /// Image file, relative to the scene file, of normals of a finer surface: in tangent space, +Y up, as glTF has them. Or a
    /// table of the file, the strength and how it lies on the surface. Not on glass.
    pub normal_map: Option<At<Named<NormalTexture>>>,
    /// Whether `diffuse` is multiplied by the vertex colours of the mesh file. Without a `material` of the scene file
    /// a mesh shows its vertex colours anyway.
    #[serde(default)]
    pub vertex_colours: bool,
    /// Image file, relative to the scene file, of cut-outs such as leaves and fences: where it is below a half,
    /// the surface is not there. Its alpha channel counts if that is not opaque all over, else the mean of its
    /// colours, as stored. Or a table of the file and how it lies on the surface. Of glass, thin panes alone.
    pub alpha: Option<At<NamedTexture>>,
    /// Reflectance of a mirror, linear RGB or one number for grey. Absent: 0.
    pub mirror: Option<At<Reflectance>>,
    /// Roughness of the mirror: 0 is perfect, 0.2 brushed metal, 1 nearly matte. Or an image file of it, relative to
    /// the scene file, whose green counts as it stands; or a table of the file, the channel and how it lies on the surface.
    pub roughness: Option<At<MappedShare>>,
    /// Plastic, varnish, metal: the parameters that glTF and Blender have for most materials.
    pub principled: Option<At<Principled>>,
    /// Glass, clear or absorbing.
    pub glass: Option<At<Glass>>,
    /// Emitted radiance, W/(m² sr), linear RGB or one number for grey. Absent: 0, or 1 where there is an `emission_texture`.
    /// Spheres and meshes then light the scene; a sphere with `alpha` only glows.
    pub emission: Option<Amount>,
    /// Image file, relative to the scene file, that multiplies `emission`, or a table of the file and how it lies on the
    /// surface. A sphere with it only glows.
    pub emission_texture: Option<At<NamedTexture>>,
    /// Whether the back of a face emits too.
    #[serde(default)]
    pub emits_back: bool,
}

/// A boundary between glass and air, smooth or rough, or a thin pane.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Glass {
    /// Index of refraction of the inside relative to the outside.
    #[serde(default = "window_glass")]
    ior: Ior,
    /// Roughness: 0 is polished, 0.3 frosted, 1 as ground as glass gets. Or an image file of it, relative to the scene file,
    /// whose green counts as it stands; or a table of the file, the channel and how it lies on the surface. Absent: 0. Rough
    /// glass has no `priority`.
    roughness: Option<At<MappedShare>>,
    /// Share of light that each crossing of the surface lets through: twice of a body, once of a thin pane.
    #[serde(default = "Reflectance::white")]
    tint: Reflectance,
    /// Absorption coefficient of the inside, per unit of length, linear RGB or one number for grey: over a
    /// length x the share exp(-absorption x) of the light remains. The surface must be closed, and a camera inside it needs a `priority`. Absent: 0.
    absorption: Option<At<Amount>>,
    /// For bodies that touch, overlap or lie in one another, as tea in a glass: where several are at one
    /// place, the one of the highest priority counts. `ior` is then that of the body itself. Absent: the
    /// body overlaps nothing.
    priority: Option<At<Int<0, 255>>>,
    /// Whether the surface is a whole pane without thickness, such as a window: light is reflected at both of its faces
    /// and goes straight through. It need not be closed. Neither `absorption` nor `priority` stands beside it.
    #[serde(default)]
    thin: bool,
}

fn window_glass() -> Ior {
    Ior(1.5)
}

impl Material {
    /// The files of its images, with what they serve as.
    pub fn images(&self) -> ImagesOf<(At<String>, ImageUse)> {
        let principled = self.principled.as_deref();
        let texture = principled.map_or(self.texture.as_ref(), |p| p.base_texture.as_ref());
        let roughness = self.own_roughness().map(|key| (key, ChannelName::Green));
        let plain = [roughness, None, None, None, None, None];
        let shares = principled.map_or(plain, Principled::shares).map(|share| {
            let (file, channel) = share.and_then(|(key, usual)| key.data_file(usual))?;
            Some((file, ImageUse::Data(channel)))
        });
        let of = |key: Option<&At<NamedTexture>>, what| key.map(|key| (key.image_file(), what));
        let normals = |key: Option<&At<Named<NormalTexture>>>| {
            key.map(|key| (key.image_file(), ImageUse::Normals))
        };
        ImagesOf {
            texture: of(texture, ImageUse::Colour),
            specular_texture: of(
                principled.and_then(|p| p.specular_texture.as_ref()),
                ImageUse::Light,
            ),
            normals: normals(self.normal_map.as_ref()),
            coat_normals: normals(principled.and_then(|p| p.clearcoat_normal_map.as_ref())),
            alpha: of(self.alpha.as_ref(), ImageUse::Mask),
            emission: of(self.emission_texture.as_ref(), ImageUse::Light),
            shares,
        }
    }

    /// As scene data; `images` are the world's numbers of [`images`](Self::images).
    pub fn build(
        &self,
        name: &str,
        source: &Source,
        images: &ImagesOf<u32>,
    ) -> Result<scene::Material> {
        self.check(source)?;
        let ImagesOf { texture, normals, alpha, emission, shares, .. } = images;
        let own_roughness = self.own_roughness().map(|key| key.parts(shares[0]));
        let (roughness, roughness_map) = own_roughness.unwrap_or_default();
        let glass = self.glass.as_ref().map(|g| scene::Glass {
            roughness,
            ior: g.ior.0,
            tint: g.tint.rgb(),
            absorption: g.absorption.as_ref().map_or_else(Default::default, |a| a.rgb()),
            priority: g.priority.as_ref().map(|p| p.u32() as u8),
            thin: g.thin,
        });
        let built = scene::Material {
            name: name.to_owned(),
            diffuse: self.albedo().map_or_else(Default::default, |d| d.rgb()),
            texture: texture::laid(&self.texture, *texture),
            normal_map: texture::normals(&self.normal_map, *normals),
            vertex_colours: self.vertex_colours,
            alpha: texture::laid(&self.alpha, *alpha),
            mirror: self.mirror.as_ref().map_or_else(Default::default, |m| m.rgb()),
            roughness: if self.glass.is_some() { 0.0 } else { roughness },
            roughness_map,
            fresnel: None,
            glass,
            emission: match (self.emission, emission) {
                (Some(factor), _) => factor.rgb(),
                (None, Some(_)) => Rgb::ONE,
                (None, None) => Rgb::ZERO,
            },
            emission_map: texture::laid(&self.emission_texture, *emission),
            emits_back: self.emits_back,
        };
        Ok(match self.principled.as_deref() {
            None => built,
            Some(principled) => principled.build(built, images),
        })
    }

    /// The roughness of its mirror or its glass, of which it has one at most.
    fn own_roughness(&self) -> Option<&At<MappedShare>> {
        self.glass.as_ref().map_or(self.roughness.as_ref(), |glass| glass.roughness.as_ref())
    }

    fn albedo(&self) -> Option<Reflectance> {
        let paints = self.texture.is_some() || self.vertex_colours;
        self.diffuse.or_else(|| paints.then(Reflectance::white))
    }

    fn check_transmission(&self, principled: &At<Principled>, source: &Source) -> Result<()> {
        let is_glass = principled.has_glass();
        let message = match principled.absorption.as_ref() {
            _ if !is_glass && principled.says_glass() => {
                "`tint`, `absorption` and `thin` are of the glass: they need a `transmission` above 0"
            }
            Some(_) if principled.thin => {
                "`absorption` is of a body, and a thin pane has no inside"
            }
            _ if is_glass && self.alpha.is_some() && !principled.thin => {
                "what has a `transmission` has no cut-outs: its body is closed, and a hole would leave it open; a thin pane may have some"
            }
            _ if is_glass
                && (self.normal_map.is_some() || principled.clearcoat_normal_map.is_some()) =>
            {
                "what has a `transmission` has no normal map: what it refracts follows the surface that rays meet"
            }
            _ => return Ok(()),
        };
        Err(source.fault(&principled.span, message).into())
    }

    fn check(&self, source: &Source) -> Result<()> {
        if let Some(principled) = &self.principled {
            let keys = [
                ("diffuse", self.diffuse.is_some()),
                ("texture", self.texture.is_some()),
                ("mirror", self.mirror.is_some()),
                ("roughness", self.roughness.is_some()),
                ("glass", self.glass.is_some()),
            ];
            if let Some((key, _)) = keys.iter().find(|(_, is_there)| *is_there) {
                let message = format!(
                    "`principled` says how light is reflected: `{key}` does not stand beside it"
                );
                let help = "its own keys are `base_colour`, `base_texture`, `metallic`, `roughness`, `ior`, \
                            `specular`, `specular_colour`, `specular_texture`, `clearcoat`, `clearcoat_roughness`, \
                            `clearcoat_normal_map`, `transmission`, `tint`, `absorption` and `thin`";
                return Err(source.fault(&principled.span, message).help(help).into());
            }
            self.check_transmission(principled, source)?;
            if let Some(map) =
                principled.clearcoat_normal_map.as_ref().filter(|_| !principled.has_coat())
            {
                let message =
                    "`clearcoat_normal_map` is of the clear coat: it needs a `clearcoat` above 0";
                return Err(source.fault(&map.span, message).into());
            }
        }
        if let Some(glass) = &self.glass {
            let absorption = glass.absorption.as_ref().map(|a| (&a.span, "absorption"));
            let of_body = absorption.or(glass.priority.as_ref().map(|p| (&p.span, "priority")));
            if let Some((span, key)) = of_body.filter(|_| glass.thin) {
                let message = format!("`{key}` is of a body, and a thin pane has no inside");
                return Err(source.fault(span, message).into());
            }
            let is_rough = glass.roughness.as_deref().is_some_and(|key| key.factor() != 0.0);
            if let Some(priority) = glass.priority.as_ref().filter(|_| is_rough) {
                let message = "glass with a `priority` is polished: it has no `roughness`";
                return Err(source.fault(&priority.span, message).into());
            }
            if let Some(alpha) = self.alpha.as_ref().filter(|_| !glass.thin) {
                let message = "glass has no cut-outs: its body is closed, and a hole would leave it open; a thin pane may have some";
                return Err(source.fault(&alpha.span, message).into());
            }
            if let Some(map) = &self.normal_map {
                let message =
                    "glass has no normal map: what it refracts follows the surface that rays meet";
                return Err(source.fault(&map.span, message).into());
            }
            let paints = self.texture.is_some() || self.vertex_colours;
            let others = self.diffuse.is_some() || paints || self.mirror.is_some();
            if others || self.emission.is_some() || self.emission_texture.is_some() {
                let message = "glass stands alone: a material that has it has neither `diffuse`, `texture`, \
                               `vertex_colours`, `mirror`, `emission` nor `emission_texture`";
                return Err(source.fault(&glass.span, message).into());
            }
        }
        if let (Some(roughness), None) = (&self.roughness, &self.mirror) {
            let message = "`roughness` is the mirror's: it needs `mirror`";
            let help = "glass has its own: `glass = { roughness = 0.3 }`";
            return Err(source.fault(&roughness.span, message).help(help).into());
        }
        if let (Some(diffuse), Some(mirror)) = (self.albedo(), &self.mirror) {
            let sums = [0, 1, 2].map(|c| diffuse.0[c].0 + mirror.0[c].0);
            // Sums such as 0.1 + 0.9 may round to a little over 1.
            if let Some(channel) = sums.iter().position(|s| *s > 1.0 + 1e-9) {
                let message = format!(
                    "`diffuse` and `mirror` together reflect {} of {} light; at most 1 is possible",
                    sums[channel],
                    ["red", "green", "blue"][channel]
                );
                let fault = source.fault(&mirror.span, message);
                return Err(match self.diffuse {
                    Some(_) => fault.into(),
                    None => fault
                        .help("beside a texture or vertex colours `diffuse` is 1 unless it is given: it multiplies them")
                        .into(),
                });
            }
        }
        Ok(())
    }
}
