//! What a boundary of glass reflects by angle, and what rough boundaries pass on in all.

use super::glossy::reflected_shares;
use super::microfacet::{lambda, shadowed, visible_normal};
use crate::math::DVec3;
use crate::scene::Glass;
use crate::shade::optics;
use std::sync::OnceLock;

/// Nodes of the table of passed shares along its axes: index of refraction, roughness, angle.
const NODES: [usize; 3] = [17, 33, 17];
/// Samples along each axis for one node.
const SAMPLES: usize = 32;
/// The table reaches from the reciprocal of this index of refraction to it.
const LARGEST_INDEX: f64 = 3.0;

/// A boundary of glass, seen from one of its sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Boundary {
    /// Index of refraction behind the boundary over that before it; of a thin pane, that of its glass.
    pub eta: f64,
    /// Whether it is both faces of a thin pane.
    pub is_pane: bool,
}

impl Boundary {
    /// The boundary of `glass`, seen from `outside` or from inside.
    pub fn new(glass: &Glass, outside: bool) -> Self {
        let eta = if outside || glass.thin { glass.ior } else { 1.0 / glass.ior };
        Self { eta, is_pane: glass.thin }
    }

    /// Share of light reflected at the angle of this cosine to the normal, unpolarised.
    pub fn reflectance(&self, cos: f64) -> f64 {
        match self.is_pane {
            true => optics::pane_reflectance(cos, self.eta),
            false => optics::reflectance(cos, self.eta),
        }
    }

    /// The share of light from a direction of cosine `cos` that a boundary of this roughness reflects or lets through
    /// where it meets one microfacet; the rest, which meets several, is to be given back (as Turquin, 2019, does for mirrors).
    pub fn passed(&self, roughness: f64, cos: f64) -> f64 {
        match self.is_pane {
            // Light that goes through leaves as what is reflected does, but on the other side.
            true => reflected_shares(roughness, cos)[0],
            false => 1.0 - lost(self.eta, roughness, cos),
        }
    }
}

/// The share of light from a direction of cosine `cos` that one microfacet does not pass on: linear between the nodes of a
/// table over index of refraction, roughness and angle.
fn lost(eta: f64, roughness: f64, cos: f64) -> f64 {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    let [_, rows, columns] = NODES;
    let table = TABLE.get_or_init(|| {
        let all = 0..NODES.iter().product::<usize>();
        let places = all.map(|i| [i / (rows * columns), i / columns % rows, i % columns]);
        let node = |at: usize, axis: usize| at as f64 / (NODES[axis] - 1) as f64;
        places.map(|[e, r, c]| integrate(node(e, 0), node(r, 1), node(c, 2))).collect()
    });
    let most = contrast(LARGEST_INDEX);
    let axes = [
        0.5 + 0.5 * contrast(eta) / most,
        roughness,
        // As in the table of mirrors.
        cos / (cos + roughness) * (1.0 + roughness),
    ];
    let places = [0, 1, 2].map(|axis| {
        let x = axes[axis].clamp(0.0, 1.0) * (NODES[axis] - 1) as f64;
        let at = (x as usize).min(NODES[axis] - 2);
        (at, x - at as f64)
    });
    (0..8).fold(0.0, |sum, corner| {
        let (mut at, mut weight) = (0, 1.0);
        for (axis, (first, share)) in places.iter().enumerate() {
            let beyond = corner >> axis & 1;
            at = at * NODES[axis] + first + beyond;
            weight *= if beyond == 1 { *share } else { 1.0 - share };
        }
        sum + weight * table[at]
    })
}

/// An index of refraction as a number between -1 and 1, odd in its logarithm.
fn contrast(eta: f64) -> f64 {
    (eta - 1.0) / (eta + 1.0)
}

/// [`lost`] by stratified samples at a node, whose place on each axis is from 0 to 1.
fn integrate(contrast_place: f64, roughness: f64, ratio: f64) -> f64 {
    let contrast = (2.0 * contrast_place - 1.0) * contrast(LARGEST_INDEX);
    let eta = (1.0 + contrast) / (1.0 - contrast);
    // The limits at both ends are taken from close by.
    let roughness = roughness.max(1e-3);
    let ratio = ratio.max(1e-4) / (1.0 + roughness);
    let cos = (roughness * ratio / (1.0 - ratio)).min(1.0);
    let alpha = roughness * roughness;
    let wo = DVec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
    let (mut sum, mut weights) = (0.0, 0.0);
    for i in 0..SAMPLES * SAMPLES / 2 {
        // Both sides are alike, and steep microfacets, which lose most, are few.
        let u = 0.5 * ((i / SAMPLES) as f64 + 0.5) / (SAMPLES / 2) as f64;
        let t = ((i % SAMPLES) as f64 + 0.5) / SAMPLES as f64;
        let weight = t * t;
        sum += weight * passed_by(visible_normal(alpha, wo, [u, 1.0 - t * t * t]), alpha, wo, eta);
        weights += weight;
    }
    1.0 - sum / weights
}

/// The share of light along `wo` that the microfacet `m` passes on, where the surface's normal is +z.
fn passed_by(m: DVec3, alpha: f64, wo: DVec3, eta: f64) -> f64 {
    let split = optics::split(wo, m, eta);
    let back = optics::reflect(wo, m).z;
    let reflected = if back > 0.0 { shadowed(alpha, wo.z, back) } else { 0.0 };
    let through = split.refracted.filter(|wi| wi.z < 0.0).map_or(0.0, |wi| leaving(alpha, -wi.z));
    split.reflectance * reflected + (1.0 - split.reflectance) * through
}

/// The share of light that leaves a rough boundary on its far side, at the cosine `cos` to the normal there, where that side hides
/// none of it from where it came.
pub(super) fn leaving(alpha: f64, cos: f64) -> f64 {
    1.0 / (1.0 + lambda(alpha, cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_made_in_time() {
        let start = std::time::Instant::now();
        lost(1.5, 0.5, 0.5);
        println!("table {:?}", start.elapsed());
    }

    #[test]
    fn shares_between_the_nodes_of_the_table_are_those_of_an_integral() {
        let mut worst: f64 = 0.0;
        for i in 0..400usize {
            let along = |step: usize, of: usize| ((i * step) % of) as f64 / of as f64;
            let eta = 0.4 + 2.3 * along(7, 53);
            let roughness = 0.02 + 0.98 * along(11, 61);
            let root = 0.05 + 0.95 * along(17, 71);
            let cos = root * root;
            let alpha = roughness * roughness;
            let wo = DVec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
            let n = 128;
            let at = |k: usize| (k as f64 + 0.5) / n as f64;
            let passed =
                |k| passed_by(visible_normal(alpha, wo, [at(k / n), at(k % n)]), alpha, wo, eta);
            let exact = (0..n * n).map(passed).sum::<f64>() / (n * n) as f64;
            let found = Boundary { eta, is_pane: false }.passed(roughness, cos);
            let off = (found / exact - 1.0).abs();
            worst = worst.max(off);
            let told = format!("index {eta}, roughness {roughness}, cosine {cos}");
            assert!(off < 0.02, "{told}: {found} for {exact}");
        }
        println!("worst share {worst}");
    }
}
