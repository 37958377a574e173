//! Tables of what rough surfaces pass on in all, by roughness and angle.

use super::microfacet::{at_least, visible_normal};
use crate::math::DVec3;

/// Nodes along each axis.
const NODES: usize = 33;

/// `N` shares of the light from a direction, linear between nodes of roughness and angle.
pub(super) struct ShareTable<const N: usize>(Vec<[f64; N]>);

impl<const N: usize> ShareTable<N> {
    /// The table of what `node` gives for a slope of the microfacets and a direction, where the surface's normal is +z.
    pub fn new(node: impl Fn(f64, DVec3) -> [f64; N]) -> Self {
        let place = |i: usize| i as f64 / (NODES - 1) as f64;
        let at = |i: usize| {
            // The limits at both ends are taken from close by.
            let roughness = place(i / NODES).max(1e-3);
            let ratio = place(i % NODES).max(1e-4) / (1.0 + roughness);
            let cos = (roughness * ratio / (1.0 - ratio)).min(1.0);
            let wo = DVec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
            node(roughness * roughness, wo)
        };
        Self((0..NODES * NODES).map(at).collect())
    }

    /// The shares at a surface of this `roughness`, of light from a direction of cosine `cos`.
    pub fn at(&self, roughness: f64, cos: f64) -> [f64; N] {
        let roughness = at_least(roughness);
        let place = |x: f64| {
            let x = x.clamp(0.0, 1.0) * (NODES - 1) as f64;
            let at = (x as usize).min(NODES - 2);
            (at, x - at as f64)
        };
        // A smooth surface seen flat loses what depends on the ratio of the two alone.
        let ratio = cos / (cos + roughness) * (1.0 + roughness);
        let ((r, fr), (c, fc)) = (place(roughness), place(ratio));
        std::array::from_fn(|of| {
            let row = |r: usize| {
                let at = r * NODES + c;
                self.0[at][of] + (self.0[at + 1][of] - self.0[at][of]) * fc
            };
            row(r) + (row(r + 1) - row(r)) * fr
        })
    }
}

/// The mean over the microfacets of slope `alpha` that are seen along `wo`, by samples that `places` of the unit square choose;
/// `weighted` gives of each its shares times the given weight.
pub(super) fn mean<const N: usize>(
    places: impl Iterator<Item = [f64; 2]>,
    (alpha, wo): (f64, DVec3),
    weighted: impl Fn(DVec3, f64) -> [f64; N],
) -> [f64; N] {
    let (mut sums, mut weights) = ([0.0; N], 0.0);
    for [s, t] in places {
        // Both sides are alike, and steep microfacets, which lose most, are few.
        let weight = t * t;
        let shares = weighted(visible_normal(alpha, wo, [0.5 * s, 1.0 - t * t * t]), weight);
        sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
        weights += weight;
    }
    sums.map(|sum| sum / weights)
}
