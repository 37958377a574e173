//! How a surface scatters light, lobe by lobe.
//!
//! Takes a material and a point of its surface; gives the lobes, textures looked up: what share of a light
//! each sends to the viewer, and the directions that it passes radiance on from. One file for each kind;
//! nothing else in `shade` asks for the kind.

mod boundary;
mod dielectric;
mod diffuse;
mod glossy;
mod layers;
mod microfacet;
mod mirror;
mod part_glass;
mod reflectance;
mod rough_glass;
mod share_table;

use super::cone::RayCone;
use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb};
use crate::scene::{Glass, Material, Scene};
use crate::stats::RayKind;
use boundary::Boundary;
pub(super) use dielectric::{Dielectric, Pane};
pub(super) use diffuse::albedo;
use glossy::{Glossy, Microfacets};
pub(super) use layers::Layers;
use mirror::Mirror;
use part_glass::{PartGlass, SmoothPart};
use reflectance::Reflectance;
use rough_glass::RoughGlass;

/// One of the ways in which a surface scatters light that depend on the direction, at one of its points. Diffuse
/// reflection does not: light is multiplied by its [`albedo`].
pub(super) enum Lobe {
    Mirror(Mirror),
    Glossy(Glossy),
    Dielectric(Dielectric),
    Pane(Pane),
    RoughGlass(RoughGlass),
    SmoothPart(SmoothPart),
}

/// A direction that a lobe passes radiance on from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scattered {
    /// Unit direction, leaving the surface.
    pub wi: DVec3,
    /// Share of the radiance that is passed on, of all wavelengths alike: of a direction that was sampled at random, with
    /// `tint`, `f` times the cosine over the density.
    pub share: f32,
    /// The same by wavelength.
    pub tint: Rgb,
    /// Where the ray goes on behind the surface: the index of refraction there over that before it.
    pub transmitted: Option<f64>,
    /// Density of the direction among the lobe's, per steradian; 0 of a delta lobe.
    pub pdf: f64,
}

/// Calls `take` with each lobe of `material` at the point `si`, seen along `wo` (unit, leaving) by a ray with this cone, that
/// depends on the direction; with the number of its first direction among those of all; and with the point, which has the
/// shading normal of the lobe. `layers` are the material's there, if
/// its reflectance grows towards grazing angles. Lobes that the kernel leaves out, since no material of the scene has them,
/// cost nothing.
#[inline(always)]
pub(super) fn for_each_directional<const MIRROR: bool, const GLASS: bool>(
    scene: &Scene,
    (material, layers): (&Material, Option<&Layers>),
    seen: (&SurfaceInteraction, DVec3, RayCone),
    mut take: impl FnMut(Lobe, u32, &SurfaceInteraction),
) {
    let (si, wo, _) = seen;
    if let Some(Layers { mirror, facets, coat, glass, albedo: _ }) = layers.filter(|_| MIRROR) {
        let coat = coat.as_ref().map(|coat| (coat.reflectance, &coat.facets, coat.si));
        let mut over = [Some((*mirror, facets, si)), coat, None];
        if let Some(part) = glass.as_ref().filter(|_| GLASS) {
            let lobes = part.lobes((*mirror, facets), si, wo);
            // A smooth one has both directions.
            let firsts = [0, u32::from(part.glass.is_rough())];
            lobes
                .into_iter()
                .zip(firsts)
                .for_each(|(l, at)| l.into_iter().for_each(|l| take(l, at, si)));
            over = [None, None, coat];
        }
        for (first, layer) in (0..).zip(over) {
            let Some((reflectance, facets, si)) = layer else { continue };
            if reflectance != Reflectance::constant(Rgb::ZERO) {
                take(reflecting(reflectance, facets, facing_normal(si, wo), wo), first, si);
            }
        }
        return;
    }
    if MIRROR && material.mirror != Rgb::ZERO && material.fresnel.is_none() {
        take(
            match material.roughness {
                0.0 => Lobe::Mirror(Mirror::new(material.mirror)),
                _ => {
                    let n = facing_normal(si, wo);
                    let factor = material.roughness;
                    let roughness = glossy::roughness(scene, (material, factor), seen);
                    let facets = Microfacets::new(roughness, wo.dot(n));
                    let reflectance = Reflectance::constant(material.mirror).given_back(&facets);
                    Lobe::Glossy(Glossy::new(reflectance, &facets, n))
                }
            },
            0,
            si,
        );
    }
    let glass = if GLASS { painted_glass(scene, material, seen) } else { None };
    if let Some(glass) = &glass {
        match (glass.thin, glass.is_rough()) {
            (true, false) => take(Lobe::Pane(Pane::new(glass)), 0, si),
            (false, false) => {
                take(Lobe::Dielectric(Dielectric::new(glass, si.is_outside(wo))), 0, si)
            }
            (_, true) => {
                let [reflected, through] = rough_glass(glass, si, wo);
                take(reflected, 0, si);
                take(through, 1, si);
            }
        }
    }
}

/// The glass of `material` at the point that is `seen`, and the share of the surface there that it is.
pub(super) fn glass_at(
    scene: &Scene,
    material: &Material,
    seen: (&SurfaceInteraction, DVec3, RayCone),
) -> Option<PartGlass> {
    let (si, wo, _) = seen;
    match &material.fresnel {
        Some(fresnel) if material.shows_layers(si.is_outside(wo)) => {
            Layers::at(scene, (material, fresnel), seen, si).glass
        }
        _ => painted_glass(scene, material, seen).map(|glass| PartGlass { glass, share: 1.0 }),
    }
}

