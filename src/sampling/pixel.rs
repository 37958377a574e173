//! A pixel's random numbers.

use super::mix;
use super::sobol::{LANES, PairSeeds, block, single};

/// The random pairs of one pixel.
///
/// Numbers are a function of (seed, frame, x, y, sample, dimension) alone. For each dimension any
/// aligned block of 2^k samples, k up to 16, is a (0, k, 2)-net: it has one point in each of its 2^k
/// elementary intervals of every shape. Dimensions are padded: their pairs are independent
/// (Burley, "Practical Hash-based Owen Scrambling", 2020).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelSampler {
    key: u64,
}

impl PixelSampler {
    /// The sampler of pixel `(x, y)`. `frame` is 0 for camera samples, which do not depend on
    /// the frame, and the number (from 1) of the frame a shading sample is traced in otherwise.
    pub fn new(seed: u64, frame: u32, x: u32, y: u32) -> Self {
        let pixel = u64::from(x) | u64::from(y) << 32;
        Self { key: mix(mix(mix(seed) ^ pixel) ^ u64::from(frame)) }
    }

    /// The pair of `dimension` for `sample`, each coordinate in (0, 1), both ends excluded.
    pub fn get2(&self, sample: u32, dimension: u32) -> [f32; 2] {
        single(sample, self.seeds(dimension))
    }

    /// The pairs of `dimension` for samples `first_sample ..` (modulo 2^32), one per element of
    /// `out`: the same as [`get2`](Self::get2) for each, several times faster.
    ///
    /// Fastest where `first_sample` and the length are multiples of 8.
    pub fn fill2(&self, first_sample: u32, dimension: u32, out: &mut [[f32; 2]]) {
        let seeds = self.seeds(dimension);
        if out.len() <= 2 {
            // A block costs as much as two or three single points.
            for (i, pair) in out.iter_mut().enumerate() {
                *pair = single(first_sample.wrapping_add(i as u32), seeds);
            }
            return;
        }
        let skip = first_sample as usize % LANES;
        let mut base = first_sample - skip as u32;
        // An unaligned start: the first block's later lanes only.
        let (head, body) = out.split_at_mut(out.len().min((LANES - skip) % LANES));
        if !head.is_empty() {
            copy(head, &block(base, seeds), skip);
            base = base.wrapping_add(LANES as u32);
        }
        for chunk in body.chunks_mut(LANES) {
            copy(chunk, &block(base, seeds), 0);
            base = base.wrapping_add(LANES as u32);
        }
    }

    fn seeds(&self, dimension: u32) -> PairSeeds {
        let a = mix(self.key ^ (u64::from(dimension) << 1));
        let b = mix(a);
        PairSeeds { order: a as u32, axes: [b as u32, (b >> 32) as u32] }
    }
}

