//! What the samples about a point tell of one light: means, lane by lane.

use super::Lookup;
use crate::math::Vec3;
use crate::reuse::reference::Change;
use crate::reuse::taps::{Taps, sum};
use wide::{CmpEq, CmpGt, f32x4};

/// Weighted sums over the taps that know a light, and the largest changes, lane by lane.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f32x4,
    share: f32x4,
    mean: f32x4,
    squares: f32x4,
    samples: f32x4,
    x: f32x4,
    y: f32x4,
    z: f32x4,
    slope: Largest,
    bend: Largest,
}

/// The largest of numbers none of which is negative; NaN is no number.
#[derive(Clone, Copy)]
struct Largest(f32x4);

impl Default for Largest {
    fn default() -> Self {
        Self(f32x4::splat(-1.0))
    }
}

impl Largest {
    fn note(&mut self, other: f32x4) {
        self.0 = other.cmp_gt(self.0).blend(other, self.0);
    }

    /// NaN where none was noted.
    fn get(self) -> f32 {
        let [a, b, c, d] = self.0.to_array();
        let most = a.max(b).max(c.max(d));
        if most < 0.0 { f32::NAN } else { most }
    }
}

/// What the taps tell of one light.
#[derive(Clone, Copy)]
pub(super) struct Told {
    /// Weighted mean of the ratios of the taps that know it.
    pub mean: f32,
    /// Weighted mean of the squared distances from that.
    pub variance: f32,
    /// Weighted mean of their camera samples.
    pub samples: f32,
    /// How far their weighted mean lies from the point, footprints.
    pub offset: f32,
    /// Largest changes around them.
    pub change: Change,
}

impl Lookup<'_> {
    /// `None` where too few of the taps know the light.
    pub(super) fn told(&self, taps: &Taps, channel: usize) -> Option<Told> {
        let mut first = f32::NAN;
        let mut sums = Sums::default();
        for four in taps.fours() {
            let own = self.references[four.reference as usize].known(&four.samples, channel);
            let known = own.ratio.cmp_eq(own.ratio);
            let weight = four.weight & known;
            if first.is_nan() {
                let lane = weight.cmp_gt(f32x4::ZERO).move_mask().trailing_zeros() as usize;
                first = own.ratio.to_array().get(lane).copied().unwrap_or(first);
            }
            // From the first, so that equal ones give just that, and no variance.
            let further = (own.ratio - f32x4::splat(first)) & known;
            let share = four.share & known;
            let [x, y, z] = four.apart;
            sums.weight += weight;
            sums.share += share;
            sums.mean += share * further;
            sums.squares += share * further * further;
            sums.samples += share * four.camera_samples;
            sums.x += share * x;
            sums.y += share * y;
            sums.z += share * z;
            sums.slope.note(own.slope);
            sums.bend.note(own.bend);
        }
        if f64::from(sum(sums.weight)) < self.evidence.least_weight {
            return None;
        }
        let share = 1.0 / sum(sums.share);
        let mean = sum(sums.mean) * share;
        let offset = Vec3::new(sum(sums.x), sum(sums.y), sum(sums.z));
        Some(Told {
            // Rounding may leave it a little outside.
            mean: (first + mean).clamp(0.0, 1.0),
            variance: (sum(sums.squares) * share - mean * mean).max(0.0),
            samples: sum(sums.samples) * share,
            offset: offset.length() * share,
            change: Change { slope: sums.slope.get(), bend: sums.bend.get() },
        })
    }
}
