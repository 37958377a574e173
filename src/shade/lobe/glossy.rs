//! Rough mirrors: glossy reflection.

use super::Scattered;
use super::boundary::Boundary;
use super::microfacet::{at_least, density, lambda, shadowed, visible_normal};
use super::reflectance::{Reflectance, schlick};
use super::share_table::{self, ShareTable};
use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb, orthonormal_basis};
use crate::sampling::{mix, to_world};
use crate::scene::{Material, Scene};
use crate::shade::cone::RayCone;
use crate::shade::{optics, texture};
use std::sync::OnceLock;

/// Samples along one axis for a node of the table of reflected shares, half as many along the other.
const SAMPLES: usize = 32;

/// Microfacets that are perfect mirrors, with the distribution GGX and Smith's masking of both directions
/// (Walter, Marschner, Li and Torrance, 2007; Heitz, 2014). What light loses to single reflection at rough
/// surfaces is given back (Turquin, 2019), so that a white surface reflects all of a uniform light.
pub(in crate::shade) struct Glossy {
    /// Share of light that a microfacet reflects, with what single reflection loses.
    reflectance: FacetReflectance,
    /// Slope of the microfacets: the square of the roughness.
    alpha: f64,
    /// Unit normal on the viewer's side.
    n: DVec3,
    /// The share of light that microfacets which reflect all send towards the viewer, light that meets a second one dropped.
    passed: f64,
}

/// The microfacets of a surface as they are seen along one direction.
#[derive(Debug, Clone, Copy)]
pub(in crate::shade) struct Microfacets {
    pub roughness: f64,
    /// [`reflected_shares`]; of a smooth surface those of a mirror.
    reflected: [f64; 2],
}

/// Microfacets that are tried for one direction: of a million directions less than one takes more, at any roughness.
const MOST_TRIES: u32 = 40;

/// Random numbers in the unit interval after a pair of them, a function of that pair.
struct Further(u64);

impl Further {
    fn of([u, v]: [f64; 2]) -> Self {
        Self(u.to_bits() ^ mix(v.to_bits()))
    }

