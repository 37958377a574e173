//! Light through rough glass: frosted windows and ground surfaces.

use super::Scattered;
use super::boundary::Boundary;
use super::microfacet::{at_least, density, shadowed, unmasked, visible_normal};
use crate::math::{DVec3, Rgb, orthonormal_basis};
use crate::sampling::to_world;
use crate::shade::optics;

/// Microfacets that are smooth boundaries of glass, and what they let through (Walter, Marschner, Li and Torrance, 2007). What they
/// reflect is [`Glossy`](super::glossy::Glossy). Radiance is not scaled by the square of the index of refraction, as with smooth glass.
pub(in crate::shade) struct RoughGlass {
    boundary: Boundary,
    /// Share of what a microfacet does not reflect that it lets through, with what light loses that meets several.
    tint: Rgb,
    /// Slope of the microfacets: the square of the roughness.
    alpha: f64,
    /// Unit normal on the viewer's side.
    n: DVec3,
}

/// A microfacet that leads light from one direction to another, as seen along the second.
struct Facet {
    /// Cosines between the surface's normal and the viewer, the light (on the far side) and the microfacet.
    cos_o: f64,
    cos_i: f64,
    cos_m: f64,
    /// Cosine between the microfacet and the viewer.
    towards: f64,
    /// Solid angle of normals over that of directions of light.
    spread: f64,
}

impl RoughGlass {
    /// The lobe at a surface of this `roughness` with the unit normal `n` on the viewer's side.
    pub(super) fn new(boundary: Boundary, tint: Rgb, roughness: f64, n: DVec3) -> Self {
        let roughness = at_least(roughness);
        Self { boundary, tint, alpha: roughness * roughness, n }
    }

    /// Whether it is a thin pane, with the same medium on both sides.
    pub fn is_pane(&self) -> bool {
        self.boundary.is_pane
    }

    /// The share of irradiance from `wi`, behind the surface, that becomes radiance towards `wo` (both unit, leaving), per steradian.
    pub fn f(&self, wo: DVec3, wi: DVec3) -> Rgb {
        let Some(facet) = self.facet(wo, wi) else { return Rgb::ZERO };
        let through = 1.0 - self.boundary.reflectance(facet.towards);
        let share = self.share(facet.cos_o, facet.cos_i) * self.visible(&facet) * facet.spread;
        self.tint * (through * share / facet.cos_i) as f32
    }

