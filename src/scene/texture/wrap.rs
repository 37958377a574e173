//! What is seen beyond the edges of an image, and between which of its texels a coordinate lies.
//!
//! Four coordinates at a time, since a lookup asks for up to 16 points in two mip levels.

use serde::{Deserialize, Serialize};
use wide::{CmpEq, CmpGt, CmpLt, f32x4, i32x4};

/// What is seen beyond the edges of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// The nearest texel of the edge.
    Clamp,
    /// The image again, every other one mirrored.
    Mirror,
}

/// Between the middles of which texels of a row four coordinates lie.
pub(super) struct Between {
    pub(super) first: [i32; 4],
    pub(super) second: [i32; 4],
    /// How far from the middle of the first to that of the second, 0 to 1.
    pub(super) apart: [f32; 4],
}

impl Wrap {
    /// The two of `n` texels in a row between whose middles the coordinate `u` lies, and how far from the first; the row
    /// goes from 0 to 1. `n` is at most 2²³.
    pub fn two_texels(self, u: f32, n: u32) -> (usize, usize, f32) {
        let Between { first, second, apart } = self.between(self.inside(f32x4::splat(u)), n);
        (first[0] as usize, second[0] as usize, apart[0])
    }

    /// The coordinates from 0 to 1 where the image itself shows what is seen at `u`. What is no number counts as 0, and so
    /// does what is too large to have a fraction where the image repeats.
    #[inline(always)] // Up to 8 times in a lookup.
    pub(super) fn inside(self, u: f32x4) -> f32x4 {
        match self {
            Self::Repeat => repeat(u),
            // Of what is no number, processors make the one or the other.
            Self::Clamp => (u & u.cmp_eq(u)).fast_max(f32x4::ZERO).fast_min(f32x4::ONE),
            Self::Mirror => {
                let there_and_back = repeat(u * 0.5) * 2.0;
                there_and_back.fast_min(2.0 - there_and_back)
            }
        }
    }

    /// See [`two_texels`](Self::two_texels), of what [`inside`](Self::inside) gave.
    #[inline(always)] // Up to 16 times in a lookup.
    pub(super) fn between(self, inside: f32x4, n: u32) -> Between {
        let last = n as i32 - 1;
        // From half a texel before the first one's middle to half a texel behind the last one's.
        let place = inside * n as f32 + 0.5;
        let second = place.fast_trunc_int();
        let apart = place - second.round_float();
        let (before, behind) = if self == Self::Repeat { (last, 0) } else { (0, last) };
        let first = second.cmp_gt(i32x4::ZERO).blend(second - i32x4::ONE, i32x4::splat(before));
        let second = second.cmp_gt(i32x4::splat(last)).blend(i32x4::splat(behind), second);
        Between { first: first.to_array(), second: second.to_array(), apart: apart.to_array() }
    }
}

/// The fractions of coordinates; 0 beyond f32's whole numbers, and of what is not a number.
#[inline(always)] // Up to 8 times in a lookup.
fn repeat(x: f32x4) -> f32x4 {
    const WHOLE_FROM: f32 = 8_388_608.0;
    // Not `f32x4::floor`, which is four calls where the processor's instruction for it cannot be counted on.
    let whole = x.fast_trunc_int().round_float();
    let floor = whole - (f32x4::ONE & x.cmp_lt(whole));
    (x - floor) & x.abs().cmp_lt(f32x4::splat(WHOLE_FROM))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, one coordinate at a time.
    fn fraction(x: f64) -> f64 {
        if x.abs() < 8_388_608.0 { x - x.floor() } else { 0.0 }
    }

    #[test]
    fn all_lanes_say_what_the_definition_says() {
        let numbers = [
            0.0,
            -0.0,
            0.25,
            0.999_999_94,
            1.0,
            1.25,
            -0.25,
            -1.0,
            -1e-30,
            -7.75,
            12.5,
            1e6,
            -1e6,
            8_388_607.5,
            8_388_608.0,
            1e30,
            -1e30,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            f32::MIN_POSITIVE,
            0.5,
            2.5,
            -3.5,
        ];
        for four in numbers.windows(4) {
            let lanes: [f32; 4] = four.try_into().expect("four");
            for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
                let inside = wrap.inside(f32x4::from(lanes)).to_array();
                for (u, inside) in lanes.into_iter().zip(inside) {
                    let u = f64::from(u);
                    let wanted = match wrap {
                        Wrap::Repeat => fraction(u),
                        Wrap::Clamp if u.is_nan() => 0.0,
                        Wrap::Clamp => u.clamp(0.0, 1.0),
                        Wrap::Mirror => 1.0 - (2.0 * fraction(0.5 * u) - 1.0).abs(),
                    };
                    assert!((f64::from(inside) - wanted).abs() < 1e-6, "{wrap:?} {u} {inside}");
                }
                for n in [1_u32, 2, 3, 64, 1000, 65_536, 1 << 23] {
                    let between = wrap.between(f32x4::from(inside), n);
                    for (lane, place) in
                        inside.map(|inside| inside * n as f32 + 0.5).into_iter().enumerate()
                    {
                        let last = i64::from(n) - 1;
                        let second = place.floor() as i64;
                        let wrapped = |texel: i64| match wrap {
                            Wrap::Repeat => texel.rem_euclid(i64::from(n)),
                            Wrap::Clamp | Wrap::Mirror => texel.clamp(0, last),
                        };
                        let wanted = (wrapped(second - 1), wrapped(second), place - second as f32);
                        let (first, second) = (between.first[lane], between.second[lane]);
                        let found = (i64::from(first), i64::from(second), between.apart[lane]);
                        assert_eq!(found, wanted, "{wrap:?} {} of {n}", lanes[lane]);
                        let alone = wrap.two_texels(lanes[lane], n);
                        assert_eq!(alone, (first as usize, second as usize, found.2));
                    }
                }
            }
        }
    }
}