    fn next(&mut self) -> f64 {
        self.0 = mix(self.0);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// What a microfacet reflects by angle.
enum FacetReflectance {
    /// As a mirror.
    Mirror(Reflectance),
    /// As a boundary of glass, times a factor.
    Glass(Boundary, f64),
    /// As a mirror and such a boundary together.
    Both(Reflectance, Boundary, f64),
}

impl Microfacets {
    /// The microfacets of a surface of this `roughness`, seen along a direction of the cosine `cos`.
    pub fn new(roughness: f64, cos: f64) -> Self {
        let reflected = match roughness {
            0.0 => [1.0, schlick(cos)],
            _ => reflected_shares(roughness, cos),
        };
        Self { roughness, reflected }
    }

    /// The share of light that they reflect where they reflect all, light that meets a second one dropped.
    pub(super) fn passed(&self) -> f64 {
        self.reflected[0]
    }
}

impl Glossy {
    /// What a boundary of glass of these `facets` reflects, times `factor`; `n` as in [`new`](Self::new).
    pub(super) fn of_glass(
        boundary: Boundary,
        factor: f64,
        facets: &Microfacets,
        n: DVec3,
    ) -> Self {
        let mirror = Self::new(Reflectance::constant(Rgb::ZERO), facets, n);
        Self { reflectance: FacetReflectance::Glass(boundary, factor), ..mirror }
    }

    /// What a mirror of this `reflectance` and a boundary of glass, times a factor, reflect together, both of these `facets`;
    /// `n` as in [`new`](Self::new).
    pub(super) fn beside_glass(
        reflectance: Reflectance,
        (boundary, factor): (Boundary, f64),
        facets: &Microfacets,
        n: DVec3,
    ) -> Self {
        let mirror = Self::new(Reflectance::constant(Rgb::ZERO), facets, n);
        Self { reflectance: FacetReflectance::Both(reflectance, boundary, factor), ..mirror }
    }

    /// The lobe of `facets` of this `reflectance`, which includes what single reflection loses, at a rough surface with the unit
    /// normal `n` on the viewer's side.
    pub fn new(reflectance: Reflectance, facets: &Microfacets, n: DVec3) -> Self {
        let roughness = at_least(facets.roughness);
        let reflectance = FacetReflectance::Mirror(reflectance);
        Self { reflectance, alpha: roughness * roughness, n, passed: facets.passed() }
    }

    /// The share of irradiance from `wi` that becomes radiance towards `wo` (both unit, leaving), per steradian.
    pub fn f(&self, wo: DVec3, wi: DVec3) -> Rgb {
        let Some(cosines) = self.cosines(wo, wi) else { return Rgb::ZERO };
        self.tint(wo, wi) * (self.reflected(cosines) / cosines[1]) as f32
    }

    /// The share of light that perfect microfacets reflect to the viewer per steradian of its directions; the cosines are those
    /// of [`cosines`](Self::cosines).
    fn reflected(&self, [cos_o, cos_i, cos_m]: [f64; 3]) -> f64 {
        let g2 = 1.0 / (1.0 + lambda(self.alpha, cos_o) + lambda(self.alpha, cos_i));
        density(self.alpha, cos_m) * g2 / (4.0 * cos_o)
    }

    /// The share of light from `wi` that the microfacet between it and `wo` reflects, with what single reflection loses.
    fn tint(&self, wo: DVec3, wi: DVec3) -> Rgb {
        let cos = 0.5 * (wo + wi).length();
        match &self.reflectance {
            FacetReflectance::Mirror(reflectance) => reflectance.at(cos),
            FacetReflectance::Glass(boundary, factor) => {
                Rgb::splat((boundary.reflectance(cos) * factor) as f32)
            }
            FacetReflectance::Both(reflectance, boundary, factor) => {
                reflectance.at(cos) + Rgb::splat((boundary.reflectance(cos) * factor) as f32)
            }
        }
    }

    /// The density of [`sample`](Self::sample) at `wi`, per steradian.
    pub fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        self.cosines(wo, wi).map_or(0.0, |cosines| self.reflected(cosines) / self.passed)
    }

    /// A direction for `u` in the unit square, by the microfacets that are seen along `wo` (Dupuy and Benyoub,
    /// 2023) and whose light others do not hide: one that is hidden counts for another. So all directions have the same
    /// weight, and those of a path that is reflected again and again do not multiply to more than what the mirrors reflect.
    pub fn sample(&self, wo: DVec3, u: [f64; 2]) -> Option<Scattered> {
        let (s, t) = orthonormal_basis(self.n);
        let local = DVec3::new(wo.dot(s), wo.dot(t), wo.dot(self.n));
        let mut further = Further::of(u);
        let mut u = u;
        for _ in 0..MOST_TRIES {
            let m = visible_normal(self.alpha, local, u);
            let wi = optics::reflect(wo, to_world(m, (s, t), self.n)).normalize();
            let leaves = |[cos_o, cos_i, _]: [f64; 3]| shadowed(self.alpha, cos_o, cos_i);
            let hidden = further.next();
            // NaN goes on, to be counted at its pixel.
            if self.cosines(wo, wi).map(leaves).is_none_or(|share| hidden > share) {
                u = [further.next(), further.next()];
                continue;
            }
            let (share, pdf) = (self.passed as f32, self.pdf(wo, wi));
            return Some(Scattered { wi, share, tint: self.tint(wo, wi), transmitted: None, pdf });
        }
        None
    }

    /// Cosines between the normal and `wo`, `wi` and the microfacet between them; `None` where one of the
    /// directions is below the surface. NaN goes on, to be counted at its pixel.
    fn cosines(&self, wo: DVec3, wi: DVec3) -> Option<[f64; 3]> {
        let (cos_o, cos_i) = (wo.dot(self.n), wi.dot(self.n));
        let cos_m = ((cos_o + cos_i) / (wo + wi).length()).min(1.0);
        (!(cos_o <= 0.0 || cos_i <= 0.0)).then_some([cos_o, cos_i, cos_m])
    }
}

/// Roughness of the mirror at the point that `seen` says, as seen towards the unit direction there, the map's mean over the
/// ray's cone included.
pub(super) fn roughness(
    scene: &Scene,
    (material, factor): (&Material, f64),
    seen: (&SurfaceInteraction, DVec3, RayCone),
) -> f64 {
    match &material.roughness_map {
        // What is polished is another lobe, which no image turns into a rough one.
        Some(map) if factor != 0.0 => at_least(factor * texture::share(scene, Some(map), seen)),
        _ => factor,
    }
}

impl Reflectance {
    /// The share that `facets` of this reflectance reflect of light along the direction that they are seen from, light that meets
    /// a second one dropped.
    pub fn single(&self, facets: &Microfacets) -> Rgb {
        let [all, grazing] = facets.reflected.map(|share| share as f32);
        self.normal * all + self.rise * grazing
    }

