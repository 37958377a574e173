//! Layers over a diffuse part, whose reflection grows towards grazing angles, and what each leaves to those below.

use super::glossy::Microfacets;
use super::part_glass::PartGlass;
use super::reflectance::Reflectance;
use super::{diffuse, facing_normal, glossy};
use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb};
use crate::scene::{Fresnel, Material, Scene, TextureMap};
use crate::shade::cone::RayCone;
use crate::shade::texture;

/// Reflectance of a clear coat at normal incidence: of an index of refraction of 1.5.
const COAT: f64 = 0.04;

/// The layers of a surface at one of its points as one viewer sees them, images looked up. Of each light what a layer
/// reflects is taken from those below, by the share that it reflects towards the viewer: in a furnace all add up to
/// one, but light that comes in flat is not weakened more than other light is.
pub(in crate::shade) struct Layers<'s> {
    /// The share of irradiance that the diffuse layer sends out.
    pub albedo: Rgb,
    /// The mirror over it.
    pub mirror: Reflectance,
    pub facets: Microfacets,
    /// The clear coat over both.
    pub coat: Option<Coat<'s>>,
    /// The glass beside diffuse layer and mirror, under the coat.
    pub glass: Option<PartGlass>,
}

/// A clear coat at one point of a surface, as one viewer sees it.
#[derive(Clone, Copy)]
pub(in crate::shade) struct Coat<'s> {
    pub reflectance: Reflectance,
    pub facets: Microfacets,
    /// The point, with the coat's own shading normal.
    pub si: &'s SurfaceInteraction,
}

impl Coat<'_> {
    /// The share of light that it lets through to the viewer.
    fn passed(&self) -> f32 {
        1.0 - self.reflectance.single(&self.facets).x
    }
}

impl<'s> Layers<'s> {
    /// The layers of `material`, whose reflectance grows as `fresnel` says, at the point `si`, seen along `wo` (unit,
    /// leaving) by a ray with this `cone`. `coated` is the point with the shading normal of the clear coat.
    pub fn at(
        scene: &Scene,
        (material, fresnel): (&Material, &Fresnel),
        (si, wo, cone): (&SurfaceInteraction, DVec3, RayCone),
        coated: &'s SurfaceInteraction,
    ) -> Self {
        let seen = (si, wo, cone);
        let base = diffuse::albedo(scene, material, si, wo, cone);
        let roughness = glossy::roughness(scene, (material, material.roughness), seen);
        let share = |map: &Option<TextureMap>| texture::share(scene, map.as_ref(), seen);
        let metal = fresnel.metallic * share(&fresnel.metallic_map);
        let specular = share(&fresnel.specular_map) as f32;
        let transmission = fresnel.transmission * share(&fresnel.transmission_map);
        let clearcoat = fresnel.clearcoat * share(&fresnel.clearcoat_map);
        let facets = Microfacets::new(roughness, facing_normal(si, wo).dot(wo));
        let (metal, no_metal) = (metal as f32, (1.0 - metal) as f32);
        let other = no_metal * (1.0 - transmission as f32);
        let grazing = Rgb::splat(fresnel.grazing as f32);
        let normal = fresnel.specular_colour_map.map_or(material.mirror, |map| {
            // An image may hold any colour, and nothing reflects more than all. Not `min`, which would hide what is NaN.
            let reflected = material.mirror * texture::shown(scene, &map, seen);
            Rgb::select(reflected.cmpgt(Rgb::ONE), Rgb::ONE, reflected)
        });
        let shine = Reflectance::growing(normal * specular, grazing * specular);
        let shine = shine.given_back(&facets);
        let of_metal = Reflectance::growing(base, Rgb::ONE).given_back(&facets);
        let coat = (clearcoat != 0.0).then(|| {
            let [normal, all] = [COAT, 1.0].map(|share| Rgb::splat((clearcoat * share) as f32));
            let roughness = fresnel.clearcoat_roughness * share(&fresnel.clearcoat_roughness_map);
            let facets = Microfacets::new(roughness, facing_normal(coated, wo).dot(wo));
            let reflectance = Reflectance::growing(normal, all).given_back(&facets);
            Coat { reflectance, facets, si: coated }
        });
        let passed = coat.map_or(1.0, |coat| coat.passed());
        let mirror = Reflectance {
            normal: shine.normal * other + of_metal.normal * metal,
            rise: shine.rise * other + of_metal.rise * metal,
        };
        // By the channel that most is reflected of, so that the rest is not tinted.
        let reflected = shine.single(&facets).max_element();
        Self {
            albedo: base * (other * (1.0 - reflected) * passed),
            mirror: mirror.scaled(Rgb::splat(passed)),
            facets,
            coat,
            glass: (transmission != 0.0)
                .then(|| super::painted_glass(scene, material, seen))
                .flatten()
                .map(|glass| PartGlass { glass, share: no_metal * transmission as f32 * passed }),
        }
    }
}
