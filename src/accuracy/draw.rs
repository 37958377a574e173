//! Draws pixels with known probabilities, larger where a larger variance is expected.

use crate::sampling::mix;

/// Share of the draw that is spread evenly over all pixels.
const EQUAL: f64 = 1.0 / 3.0;
/// A pixel that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnPixel {
    /// Index of the pixel, row by row.
    pub index: u32,
    /// One over the pixel's probability; twice that where it was drawn twice.
    pub weight: f64,
}

/// The numbers that a draw depends on beside the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawSeed {
    /// The job's seed.
    pub seed: u64,
    /// The frame.
    pub frame: u32,
    /// Number of the draw within the frame.
    pub number: u32,
}

/// Draws about `count` of the pixels `among`, by the `variance` expected of each pixel of the picture; a
/// pixel of negative variance is never drawn. The same arguments give the same pixels.
pub fn draw(
    variance: &[f32],
    among: impl Iterator<Item = u32> + Clone,
    count: f64,
    seed: DrawSeed,
) -> Vec<DrawnPixel> {
    let lit = || {
        let all = among.clone().map(|i| (i, f64::from(variance[i as usize])));
        all.filter(|(_, variance)| *variance >= 0.0)
    };
    let (number, sum) = lit().fold((0.0, 0.0), |(n, sum), (_, v)| (n + 1.0, sum + v));
    let equal = if sum > 0.0 { EQUAL } else { 1.0 };
    let (each, by_variance) =
        (count * equal / number, count * (1.0 - equal) / f64::max(sum, 1e-300));
    let mut drawn: Vec<DrawnPixel> = Vec::new();
    let (mut reached, mut next) = (0.0, place(seed, 0));
    let mut unit = 0;
    for (index, variance) in lit() {
        let chance = (each + by_variance * variance).min(1.0);
        reached += chance;
        while next < reached {
            match drawn.last_mut().filter(|last| last.index == index) {
                Some(last) => last.weight += 1.0 / chance,
                None => drawn.push(DrawnPixel { index, weight: 1.0 / chance }),
            }
            unit += 1;
            next = f64::from(unit) + place(seed, unit);
        }
    }
    drawn
}

/// A random number in [0, 1) for the unit number `unit`.
fn place(seed: DrawSeed, unit: u32) -> f64 {
    let words = [seed.seed, u64::from(seed.frame) << 32 | u64::from(seed.number), u64::from(unit)];
    let v = words.into_iter().fold(0, |v, word| mix(v ^ word));
    (v >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEED: DrawSeed = DrawSeed { seed: 5, frame: 3, number: 0 };

    fn mean(n: u32, of: impl Fn(u32) -> f64) -> f64 {
        (0..n).map(of).sum::<f64>() / f64::from(n)
    }

    fn variance() -> Vec<f32> {
        // A quarter of the pixels cannot be off, every tenth of the others is risky.
        let one = |i: u32| if i % 4 == 0 { -1.0 } else { f32::from(u8::from(i % 10 == 1)) };
        (0..4000).map(one).collect()
    }

    #[test]
    fn a_draw_has_its_size_favours_risk_and_hits_no_background() {
        let variance = variance();
        let drawn = draw(&variance, 0..4000, 150.0, SEED);
        assert_eq!(drawn, draw(&variance, 0..4000, 150.0, SEED));
        assert_ne!(drawn, draw(&variance, 0..4000, 150.0, DrawSeed { frame: 4, ..SEED }));
        assert_ne!(drawn, draw(&variance, 0..4000, 150.0, DrawSeed { number: 1, ..SEED }));
        assert!((140..=151).contains(&drawn.len()), "{}", drawn.len());
        assert!(drawn.iter().all(|d| variance[d.index as usize] >= 0.0));
        let risky = drawn.iter().filter(|d| variance[d.index as usize] > 0.0).count();
        assert!((85..=125).contains(&risky), "{risky} of {}", drawn.len());
        assert!(draw(&variance, 0..0, 10.0, SEED).is_empty());
        assert!(draw(&variance, 0..4000, 0.0, SEED).is_empty());
        let all = draw(&variance, 0..4000, 1e9, SEED);
        assert_eq!(all.len(), 3000);
        assert!(all.iter().all(|d| d.weight == 1.0));
    }

    /// Weighted by one over their chance, the drawn pixels stand for all: any figure's total is
    /// right on average.
    #[test]
    fn totals_are_unbiased_over_draws() {
        let variance = variance();
        let figure = |i: u32| f64::from(i % 7) + if i % 10 == 1 { 30.0 } else { 0.0 };
        let total: f64 = (0..4000).filter(|i| i % 4 != 0).map(figure).sum();
        let estimate = mean(2000, |frame| {
            let drawn = draw(&variance, 0..4000, 33.3, DrawSeed { frame, ..SEED });
            drawn.iter().map(|d| d.weight * figure(d.index)).sum()
        });
        assert!((estimate / total - 1.0).abs() < 0.01, "{estimate} of {total}");
    }
}