/// The glass of a material at the point that is `seen`, images looked up; the colours of other layers count where it has such.
fn painted_glass(
    scene: &Scene,
    material: &Material,
    seen: (&SurfaceInteraction, DVec3, RayCone),
) -> Option<Glass> {
    let glass = material.glass?;
    let factor = material.fresnel.map_or(glass.roughness, |_| material.roughness);
    let tint = material
        .fresnel
        .map_or(glass.tint, |_| diffuse::painted(scene, (material, glass.tint), seen));
    let roughness = glossy::roughness(scene, (material, factor), seen);
    Some(Glass { tint, roughness, ..glass })
}

/// What a rough boundary of `glass` reflects, and what it lets through.
fn rough_glass(glass: &Glass, si: &SurfaceInteraction, wo: DVec3) -> [Lobe; 2] {
    let n = facing_normal(si, wo);
    let boundary = Boundary::new(glass, si.is_outside(wo));
    let facets = Microfacets::new(glass.roughness, wo.dot(n));
    let back = part_glass::rough_share(glass, boundary, &facets, wo.dot(n));
    let through = RoughGlass::new(boundary, glass.tint * back as f32, glass.roughness, n);
    let reflected = Glossy::of_glass(boundary, back, &facets, n);
    [Lobe::Glossy(reflected), Lobe::RoughGlass(through)]
}

/// The lobe of a mirror or coat of these `facets` at the unit normal `n` on the viewer's side, seen along `wo`.
fn reflecting(reflectance: Reflectance, facets: &Microfacets, n: DVec3, wo: DVec3) -> Lobe {
    match facets.roughness {
        0.0 => Lobe::Mirror(Mirror::new(reflectance.at(wo.dot(n)))),
        _ => Lobe::Glossy(Glossy::new(reflectance, facets, n)),
    }
}

/// The shading normal at `si` on the side of `wo`, or the geometric one where the shading normal faces away from it.
pub(super) fn facing_normal(si: &SurfaceInteraction, wo: DVec3) -> DVec3 {
    let side = if si.is_outside(wo) { 1.0 } else { -1.0 };
    if si.ns.dot(wo) * side > 0.0 { si.ns * side } else { si.ng * side }
}

impl Lobe {
    /// Whether the lobe passes on radiance from single directions only, so that it sees lights by the
    /// rays of [`sample`](Self::sample) alone.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Glossy(_) | Self::RoughGlass(_) => false,
            Self::Mirror(_) | Self::Dielectric(_) | Self::Pane(_) | Self::SmoothPart(_) => true,
        }
    }

    /// Whether light goes through the surface, so that it comes from behind it.
    pub fn is_transmission(&self) -> bool {
        matches!(self, Self::RoughGlass(_))
    }

    /// Whether the surface has the same medium on both sides.
    pub fn is_pane(&self) -> bool {
        match self {
            Self::Pane(_) => true,
            Self::RoughGlass(through) => through.is_pane(),
            Self::SmoothPart(part) => part.is_pane(),
            Self::Mirror(_) | Self::Glossy(_) | Self::Dielectric(_) => false,
        }
    }

    /// The share of irradiance from `wi` that becomes radiance towards `wo` (both unit, leaving the surface), per
    /// steradian; 0 of a delta lobe.
    pub fn f(&self, wo: DVec3, wi: DVec3) -> Rgb {
        match self {
            Self::Glossy(glossy) => glossy.f(wo, wi),
            Self::RoughGlass(through) => through.f(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::Pane(_) | Self::SmoothPart(_) => {
                Rgb::ZERO
            }
        }
    }

    /// The density of [`sample`](Self::sample) at `wi`, per steradian; 0 of a delta lobe.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        match self {
            Self::Glossy(glossy) => glossy.pdf(wo, wi),
            Self::RoughGlass(through) => through.pdf(wo, wi),
            Self::Mirror(_) | Self::Dielectric(_) | Self::Pane(_) | Self::SmoothPart(_) => 0.0,
        }
    }

    /// The directions that radiance towards `wo` is passed on from, at a surface with the unit normal `n` on
    /// either side: all of a delta lobe's, since a Whitted path follows each; else one,
    /// at random, by the pair `u` of the unit square.
    #[inline(always)]
    pub fn sample(
        &self,
        wo: DVec3,
        n: DVec3,
        u: impl FnOnce() -> [f32; 2],
    ) -> [Option<Scattered>; 2] {
        match self {
            Self::Mirror(mirror) => [Some(mirror.sample(wo, n)), None],
            Self::Glossy(glossy) => [glossy.sample(wo, u().map(f64::from)), None],
            Self::RoughGlass(through) => [through.sample(wo, u().map(f64::from)), None],
            Self::Dielectric(dielectric) => dielectric.sample(wo, n),
            Self::Pane(pane) => pane.sample(wo, n),
            Self::SmoothPart(part) => part.sample(wo, n),
        }
    }

    /// The kind of ray that is traced along a sampled direction.
    #[inline(always)]
    pub fn ray_kind(&self) -> RayKind {
        match self {
            Self::Mirror(_) => RayKind::Mirror,
            Self::Glossy(_) => RayKind::Glossy,
            Self::Dielectric(_) | Self::Pane(_) | Self::RoughGlass(_) | Self::SmoothPart(_) => {
                RayKind::Glass
            }
        }
    }
}