    /// With what single reflection loses at a surface of these `facets`: so that a white one reflects all of a uniform light
    /// (Turquin, 2019). Light is coloured at each reflection.
    pub fn given_back(self, facets: &Microfacets) -> Self {
        let all = facets.passed() as f32;
        let factor = Rgb::ONE + self.normal * ((1.0 - all) / all);
        self.scaled(factor)
    }
}

/// The share of light from a direction of cosine `cos` that leaves a surface after one reflection: where microfacets reflect
/// all, and where they reflect as much as [`schlick`] says.
fn reflected_shares(roughness: f64, cos: f64) -> [f64; 2] {
    static TABLE: OnceLock<ShareTable<2>> = OnceLock::new();
    let [all, grown] = TABLE.get_or_init(|| ShareTable::new(integrate)).at(roughness, cos);
    [all, grown + schlick(cos) * all]
}

/// [`reflected_shares`] of light along `wo`, the second less what it would be if all microfacets were seen at the angle of the
/// surface: that changes too fast between the nodes.
fn integrate(alpha: f64, wo: DVec3) -> [f64; 2] {
    let place = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let places = (0..SAMPLES * SAMPLES / 2)
        .map(|i| [place(i / SAMPLES, SAMPLES / 2), place(i % SAMPLES, SAMPLES)]);
    let [all, grown] = share_table::mean(places, (alpha, wo), |m, weight| {
        let cos_i = optics::reflect(wo, m).z;
        let share = if cos_i > 0.0 { weight * shadowed(alpha, wo.z, cos_i) } else { 0.0 };
        [share, share * schlick(wo.dot(m))]
    });
    [all, grown - schlick(wo.z) * all]
}

#[cfg(test)]
mod tests {
    use super::super::microfacet::direction;
    use super::*;
    use std::f64::consts::TAU;

    fn lobe(roughness: f64, wo: DVec3) -> Glossy {
        Glossy::new(Reflectance::constant(Rgb::ONE), &Microfacets::new(roughness, wo.z), DVec3::Z)
    }

    #[test]
    fn shares_between_the_nodes_of_the_table_are_those_of_an_integral() {
        for i in 0..40 {
            let (roughness, root) =
                (0.013 + i as f64 * 0.0245, 0.05 + (i * 7 % 40) as f64 * 0.0236);
            let cos = root * root;
            let wo = direction(cos, 0.0);
            let n = 256;
            let exact = integral(roughness, wo, n);
            let found = reflected_shares(roughness, cos);
            let off = [0, 1].map(|of| (found[of] - exact[of]).abs());
            let told = format!("roughness {roughness}, cosine {cos}: {found:?} for {exact:?}");
            // The second has the first's error, and some of its own.
            assert!(off[0] < 0.005 && off[1] < 0.006, "{told}");
        }
        // Where the share changes fastest from angle to angle.
        for roughness in [0.004, 0.01, 0.02, 0.03, 0.05, 0.08] {
            for cos in [0.03, 0.1, 0.2, 0.35, 0.6, 0.9] {
                let exact = integral(roughness, direction(cos, 0.0), 128);
                let found = reflected_shares(roughness, cos);
                let off = (found[1] - exact[1]).abs();
                assert!(off < 0.003, "{roughness}, {cos}: {found:?} for {exact:?}");
            }
        }
    }

