//! Counts that travel upwards: rays by kind, and samples that are no radiance. Merging is order-free.

mod audit;

pub use audit::{AuditSums, DrawnSum};

use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Rays cast, by kind. `retry` and `invalid` count inside the other kinds' rays, not beside them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Rays reflected by mirrors.
    pub mirror: u64,
    /// Rays reflected or refracted by glass.
    pub glass: u64,
    /// Shadow rays to area lights.
    pub shadow_area: u64,
    /// Shadow rays to point and directional lights.
    pub shadow_delta: u64,
    /// Shadow rays to the sky.
    pub shadow_sky: u64,
    /// Second tries after a miss inside the bounds.
    pub retry: u64,
    /// Rays refused before tracing (NaN, infinite, zero direction).
    pub invalid: u64,
}

impl RayCounts {
    /// Each kind by name, with its rays.
    pub fn by_kind(&self) -> [(&'static str, u64); 8] {
        [
            ("camera", self.camera),
            ("mirror", self.mirror),
            ("glass", self.glass),
            ("shadow of area lights", self.shadow_area),
            ("shadow of other lights", self.shadow_delta),
            ("shadow of the sky", self.shadow_sky),
            ("second tries", self.retry),
            ("invalid", self.invalid),
        ]
    }

    /// All rays that were traced, second tries included.
    pub fn total(&self) -> u64 {
        self.camera
            + self.mirror
            + self.glass
            + self.shadow_area
            + self.shadow_delta
            + self.shadow_sky
            + self.retry
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.camera += o.camera;
        self.mirror += o.mirror;
        self.glass += o.glass;
        self.shadow_area += o.shadow_area;
        self.shadow_delta += o.shadow_delta;
        self.shadow_sky += o.shadow_sky;
        self.retry += o.retry;
        self.invalid += o.invalid;
    }
}

/// Surface points that a kept light could shine on, and how many of them needed no ray to one.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReuseCounts {
    /// Points seen directly.
    pub direct: u64,
    /// Those of them that were inferred.
    pub direct_inferred: u64,
    /// Points seen in mirrors and through glass.
    pub specular: u64,
    /// Those of them that were inferred.
    pub specular_inferred: u64,
}

impl ReuseCounts {
    /// Whether there was nothing to infer.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether anything was inferred.
    pub fn is_inferred(&self) -> bool {
        self.direct_inferred + self.specular_inferred > 0
    }

    /// Share of the points that were inferred, 0 to 1; `None` where there was none to infer.
    pub fn share(&self) -> Option<f64> {
        share(self.direct_inferred + self.specular_inferred, self.direct + self.specular)
    }

    /// That of the points seen in mirrors and through glass.
    pub fn specular_share(&self) -> Option<f64> {
        share(self.specular_inferred, self.specular)
    }
}

fn share(part: u64, all: u64) -> Option<f64> {
    (all > 0).then(|| part as f64 / all as f64)
}

impl AddAssign for ReuseCounts {
    fn add_assign(&mut self, o: Self) {
        self.direct += o.direct;
        self.direct_inferred += o.direct_inferred;
        self.specular += o.specular;
        self.specular_inferred += o.specular_inferred;
    }
}

/// What is wrong with light that is no radiance; later kinds outdo earlier ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// Some channel is negative.
    Negative,
    /// Some channel is infinite.
    Infinite,
    /// Some channel is not a number.
    NotANumber,
}

impl Fault {
    /// What is wrong with the linear RGB radiance `channels`, if anything.
    pub fn of(channels: [f32; 3]) -> Option<Self> {
        if channels.iter().any(|c| c.is_nan()) {
            Some(Self::NotANumber)
        } else if channels.iter().any(|c| c.is_infinite()) {
            Some(Self::Infinite)
        } else {
            channels.iter().any(|c| *c < 0.0).then_some(Self::Negative)
        }
    }
}

/// Camera samples that are no radiance, each counted once, by its worst fault.
///
/// They stay in the picture as they are: a pixel that is NaN is NaN in an exr file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BadSamples {
    /// Some channel is not a number.
    pub nan: u64,
    /// Some channel is infinite; also pixels whose sum of finite samples is.
    pub infinite: u64,
    /// Some channel is negative.
    pub negative: u64,
    /// Column and row of the first pixel that has one, row by row.
    pub first: Option<[u32; 2]>,
}

impl BadSamples {
    /// All of them.
    pub fn total(&self) -> u64 {
        self.nan + self.infinite + self.negative
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        self.total() == 0
    }

    /// One more, of pixel `(x, y)`.
    pub fn count(&mut self, fault: Fault, x: u32, y: u32) {
        let mut one = Self { first: Some([x, y]), ..Self::default() };
        match fault {
            Fault::NotANumber => one.nan = 1,
            Fault::Infinite => one.infinite = 1,
            Fault::Negative => one.negative = 1,
        }
        *self += one;
    }
}

impl AddAssign for BadSamples {
    fn add_assign(&mut self, o: Self) {
        self.nan += o.nan;
        self.infinite += o.infinite;
        self.negative += o.negative;
        let pixels = [self.first, o.first].into_iter().flatten();
        self.first = pixels.min_by_key(|[x, y]| (*y, *x));
    }
}

impl std::fmt::Display for BadSamples {
    /// `12 NaN, 3 negative`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let kinds = [(self.nan, "NaN"), (self.infinite, "infinite"), (self.negative, "negative")];
        let words: Vec<String> = kinds
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, name)| format!("{count} {name}"))
            .collect();
        f.write_str(&words.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_have_names_and_the_worst_one_counts() {
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        assert_eq!(Fault::of([0.0, -0.0, 1e38]), None);
        assert_eq!(Fault::of([1.0, -1e-30, 0.0]), Some(Fault::Negative));
        assert_eq!(Fault::of([-1.0, inf, 0.0]), Some(Fault::Infinite));
        assert_eq!(Fault::of([-1.0, -inf, nan]), Some(Fault::NotANumber));
    }

    #[test]
    fn sums_keep_the_first_pixel_in_any_order() {
        let mut a = BadSamples::default();
        a.count(Fault::NotANumber, 3, 4);
        let mut b = BadSamples::default();
        b.count(Fault::Negative, 7, 2);
        let (mut ab, mut ba) = (a, b);
        ab += b;
        ba += a;
        assert_eq!(ab, ba);
        assert_eq!((ab.total(), ab.first), (2, Some([7, 2])));
        assert_eq!(ab.to_string(), "1 NaN, 1 negative");
    }
}
