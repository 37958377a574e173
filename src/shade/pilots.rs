//! Pilot rays to a light: where all of them find the same, no others are cast.
//!
//! Most points of a picture are lit fully or not at all by a light; only in a penumbra do more shadow rays make a
//! better estimate. So each point casts a few pilot rays first. If the pilots of its pixel and of the pixels up to two
//! away disagree (some reached the light, some did not), it is traced as if there were none. What is known from other
//! frames counts as pilots do.
//!
//! The choice depends on the block alone, so it is the same for any threads, ranks and crop. A shadow that no pilot
//! of these pixels meets is missed; `docs/accuracy.md` has a bound on that error.

use super::BLOCK;
use super::source::LightSource;

/// How far away pilots count, pixels, each way.
const REACH: u32 = 2;
/// A share of a light this small, from other frames, is rounding.
const ROUNDING: f32 = 1e-3;
/// The first column of a block.
const FIRST_COLUMN: u64 = 0x0101_0101_0101_0101;

const _: () = assert!(BLOCK * BLOCK == u64::BITS, "a bit for each pixel of a block");

/// Pixels of a block, a bit for each, row by row.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct PixelMask(u64);

impl PixelMask {
    /// Whether the pixel at `place` of the block is among them.
    pub fn has(self, place: usize) -> bool {
        self.0 >> place & 1 == 1
    }

    fn add(&mut self, place: usize, is_in: bool) {
        self.0 |= u64::from(is_in) << place;
    }

    /// These and the pixels next to them.
    fn grown(self) -> Self {
        let Self(own) = self;
        let last_column = FIRST_COLUMN << (BLOCK - 1);
        let row = own | (own << 1 & !FIRST_COLUMN) | (own >> 1 & !last_column);
        Self(row | row << BLOCK | row >> BLOCK)
    }
}

/// What the pilots of a block's pixels found of one light.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Findings {
    /// Pixels in which any reached the light.
    open: PixelMask,
    /// Pixels in which any did not.
    shut: PixelMask,
}

/// What pilots found of some lights, by their place among the frame's sources.
pub(super) type LightFindings = Vec<(u32, Findings)>;

impl Findings {
    /// Notes what the pilots of the pixel at `place` of the block found: whether any reached the light, and whether any did not.
    pub fn note(&mut self, place: usize, open: bool, shut: bool) {
        self.open.add(place, open);
        self.shut.add(place, shut);
    }

    /// Notes the ratio of a light that is known from other frames.
    pub fn note_ratio(&mut self, place: usize, ratio: f32) {
        self.note(place, ratio > ROUNDING, ratio < 1.0 - ROUNDING);
    }

    /// The pixels around which pilots disagree.
    pub fn disputed(&self) -> PixelMask {
        let near = |pixels: PixelMask| (0..REACH).fold(pixels, |pixels, _| pixels.grown());
        PixelMask(near(self.open).0 & near(self.shut).0)
    }
}

/// Samples of a light that every camera sample has as many of.
pub(super) struct Run {
    /// Number of the first sample of the first camera sample.
    first: u32,
    /// How many each camera sample has.
    pub count: u32,
}

impl Run {
    /// The samples that a light is traced with.
    pub fn whole(source: &LightSource) -> Self {
        Self { first: 0, count: source.samples }
    }

    /// The pilots, where not every point takes all samples; a pixel has at most `camera_samples`. They are no part of
    /// the estimate: had a point that goes on pilots among its samples, these would be those that disagree more often
    /// than not. Their numbers lie beyond those of traced samples and of check rays.
    pub fn pilots(source: &LightSource, camera_samples: u32) -> Option<Self> {
        let traced = camera_samples.wrapping_mul(source.samples.next_power_of_two());
        let first = traced.wrapping_mul(2);
        (source.pilots < source.samples).then_some(Self { first, count: source.pilots })
    }

    /// Number of the first sample of a camera sample. Those of a pixel follow one another, since such a run is spread
    /// over the light.
    pub fn first(&self, sample: u32) -> u32 {
        self.first.wrapping_add(sample.wrapping_mul(self.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_grow_by_one_each_way_and_not_across_the_block() {
        let of = |pixels: &[(usize, usize)]| {
            pixels.iter().fold(0u64, |all, (x, y)| all | 1 << (y * 8 + x))
        };
        let corner = PixelMask(of(&[(7, 0)])).grown();
        assert_eq!(corner, PixelMask(of(&[(6, 0), (7, 0), (6, 1), (7, 1)])));
        let edge = PixelMask(of(&[(0, 7)])).grown();
        assert_eq!(edge, PixelMask(of(&[(0, 7), (1, 7), (0, 6), (1, 6)])));
        assert_eq!(PixelMask(of(&[(3, 3)])).grown().0.count_ones(), 9);
    }

    #[test]
    fn pixels_are_disputed_where_pilots_nearby_disagree() {
        let mut found = Findings::default();
        (0..64).for_each(|place| found.note(place, true, false));
        assert_eq!(found.disputed(), PixelMask(0));
        found.note(0, true, true);
        assert_eq!(found.disputed().0.count_ones(), 9);
        assert!(found.disputed().has(18) && !found.disputed().has(3));
        let mut known = Findings::default();
        known.note_ratio(9, 1.0);
        known.note_ratio(10, 0.0);
        assert!(known.disputed().has(9));
        let mut partly = Findings::default();
        partly.note_ratio(9, 0.5);
        assert!(partly.disputed().has(9));
    }
}