    /// The density of [`sample`](Self::sample) at `wi`, per steradian.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        self.facet(wo, wi).map_or(0.0, |facet| self.visible(&facet) * facet.spread)
    }

    /// A direction for `u` in the unit square, by the microfacets that are seen along `wo`; `None` where it is on the
    /// viewer's side or all light is reflected.
    pub fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<Scattered> {
        let (s, t) = orthonormal_basis(self.n);
        let local = DVec3::new(wo.dot(s), wo.dot(t), wo.dot(self.n));
        let m = to_world(visible_normal(self.alpha, local, u), (s, t), self.n);
        let (wi, bend) = match self.boundary.is_pane {
            true => (self.across(optics::reflect(wo, m).normalize()), 1.0),
            false => (optics::split(wo, m, self.boundary.eta).refracted?, self.boundary.eta),
        };
        let facet = self.facet(wo, wi)?;
        let through = 1.0 - self.boundary.reflectance(wo.dot(m));
        let share = (through * self.share(facet.cos_o, facet.cos_i)) as f32;
        let pdf = self.visible(&facet) * facet.spread;
        Some(Scattered { wi, share, tint: self.tint, transmitted: Some(bend), pdf })
    }

    /// Density of the microfacet among those that are seen, per steradian of normals.
    fn visible(&self, facet: &Facet) -> f64 {
        let seen = unmasked(self.alpha, facet.cos_o);
        density(self.alpha, facet.cos_m) * seen * facet.towards / facet.cos_o
    }

    /// The share of light from a microfacet seen along `cos_o` that others do not hide from the far side.
    fn share(&self, cos_o: f64, cos_i: f64) -> f64 {
        match self.boundary.is_pane {
            true => shadowed(self.alpha, cos_o, cos_i),
            false => unmasked(self.alpha, cos_i),
        }
    }

    /// `direction` mirrored at the surface's plane.
    fn across(&self, direction: DVec3) -> DVec3 {
        direction - self.n * (2.0 * direction.dot(self.n))
    }

    /// The microfacet that leads light from `wi` to `wo`; `None` where none does. NaN goes on, to be counted at its pixel.
    fn facet(&self, wo: DVec3, wi: DVec3) -> Option<Facet> {
        let (cos_o, cos_i) = (wo.dot(self.n), -wi.dot(self.n));
        if cos_o <= 0.0 || cos_i <= 0.0 {
            return None;
        }
        if self.boundary.is_pane {
            let between = wo + self.across(wi);
            let towards = 0.5 * between.length();
            let cos_m = ((cos_o + cos_i) / (2.0 * towards)).min(1.0);
            return Some(Facet { cos_o, cos_i, cos_m, towards, spread: 0.25 / towards });
        }
        let eta = self.boundary.eta;
        let sum = wo + wi * eta;
        let length = sum.length();
        // Towards the viewer.
        let m = if sum.dot(self.n) < 0.0 { sum / -length } else { sum / length };
        let (towards, from) = (wo.dot(m), wi.dot(m));
        if towards <= 0.0 || from >= 0.0 {
            return None;
        }
        let spread = eta * eta * -from / (length * length);
        Some(Facet { cos_o, cos_i, cos_m: m.dot(self.n).min(1.0), towards, spread })
    }
}

#[cfg(test)]
mod tests {
    use super::super::microfacet::direction;
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn samples_have_the_density_and_the_weight_of_f_and_pdf() {
        for (eta, is_pane) in [(1.5, false), (1.0 / 1.5, false), (1.5, true)] {
            for roughness in [0.4, 0.7, 1.0] {
                for cos in [0.1, 0.5, 0.95] {
                    let boundary = Boundary { eta, is_pane };
                    let lobe = RoughGlass::new(boundary, Rgb::ONE, roughness, DVec3::Z);
                    let wo = direction(cos, 0.7);
                    let n = 1500;
                    let (mut all, mut light) = (0.0, 0.0);
                    for i in 0..n * n / 4 {
                        let (row, column) = (i / (n / 2), i % (n / 2));
                        let cos_i = (row as f64 + 0.5) / (n / 2) as f64;
                        let wi = direction(-cos_i, (column as f64 + 0.5) / (n / 2) as f64 * TAU);
                        let solid_angle = TAU / (n * n / 4) as f64;
                        all += lobe.pdf(wo, wi) * solid_angle;
                        light += f64::from(lobe.f(wo, wi).x) * cos_i * solid_angle;
                    }
                    let m = 96;
                    let at = |i: usize| (i as f64 + 0.5) / m as f64;
                    let samples: Vec<Scattered> = (0..m * m)
                        .filter_map(|i| lobe.sample(wo, [at(i / m), at(i % m)]))
                        .collect();
                    let count = (m * m) as f64;
                    let through = samples.len() as f64 / count;
                    let share = samples.iter().map(|s| f64::from(s.share)).sum::<f64>() / count;
                    let told = format!("index {eta}, roughness {roughness}, cosine {cos}");
                    assert!((all - through).abs() < 0.01, "{told}: {all} {through}");
                    assert!((light - share).abs() < 0.01, "{told}: {light} {share}");
                    for s in samples.iter().step_by(97) {
                        let f = f64::from(lobe.f(wo, s.wi).x) * -s.wi.z / s.pdf;
                        assert!(
                            (f - f64::from(s.share)).abs() < 1e-4 * f,
                            "{told}: {f} {}",
                            s.share
                        );
                    }
                }
            }
        }
    }
}
