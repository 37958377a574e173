//! What a boundary of glass reflects by angle, and what rough boundaries pass on in all.

use super::glossy::reflected_shares;
use super::microfacet::{lambda, shadowed, visible_normal};
use crate::math::DVec3;
use crate::scene::Glass;
use crate::shade::optics;
use std::sync::OnceLock;

/// Nodes of a table of lost shares along each axis.
const NODES: usize = 33;
/// Samples along each axis for one node.
const SAMPLES: usize = 32;

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

/// The share of light from a direction of cosine `cos` that one microfacet does not pass on, for an index of refraction `eta`.
fn lost(eta: f64, roughness: f64, cos: f64) -> f64 {
    if !(eta > 0.0 && eta < f64::INFINITY) {
        return f64::NAN;
    }
    let last = (NODES - 1) as f64;
    let place = |x: f64| {
        let x = x.clamp(0.0, 1.0) * last;
        let at = (x as usize).min(NODES - 2);
        (at, x - at as f64)
    };
    // As in the table of mirrors.
    let ratio = cos / (cos + roughness) * (1.0 + roughness);
    let ((r, fr), (c, fc)) = (place(roughness), place(ratio));
    let lost = &Table::of(eta).lost;
    let row = |r: usize| {
        let at = r * NODES + c;
        lost[at] + (lost[at + 1] - lost[at]) * fc
    };
    row(r) + (row(r + 1) - row(r)) * fr
}

/// [`lost`] by roughness and angle, for one index of refraction. Those that are in use form a chain, to which no thread waits to
/// add: a scene has few.
struct Table {
    eta: f64,
    lost: Vec<f64>,
    next: Chain,
}

type Chain = OnceLock<Box<Table>>;

impl Table {
    /// The table for `eta`, a positive number, which is made the first time.
    fn of(eta: f64) -> &'static Self {
        static FIRST: Chain = OnceLock::new();
        let mut link = &FIRST;
        loop {
            let table = link.get_or_init(|| Box::new(Self::new(eta)));
            if table.eta == eta {
                return table;
            }
            link = &table.next;
        }
    }

    fn new(eta: f64) -> Self {
        let node = |i: usize| i as f64 / (NODES - 1) as f64;
        let lost = (0..NODES * NODES).map(|i| integrate(eta, node(i / NODES), node(i % NODES)));
        Self { eta, lost: lost.collect(), next: Chain::new() }
    }
}

/// [`lost`] by stratified samples. `ratio` is of the cosine to its sum with the roughness, 1 at most.
fn integrate(eta: f64, roughness: f64, ratio: f64) -> f64 {
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
            let passed = |k: usize| {
                passed_by(visible_normal(alpha, wo, [at(k / n), at(k % n)]), alpha, wo, eta)
            };
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
