//! Conversion of linear values to sRGB levels by table: the exact rounding of the function, without evaluating it.
//!
//! The function is increasing, so a level is the number of thresholds that a value has reached. The thresholds are
//! computed once: the f32s at which the rounded function steps. The upper bits of a value select where to
//! start the search, which then takes one or a few steps.

use crate::math::{srgb_decode, srgb_encode};
use std::sync::LazyLock;

/// Levels of sRGB: what `round(max · srgb_encode(x))` is for every f32 `x` clipped to [0, 1].
pub struct Quantiser {
    /// The least value of each level; infinity after the last.
    first: Vec<f32>,
    /// Level of the smallest value in each bucket, from the bucket of `first[1]`.
    start: Vec<u16>,
    /// Bits dropped to find a bucket.
    shift: u32,
}

/// 256 levels.
pub static SRGB_8: LazyLock<Quantiser> = LazyLock::new(|| Quantiser::new(255, 16));
/// 65,536 levels.
pub static SRGB_16: LazyLock<Quantiser> = LazyLock::new(|| Quantiser::new(65_535, 12));

impl Quantiser {
    /// Levels 0 to `max`. `shift` trades the table's size for the length of the search.
    fn new(max: u16, shift: u32) -> Self {
        let mut first = vec![0.0];
        first.extend((1..=max).map(|level| threshold(level, max)));
        first.push(f32::INFINITY);
        let base = first[1].to_bits() >> shift;
        let last = 1f32.to_bits() >> shift;
        let mut start = Vec::with_capacity((last - base + 1) as usize);
        let mut level = 0;
        for bucket in base..=last {
            let smallest = f32::from_bits(bucket << shift);
            while first[level + 1] <= smallest {
                level += 1;
            }
            start.push(level as u16);
        }
        Self { first, start, shift }
    }

    /// The level of a linear value; values outside [0, 1] are clipped, a NaN is level 0.
    pub fn level(&self, x: f32) -> u16 {
        if x.is_nan() || x < self.first[1] {
            return 0;
        }
        let x = x.min(1.0);
        let bucket = (x.to_bits() >> self.shift) - (self.first[1].to_bits() >> self.shift);
        let mut level = self.start[bucket as usize];
        while x >= self.first[usize::from(level) + 1] {
            level += 1;
        }
        level
    }
}

/// The definition that the tables follow.
fn rounded(x: f32, max: u16) -> u16 {
    libm::floor(srgb_encode(f64::from(x)) * f64::from(max) + 0.5) as u16
}

/// The least f32 that is rounded to `level`: near the inverse function's value, then exactly.
fn threshold(level: u16, max: u16) -> f32 {
    let mut x = srgb_decode((f64::from(level) - 0.5) / f64::from(max)) as f32;
    while rounded(x, max) >= level {
        x = f32::from_bits(x.to_bits() - 1);
    }
    while rounded(x, max) < level {
        x = f32::from_bits(x.to_bits() + 1);
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each table against the function, at every threshold's neighbourhood and over a sweep of
    /// all magnitudes.
    #[test]
    fn equals_the_functions_exact_rounding() {
        for (quantiser, max) in [(&*SRGB_8, 255u16), (&*SRGB_16, 65_535)] {
            for level in 1..=max {
                let bits = quantiser.first[usize::from(level)].to_bits();
                for x in (bits - 2..=bits + 2).map(f32::from_bits).filter(|x| *x <= 1.0) {
                    assert_eq!(quantiser.level(x), rounded(x, max), "{x}");
                }
            }
            for bits in (0..=1f32.to_bits()).step_by(2503) {
                let x = f32::from_bits(bits);
                assert_eq!(quantiser.level(x), rounded(x, max), "{x}");
            }
        }
    }

    #[test]
    fn values_outside_0_to_1_are_clipped() {
        for quantiser in [&*SRGB_8, &*SRGB_16] {
            for x in [-1.0, -0.0, 0.0, f32::NAN, f32::NEG_INFINITY, f32::MIN_POSITIVE] {
                assert_eq!(quantiser.level(x), 0, "{x}");
            }
        }
        for x in [1.0, 1.5, f32::MAX, f32::INFINITY] {
            assert_eq!((SRGB_8.level(x), SRGB_16.level(x)), (255, 65_535), "{x}");
        }
    }

    /// Decoding a level and encoding it again gives the level: files read back are unchanged.
    #[test]
    fn levels_survive_a_round_trip() {
        for level in 0..=65_535u16 {
            let x = srgb_decode(f64::from(level) / 65_535.0) as f32;
            assert_eq!(SRGB_16.level(x), level);
        }
    }
}
