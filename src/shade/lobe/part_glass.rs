//! Glass that is a share of a surface, beside other layers.

use super::boundary::Boundary;
use super::glossy::{Glossy, Microfacets};
use super::reflectance::Reflectance;
use super::rough_glass::RoughGlass;
use super::{Lobe, Scattered, facing_normal};
use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb};
use crate::scene::Glass;
use crate::shade::optics;

/// Glass at one point of a surface, and the share of the surface there that it is.
#[derive(Debug, Clone, Copy)]
pub(in crate::shade) struct PartGlass {
    pub glass: Glass,
    pub share: f32,
}

impl PartGlass {
    /// The glass, and the mirror of this reflectance and of these `facets` beside it, at the point `si` seen along `wo`: what both
    /// reflect is one lobe, so that it takes one ray.
    pub fn lobes(
        &self,
        (mirror, facets): (Reflectance, &Microfacets),
        si: &SurfaceInteraction,
        wo: DVec3,
    ) -> [Option<Lobe>; 2] {
        let n = facing_normal(si, wo);
        let boundary = Boundary::new(&self.glass, si.is_outside(wo));
        let cos = wo.dot(n);
        if self.glass.is_rough() {
            let back = rough_share(&self.glass, boundary, facets, cos);
            let share = f64::from(self.share) * back;
            let reflected = Glossy::beside_glass(mirror, (boundary, share), facets, n);
            let tint = self.glass.tint * share as f32;
            let through = RoughGlass::new(boundary, tint, facets.roughness, n);
            return [Some(Lobe::Glossy(reflected)), Some(Lobe::RoughGlass(through))];
        }
        // Glass that bends no light is smooth, whatever the mirror is.
        let (rough, smooth) = match facets.roughness {
            0.0 => (None, mirror.at(cos)),
            _ => (Some(Lobe::Glossy(Glossy::new(mirror, facets, n))), Rgb::ZERO),
        };
        let Self { glass: Glass { tint, .. }, share } = *self;
        let part = SmoothPart { boundary, mirror: smooth, share, tint };
        [rough, Some(Lobe::SmoothPart(part))]
    }
}

/// The factor on both lobes of rough glass that gives back what meets several of its `facets`, seen along a direction of the cosine
/// `cos`.
pub(super) fn rough_share(
    glass: &Glass,
    boundary: Boundary,
    facets: &Microfacets,
    cos: f64,
) -> f64 {
    let passed = match glass.thin {
        // Light that goes through leaves as what is reflected does, but on the other side.
        true => facets.passed(),
        false => boundary.passed(glass.roughness, cos),
    };
    1.0 / passed
}

/// A smooth boundary of glass that is a share of the surface, and a mirror.
pub(in crate::shade) struct SmoothPart {
    boundary: Boundary,
    /// Reflectance of the mirror, at this angle.
    mirror: Rgb,
    share: f32,
    /// Share of light that the glass lets through of what it does not reflect.
    tint: Rgb,
}

impl SmoothPart {
    /// Whether the surface has the same medium on both sides.
    pub fn is_pane(&self) -> bool {
        self.boundary.is_pane
    }

    /// What is reflected at the unit normal `n` on either side and, but for total reflection, what goes through.
    pub fn sample(&self, wo: DVec3, n: DVec3) -> [Option<Scattered>; 2] {
        let delta = |wi, share: f64, tint, transmitted| Scattered {
            wi,
            share: share as f32,
            tint,
            transmitted,
            pdf: 0.0,
        };
        let (reflectance, refracted) = match self.boundary.is_pane {
            true => (self.boundary.reflectance(wo.dot(n)), Some((-wo, 1.0))),
            false => {
                let split = optics::split(wo, n, self.boundary.eta);
                (split.reflectance, split.refracted.map(|wi| (wi, self.boundary.eta)))
            }
        };
        let all = self.mirror + Rgb::splat(self.share * reflectance as f32);
        let tint = self.tint * self.share;
        let through = |(wi, bend)| delta(wi, 1.0 - reflectance, tint, Some(bend));
        [Some(delta(optics::reflect(wo, n), 1.0, all, None)), refracted.map(through)]
    }
}
