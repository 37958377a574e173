//! The first two Sobol dimensions, their scrambling and their shuffling, on 32-bit integers.
//!
//! "rev" in a name means that the number's bits are reversed: bit 0 is worth 1/2.

/// Samples that are computed together.
pub const LANES: usize = 8;

/// Seeds of one dimension pair: one for the order of the samples and one for each coordinate.
#[derive(Debug, Clone, Copy)]
pub struct PairSeeds {
    /// Seed of the shuffled order.
    pub order: u32,
    /// Seeds of the two coordinates.
    pub axes: [u32; 2],
}

/// The second Sobol coordinate of sample `index`, rev; the first one's rev is `index` itself.
///
/// Its generator matrix is Pascal's triangle modulo 2 (Sobol, 1967), a tensor power of a 2x2
/// matrix, so five butterfly steps replace the 32 direction numbers (Ahmed, 2024).
#[inline(always)]
pub fn second_axis_rev(index: u32) -> u32 {
    let mut v = index;
    v ^= v >> 16;
    v ^= (v & 0xff00_ff00) >> 8;
    v ^= (v & 0xf0f0_f0f0) >> 4;
    v ^= (v & 0xcccc_cccc) >> 2;
    v ^= (v & 0xaaaa_aaaa) >> 1;
    v
}

/// Nested uniform scrambling (Owen, 1995) of a reversed number by a hash in which a bit depends
/// on lower bits only (Laine and Karras, 2011; Burley, 2020; constants by Vegdahl, 2021).
///
/// `seed` must be well mixed.
#[inline(always)]
pub fn scramble_rev(rev: u32, seed: u32) -> u32 {
    let mut v = rev;
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^= v.wrapping_mul(0x53a2_2864);
    v
}

/// The order in which a block of 8 is visited: one byte a lane, for each of the 2^7 nested
/// scrambles of three bits.
static ORDERS: [[u8; LANES]; 128] = orders();

const fn orders() -> [[u8; LANES]; 128] {
    let mut table = [[0; LANES]; 128];
    let mut flips = 0;
    while flips < table.len() {
        let mut lane = 0;
        while lane < LANES {
            // One flip for the highest bit, one for each value above the middle bit (2) and
            // above the lowest (4).
            let high = flips & 1;
            let middle = (flips >> (1 + (lane >> 2))) & 1;
            let low = (flips >> (3 + (lane >> 1))) & 1;
            table[flips][lane] = (lane ^ (high << 2 | middle << 1 | low)) as u8;
            lane += 1;
        }
        flips += 1;
    }
    table
}

/// Shuffles the order of samples: the first index of the block of 8 that stands in the place of
/// samples `base ..`, and how its samples are ordered. `base` is a multiple of 8.
///
/// Blocks move by a nested scramble of their number, so that an aligned block of 2^k samples
/// remains one, hence a (0, k, 2)-net of its own.
#[inline(always)]
fn shuffle(base: u32, seed: u32) -> (u32, &'static [u8; LANES]) {
    let index = scramble_rev(base.reverse_bits(), seed).reverse_bits() & !(LANES as u32 - 1);
    // Hash: "lowbias32" (Wellons, 2018).
    let mut h = index ^ seed;
    h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d);
    h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
    (index, &ORDERS[(h >> 25) as usize])
}

/// The scrambled point of Sobol index `index`, whose second coordinate is `second_rev`.
///
/// Bits 1 to 16 of a coordinate are the scrambled Sobol number. The scrambled bits below are
/// random whatever their order, so bits 17 to 23 come from the other end of the hash and only 16
/// bits need to be reversed, those of both coordinates together.
#[inline(always)]
fn point(index: u32, second_rev: u32, axes: [u32; 2]) -> [f32; 2] {
    let x = scramble_rev(index, axes[0]);
    let y = scramble_rev(second_rev, axes[1]);
    let both = reverse_halves((x & 0xffff) | (y << 16));
    [to_unit((both & 0xffff) << 7 | x >> 25), to_unit((both >> 16) << 7 | y >> 25)]
}

/// Reverses the bits of the lower and of the upper 16 bits.
#[inline(always)]
fn reverse_halves(v: u32) -> u32 {
    let v = (v & 0x00ff_00ff) << 8 | (v >> 8) & 0x00ff_00ff;
    let v = (v & 0x0f0f_0f0f) << 4 | (v >> 4) & 0x0f0f_0f0f;
    let v = (v & 0x3333_3333) << 2 | (v >> 2) & 0x3333_3333;
    (v & 0x5555_5555) << 1 | (v >> 1) & 0x5555_5555
}