    /// What a lobe of white microfacets and one of Schlick's reflect, by samples.
    fn integral(roughness: f64, wo: DVec3, n: usize) -> [f64; 2] {
        let at = |i: usize| (i as f64 + 0.5) / n as f64;
        let alpha = roughness * roughness;
        let facets = (0..n * n).map(|i| visible_normal(alpha, wo, [at(i / n), at(i % n)]));
        let sums = facets.fold([0.0; 2], |[all, grown], m| {
            let cos_i = optics::reflect(wo, m).z;
            let share = if cos_i > 0.0 { shadowed(alpha, wo.z, cos_i) } else { 0.0 };
            [all + share, grown + share * schlick(wo.dot(m))]
        });
        sums.map(|sum| sum / (n * n) as f64)
    }

    #[test]
    fn samples_have_the_density_and_the_weight_of_f_and_pdf() {
        // A sharper peak would take a finer grid.
        for roughness in [0.3, 0.6, 1.0] {
            for cos in [0.05, 0.4, 0.9] {
                let wo = direction(cos, 0.7);
                let lobe = lobe(roughness, wo);
                // The density over the upper half, by a fine grid, and the share of samples that fall there.
                let n = 2000;
                let (mut density, mut light, mut mean) = (0.0, 0.0, [0.0; 2]);
                let features = |wi: DVec3| [wi.z, schlick(0.5 * (wo + wi).length())];
                for i in 0..n * n / 4 {
                    let (row, column) = (i / (n / 2), i % (n / 2));
                    let cos_i = (row as f64 + 0.5) / (n / 2) as f64;
                    let wi = direction(cos_i, (column as f64 + 0.5) / (n / 2) as f64 * TAU);
                    let solid_angle = TAU / (n * n / 4) as f64;
                    density += lobe.pdf(wo, wi) * solid_angle;
                    for (mean, feature) in mean.iter_mut().zip(features(wi)) {
                        *mean += feature * lobe.pdf(wo, wi) * solid_angle;
                    }
                    light += f64::from(lobe.f(wo, wi).x) * cos_i * solid_angle;
                }
                let m = 64;
                let at = |i: usize| (i as f64 + 0.5) / m as f64;
                let samples: Vec<Scattered> =
                    (0..m * m).filter_map(|i| lobe.sample(wo, [at(i / m), at(i % m)])).collect();
                let all = (m * m) as f64;
                let above = samples.len() as f64 / all;
                let share = samples.iter().map(|s| f64::from(s.share)).sum::<f64>() / all;
                assert_eq!(above, 1.0);
                // Directions are drawn by the density, hidden ones left out.
                for (k, mean) in mean.into_iter().enumerate() {
                    let drawn = samples.iter().map(|s| features(s.wi)[k]).sum::<f64>() / all;
                    let told = format!("{roughness} {cos}: {drawn} of {mean}");
                    assert!((drawn - mean).abs() < 0.01 * mean.max(0.3), "feature {k}, {told}");
                }
                assert!((density - 1.0).abs() < 0.01, "{roughness} {cos}: {density}");
                assert!((light - share).abs() < 0.01, "{roughness} {cos}: {light} {share}");
                for s in samples.iter().step_by(97) {
                    let f = f64::from(lobe.f(wo, s.wi).x) * s.wi.z / s.pdf;
                    assert!((f - f64::from(s.share)).abs() < 1e-4 * f, "{f} {}", s.share);
                    let back = f64::from(lobe.f(s.wi, wo).x / lobe.f(wo, s.wi).x);
                    assert!((back - 1.0).abs() < 1e-5, "reciprocal: {back}");
                }
            }
        }
    }
}