/// `out[i]` is lane `skip + i` of the block.
#[inline(always)]
fn copy(out: &mut [[f32; 2]], [xs, ys]: &[[f32; LANES]; 2], skip: usize) {
    for (pair, (x, y)) in out.iter_mut().zip(xs[skip..].iter().zip(&ys[skip..])) {
        *pair = [*x, *y];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pearson's statistic of `counts` against a uniform expectation.
    fn chi_square(counts: &[u32]) -> f64 {
        let mean = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
        counts.iter().map(|c| (f64::from(*c) - mean).powi(2) / mean).sum()
    }

    /// Whether every elementary interval of area 1/len holds exactly one point.
    fn is_net(points: &[[f32; 2]]) -> bool {
        let m = points.len().trailing_zeros();
        (0..=m).all(|a| {
            let (columns, rows) = (1u32 << a, 1u32 << (m - a));
            let mut seen = vec![false; points.len()];
            points.iter().all(|[x, y]| {
                let cell = (y * rows as f32) as u32 * columns + (x * columns as f32) as u32;
                !std::mem::replace(&mut seen[cell as usize], true)
            })
        })
    }

    #[test]
    fn every_aligned_block_is_a_net() {
        let mut points = [[0f32; 2]; 256];
        for seed in 0..200 {
            let sampler = PixelSampler::new(seed, (seed % 3) as u32, seed as u32 * 7, 11);
            for m in 0..=8 {
                let len = 1usize << m;
                for block in [0u32, 1, 2, 5, 1 << 12, (u32::MAX >> m) - 1, u32::MAX >> m] {
                    let first = block << m;
                    sampler.fill2(first, seed as u32 % 5, &mut points[..len]);
                    assert!(is_net(&points[..len]), "seed {seed}, m {m}, first {first}");
                }
            }
        }
    }

    #[test]
    fn the_net_test_can_fail() {
        let mut points = [[0f32; 2]; 64];
        PixelSampler::new(1, 1, 1, 1).fill2(1, 0, &mut points);
        assert!(!is_net(&points), "an unaligned run of 64 samples is no net");
    }

    #[test]
    fn filling_equals_getting() {
        let sampler = PixelSampler::new(u64::MAX, 9, 1919, 1079);
        for first in [0u32, 1, 7, 8, 13, 1000, u32::MAX - 5] {
            for len in [0usize, 1, 2, 3, 7, 8, 9, 16, 31, 100] {
                let mut out = vec![[0f32; 2]; len];
                sampler.fill2(first, 3, &mut out);
                for (i, pair) in out.iter().enumerate() {
                    assert_eq!(*pair, sampler.get2(first.wrapping_add(i as u32), 3));
                }
            }
        }
    }

    #[test]
    fn numbers_never_change() {
        // Pinned: renders of an older version must be repeatable.
        let bits = PixelSampler::new(7, 3, 12, 34).get2(5, 2).map(f32::to_bits);
        assert_eq!(bits, [1_046_670_012, 1_060_269_027]);
    }

    #[test]
    fn each_argument_matters() {
        let get = |seed, frame, x, y, s, d| PixelSampler::new(seed, frame, x, y).get2(s, d);
        let base = get(1, 1, 1, 1, 1, 1);
        for other in [
            get(2, 1, 1, 1, 1, 1),
            get(1, 2, 1, 1, 1, 1),
            get(1, 1, 2, 1, 1, 1),
            get(1, 1, 1, 2, 1, 1),
            get(1, 1, 1, 1, 2, 1),
            get(1, 1, 1, 1, 1, 2),
        ] {
            assert_ne!(base, other);
        }
    }

    /// Joint histograms of two coordinates that must be independent, 16 x 16 cells.
    fn joint(count: u32, pair: impl Fn(u32) -> [f32; 2]) -> f64 {
        let mut counts = vec![0u32; 256];
        for i in 0..count {
            let [a, b] = pair(i);
            counts[((a * 16.0) as u32 * 16 + (b * 16.0) as u32) as usize] += 1;
        }
        chi_square(&counts)
    }

    // With 255 degrees of freedom chi-square has mean 255 and standard deviation 22.6; the
    // bound lies 5 deviations out. A net in the sample index would give nearly 0.
    const BOUND: f64 = 255.0 + 5.0 * 22.6;

    #[test]
    fn pixels_frames_and_seeds_are_uncorrelated() {
        let n = 1 << 14;
        let get = |seed, frame, x| PixelSampler::new(seed, frame, x, 5).get2(0, 0);
        let tests = [
            joint(n, |i| get(0, 1, i)),
            joint(n, |i| [get(0, 1, i)[0], get(0, 1, i + 1)[0]]),
            joint(n, |i| [get(0, i, 4)[0], get(0, i + 1, 4)[0]]),
            joint(n, |i| [get(u64::from(i), 1, 4)[0], get(u64::from(i) + 1, 1, 4)[0]]),
            joint(n, |i| [get(0, 1, i)[0], get(0, 2, i)[0]]),
        ];
        for (i, chi) in tests.into_iter().enumerate() {
            assert!(chi < BOUND && chi > 120.0, "test {i}: {chi}");
        }
    }

    #[test]
    fn dimensions_are_uncorrelated_sample_by_sample() {
        // First 4 samples of each of many pixels: a shared order would line the pairs up.
        for (d, e) in [(0, 1), (0, 2), (1, 2), (7, 8), (0, 255)] {
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let chi = joint(1 << 14, |i| {
                    let s = PixelSampler::new(0, 1, i / 4, 0);
                    [s.get2(i % 4, d)[a], s.get2(i % 4, e)[b]]
                });
                assert!(chi < BOUND, "dimensions {d}.{a} and {e}.{b}: {chi}");
            }
        }
    }

    /// Mean error and variance of the estimate of ∫ f by `n` samples, over many pixels.
    fn errors(n: u32, exact: f64, f: impl Fn(&PixelSampler, u32) -> f64) -> (f64, f64) {
        let pixels = 4096;
        let (mut sum, mut squares) = (0.0, 0.0);
        for x in 0..pixels {
            let s = PixelSampler::new(3, 1, x, 8);
            let error = (0..n).map(|i| f(&s, i)).sum::<f64>() / f64::from(n) - exact;
            sum += error / f64::from(pixels);
            squares += error * error / f64::from(pixels);
        }
        (sum, squares)
    }

    #[test]
    fn estimates_are_unbiased_and_converge_as_owen_scrambling_does() {
        // Smooth in one pair (Owen, 1997: variance falls as n⁻³), and a product of two pairs,
        // which padding leaves at n⁻¹ or better.
        let smooth = |s: &PixelSampler, i| {
            let [x, y] = s.get2(i, 4).map(f64::from);
            x * x * (1.0 + y)
        };
        let padded = |s: &PixelSampler, i| f64::from(s.get2(i, 0)[0] * s.get2(i, 1)[0]);
        let mut last = f64::INFINITY;
        for n in [4, 16, 64] {
            let (bias, variance) = errors(n, 0.5, smooth);
            assert!(bias.abs() < 5.0 * (variance / 4096.0).sqrt(), "{bias:e} with {n}");
            assert!(variance < last / 40.0, "{variance:e} with {n} after {last:e}");
            last = variance;
            let (bias, variance) = errors(n, 0.25, padded);
            assert!(bias.abs() < 5.0 * (variance / 4096.0).sqrt(), "padded: {bias:e} with {n}");
            // Independent numbers leave 7/144 n⁻¹. Stratified ones leave the interaction's share
            // 1/144 n⁻¹, up to twice that as samples 2i and 2i + 1 are opposite in every pair.
            let share = variance * f64::from(n) * 144.0;
            assert!((1.0..2.2).contains(&share), "{share} with {n}");
        }
    }

    #[test]
    #[ignore = "measures time; run alone with --ignored --nocapture"]
    #[allow(clippy::print_stdout)]
    fn speed() {
        let mut out = [[0f32; 2]; 64];
        for len in [1usize, 4, 16, 64] {
            let rounds = 20_000_000 / (len + 8) as u32;
            let mut sum = 0f32;
            let start = std::time::Instant::now();
            for i in 0..rounds {
                PixelSampler::new(1, 1, i, 0).fill2(0, i & 7, &mut out[..len]);
                sum += std::hint::black_box(&out)[len - 1][0];
            }
            let ns = start.elapsed().as_secs_f64() * 1e9 / f64::from(rounds);
            println!("fill2 of {len}: {ns:.1} ns, {:.2} ns a sample ({sum})", ns / len as f64);
        }
    }
}
