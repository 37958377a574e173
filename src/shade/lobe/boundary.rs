//! What a boundary of glass reflects by angle, and what rough boundaries pass on in all.

use super::microfacet::{shadowed, unmasked};
use super::share_table::{self, ShareTable};
use crate::math::DVec3;
use crate::scene::Glass;
use crate::shade::optics;
use std::sync::OnceLock;

/// Samples for a node of the table of lost shares.
const SAMPLES: u32 = 4096;

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

    /// The share of light from a direction of cosine `cos` that a body's boundary of this roughness reflects or lets through
    /// where it meets one microfacet; the rest, which meets several, is to be given back (as Turquin, 2019, does for mirrors).
    pub fn passed(&self, roughness: f64, cos: f64) -> f64 {
        1.0 - lost(self.eta, roughness, cos)
    }
}

/// The share of light from a direction of cosine `cos` that one microfacet does not pass on, for an index of refraction `eta`.
fn lost(eta: f64, roughness: f64, cos: f64) -> f64 {
    if !(eta > 0.0 && eta < f64::INFINITY) {
        return f64::NAN;
    }
    Table::of(eta).lost.at(roughness, cos)[0]
}

/// [`lost`] by roughness and angle, for one index of refraction. Those that are in use form a chain, to which no thread waits to
/// add: a scene has few.
struct Table {
    eta: f64,
    lost: ShareTable<1>,
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
        let lost = ShareTable::new(|alpha, wo| {
            let passed = |m, weight: f64| [weight * passed_by(m, alpha, wo, eta)];
            share_table::mean(places(), (alpha, wo), passed).map(|passed| 1.0 - passed)
        });
        Self { eta, lost, next: Chain::new() }
    }
}

/// Hammersley's points. Towards total reflection the share changes so fast that as many in rows miss it.
fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..SAMPLES).map(|i| {
        let reversed = f64::from(i.reverse_bits()) / (f64::from(u32::MAX) + 1.0);
        [reversed + 0.5 / f64::from(SAMPLES), (f64::from(i) + 0.5) / f64::from(SAMPLES)]
    })
}

/// The share of light along `wo` that the microfacet `m` passes on, where the surface's normal is +z.
fn passed_by(m: DVec3, alpha: f64, wo: DVec3, eta: f64) -> f64 {
    let split = optics::split(wo, m, eta);
    let back = optics::reflect(wo, m).z;
    let reflected = if back > 0.0 { shadowed(alpha, wo.z, back) } else { 0.0 };
    let through = split.refracted.filter(|wi| wi.z < 0.0).map_or(0.0, |wi| unmasked(alpha, -wi.z));
    split.reflectance * reflected + (1.0 - split.reflectance) * through
}

#[cfg(test)]
mod tests {
    use super::super::microfacet::{direction, visible_normal};
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
            let wo = direction(cos, 0.0);
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
            // Flat above the surface little is passed on, and it changes fast.
            let most = if cos > 0.04 { 0.003 } else { 0.015 };
            assert!(off < most, "{told}: {found} for {exact}");
        }
        println!("worst share {worst}");
        let start = std::time::Instant::now();
        Table::new(1.37);
        println!("table in {:?}", start.elapsed());
    }
}
