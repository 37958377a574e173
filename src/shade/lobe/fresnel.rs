//! Reflection that grows towards grazing angles, and what it leaves to the layers below.

use super::glossy;
use super::{diffuse, facing_normal};
use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb};
use crate::scene::{Fresnel, Material, Scene, TextureMap};
use crate::shade::cone::RayCone;
use crate::shade::texture;

/// Reflectance of a clear coat at normal incidence: of an index of refraction of 1.5.
const COAT: f64 = 0.04;

/// The reflectance of a smooth surface by angle (Schlick, 1994).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::shade) struct Reflectance {
    /// At normal incidence.
    pub normal: Rgb,
    /// By how much it is larger at grazing angles.
    pub rise: Rgb,
}

impl Reflectance {
    /// The same at every angle.
    #[inline(always)]
    pub fn constant(reflectance: Rgb) -> Self {
        Self { normal: reflectance, rise: Rgb::ZERO }
    }

    fn growing(normal: Rgb, grazing: Rgb) -> Self {
        Self { normal, rise: grazing - normal }
    }

    /// At the angle of this cosine to the normal.
    #[inline(always)]
    pub fn at(&self, cos: f64) -> Rgb {
        self.normal + self.rise * schlick(cos) as f32
    }

    /// The share that microfacets of this reflectance, of a surface of this `roughness`, reflect of light along a direction
    /// of the cosine `cos`, light that meets a second one dropped.
    fn single(&self, roughness: f64, cos: f64) -> Rgb {
        let [all, grazing] = shares(roughness, cos);
        self.normal * all + self.rise * grazing
    }

    /// With what single reflection loses at a surface of this `roughness`, seen along a direction of the cosine `cos`: so that
    /// a white one reflects all of a uniform light (Turquin, 2019). Light is coloured at each reflection.
    pub fn given_back(self, roughness: f64, cos: f64) -> Self {
        let [all, _] = shares(roughness, cos);
        let factor = Rgb::ONE + self.normal * ((1.0 - all) / all);
        self.scaled(factor)
    }

    fn scaled(self, factor: Rgb) -> Self {
        Self { normal: self.normal * factor, rise: self.rise * factor }
    }
}

/// [`glossy::reflected_shares`], also of a smooth surface.
fn shares(roughness: f64, cos: f64) -> [f32; 2] {
    match roughness {
        0.0 => [1.0, schlick(cos) as f32],
        _ => glossy::reflected_shares(roughness, cos).map(|share| share as f32),
    }
}

/// How far the reflectance has grown from that at normal incidence, 0, to that at grazing angles, 1.
pub(super) fn schlick(cos: f64) -> f64 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// The layers of a surface at one of its points as one viewer sees them, images looked up. Of each light what a layer
/// reflects is taken from those below, by the share that it reflects towards the viewer: in a furnace all add up to
/// one, but light that comes in flat is not weakened more than other light is.
pub(in crate::shade) struct Layers {
    /// The share of irradiance that the diffuse layer sends out.
    pub albedo: Rgb,
    /// The mirror over it.
    pub mirror: Reflectance,
    pub roughness: f64,
    /// The clear coat over both.
    pub coat: Option<(Reflectance, f64)>,
}

impl Layers {
    /// The layers of `material`, whose reflectance grows as `fresnel` says, at the point `si`, seen along `wo` (unit,
    /// leaving) by a ray with this `cone`.
    pub fn at(
        scene: &Scene,
        (material, fresnel): (&Material, &Fresnel),
        (si, wo, cone): (&SurfaceInteraction, DVec3, RayCone),
    ) -> Self {
        let seen = (si, wo, cone);
        let base = diffuse::albedo(scene, material, si, wo, cone);
        let roughness = glossy::roughness(scene, material, seen);
        let metal = fresnel.metallic * share_of(scene, fresnel.metallic_map.as_ref(), seen);
        let cos = facing_normal(si, wo).dot(wo);
        let (metal, other) = (metal as f32, (1.0 - metal) as f32);
        let shine = Reflectance::growing(material.mirror, Rgb::splat(fresnel.grazing as f32));
        let shine = shine.given_back(roughness, cos);
        let of_metal = Reflectance::growing(base, Rgb::ONE).given_back(roughness, cos);
        let coat = (fresnel.clearcoat != 0.0).then(|| {
            let [normal, all] =
                [COAT, 1.0].map(|share| Rgb::splat((fresnel.clearcoat * share) as f32));
            let roughness = fresnel.clearcoat_roughness;
            (Reflectance::growing(normal, all).given_back(roughness, cos), roughness)
        });
        let passed = coat.map_or(1.0, |(coat, roughness)| 1.0 - coat.single(roughness, cos).x);
        let mirror = Reflectance {
            normal: shine.normal * other + of_metal.normal * metal,
            rise: shine.rise * other + of_metal.rise * metal,
        };
        // By the channel that most is reflected of, so that the rest is not tinted.
        let reflected = shine.single(roughness, cos).max_element();
        Self {
            albedo: base * (other * (1.0 - reflected) * passed),
            mirror: mirror.scaled(Rgb::splat(passed)),
            roughness,
            coat,
        }
    }
}

/// What an image of shares says at a point, its mean over what the ray covers; 1 without an image. An image that was made
/// in code may hold any number.
pub(super) fn share_of(
    scene: &Scene,
    map: Option<&TextureMap>,
    (si, wo, cone): (&SurfaceInteraction, DVec3, RayCone),
) -> f64 {
    let Some(map) = map else { return 1.0 };
    let footprint = cone.footprint(scene, si, wo);
    let share = f64::from(texture::mapped(scene, map, si.uv, footprint).x);
    // Not `min`, which would hide what is NaN.
    if share > 1.0 { 1.0 } else { share }
}