/// The point of one sample.
pub fn single(sample: u32, seeds: PairSeeds) -> [f32; 2] {
    let lane = sample as usize % LANES;
    let (first, order) = shuffle(sample - lane as u32, seeds.order);
    let index = first | u32::from(order[lane]);
    point(index, second_axis_rev(index), seeds.axes)
}

/// The points of samples `base .. base + 8`, x and y apart; `base` is a multiple of 8.
#[inline(always)]
pub fn block(base: u32, seeds: PairSeeds) -> [[f32; LANES]; 2] {
    let (first, order) = shuffle(base, seeds.order);
    let first_second = second_axis_rev(first);
    let mut out = [[0f32; LANES]; 2];
    for lane in 0..LANES {
        let low = u32::from(order[lane]);
        // The butterfly is linear over bits, and three of its steps leave bits 0 to 2 alone.
        let low_second = low ^ (low & 4) >> 2;
        let low_second = low_second ^ (low_second & 2) >> 1;
        let [x, y] = point(first | low, first_second ^ low_second, seeds.axes);
        out[0][lane] = x;
        out[1][lane] = y;
    }
    out
}

/// A fraction of 23 bits as the middle of its cell of width 2^-23: strictly between 0 and 1,
/// exact, and symmetrical about 1/2.
#[inline(always)]
fn to_unit(fraction: u32) -> f32 {
    const HALF_CELL: f32 = 1.0 / 16_777_216.0;
    // 1.m minus (1 - 2^-24): the difference is exact.
    f32::from_bits(fraction | 0x3f80_0000) - (1.0 - HALF_CELL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unscrambled_points_are_sobols() {
        // The published crate holds the direction numbers of Joe and Kuo.
        for i in 0..1u32 << 16 {
            let rev = i.reverse_bits();
            assert_eq!(i, sobol_burley::parts::sobol_rev(rev, 0));
            assert_eq!(second_axis_rev(i), sobol_burley::parts::sobol_rev(rev, 1));
        }
        let known = [(0, 0), (2, 2), (1, 3), (3, 1)];
        for (i, (x, y)) in known.into_iter().enumerate() {
            assert_eq!((i as u32).reverse_bits() >> 30, x);
            assert_eq!(second_axis_rev(i as u32).reverse_bits() >> 30, y);
        }
    }

    #[test]
    fn a_scrambled_bit_depends_on_lower_bits_only_and_nothing_is_lost() {
        for seed in [0u32, 0x9e37_79b9, 0xdead_beef, u32::MAX] {
            for bit in 1..32 {
                let mask = (1u32 << bit) - 1;
                let a = scramble_rev(0x5bd1_e995, seed);
                let b = scramble_rev(0x5bd1_e995 ^ (1 << bit), seed);
                assert_eq!(a & mask, b & mask);
                assert_ne!((a ^ b) & (1 << bit), 0, "a bit must map one to one");
            }
        }
    }

    #[test]
    fn a_point_is_its_sobol_point_under_nested_scrambles() {
        let axes = [0x1234_5677, 0xfedc_ba98];
        for index in (0..1u32 << 20).step_by(77) {
            let second = second_axis_rev(index);
            let slow = [scramble_rev(index, axes[0]), scramble_rev(second, axes[1])];
            let fast = point(index, second, axes);
            for (slow, fast) in slow.into_iter().zip(fast) {
                assert_eq!(slow.reverse_bits() >> 16, (fast * 65536.0) as u32);
            }
        }
    }

    #[test]
    fn shuffled_blocks_are_aligned_blocks() {
        for seed in [1u32, 77, 0x8000_0000] {
            for size in [2u32, 4, 8, 64] {
                for first in [0, size, 5 * size, 1 << 20] {
                    let index = |i: u32| {
                        let (block, order) = shuffle(i & !7, seed);
                        block | u32::from(order[i as usize % LANES])
                    };
                    let mut seen: Vec<u32> = (first..first + size).map(index).collect();
                    seen.sort_unstable();
                    assert_eq!(seen[0] % size, 0);
                    assert!(seen.windows(2).all(|w| w[1] == w[0] + 1));
                }
            }
        }
    }

    #[test]
    fn units_lie_strictly_inside() {
        let last = (1 << 23) - 1;
        assert!(to_unit(0) > 0.0 && to_unit(last) < 1.0);
        assert_eq!(to_unit(0) + to_unit(last), 1.0);
        assert_eq!(to_unit(1 << 22), 0.5 + 1.0 / 16_777_216.0);
    }
}
