//! The audit: how far inferred pixels are from the truth, told by tracing a few of them.
//!
//! Some pixels are drawn ([`draw`]); whoever can trace traces each twice, independently, at the
//! same settings. With the shown value I, traces A and B and the display's curve left aside,
//! `(I - A)(I - B)` is an unbiased estimate of I's squared error, and `(A - B)²/2` of a trace's own.
//! Camera samples do not depend on the frame, so the error is that against the picture with
//! converged shadow samples. [`rmse`] makes figures with intervals of the sums.
//!
//! **Which pixels.** Nearly all of the error lies in penumbras, a few pixels of the picture. So a
//! pixel's chance to be drawn is a share of its own, equal for all, and a larger one in
//! proportion to its variance as its neighbours and itself foretell it
//! ([`PixelSource::risk`]); each drawn pixel counts by one over its chance. That the equal share is
//! there bounds what an error where nobody foretold it can do (a defensive mixture: Hesterberg,
//! 1995). Chances are summed pixel by pixel, and each unit of the sum draws one pixel at a random
//! place in it: so the draw is spread over the picture, and its size is known beforehand.

use crate::film::{PixelSource, Provenance};
use crate::math::Rgb;
use crate::measure::{Interval, drawn_sum_interval};
use crate::output::Display;
use crate::sampling::mix;
use crate::scene::Rect;
use crate::stats::{AuditSums, DrawnSum};
use rayon::prelude::*;

/// Share of the draw that all pixels have alike.
const EQUAL: f64 = 1.0 / 3.0;
/// A squared error that may have gone unseen in the pixels that were not drawn: one display step.
const UNSEEN: f64 = 1.0;
/// Display steps.
const STEPS: f64 = 255.0;

/// A frame's pixels as the audit sees them.
#[derive(Clone, Copy)]
pub struct Shown<'a> {
    /// Radiance, row by row.
    pub rgb: &'a [Rgb],
    /// Where each pixel's light comes from.
    pub sources: &'a [PixelSource],
    /// Columns.
    pub width: u32,
    /// The pixels that were rendered; `None` for all.
    pub crop: Option<Rect>,
    /// How radiance is shown.
    pub display: Display,
    /// Whether also pixels without any kept light may be off: where some lights are not kept.
    pub everywhere: bool,
}

/// A pixel that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Row by row.
    pub index: u32,
    /// One over the probability with which it was drawn; twice that where it was drawn twice.
    pub weight: f64,
}

/// What a draw depends on beside the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Lot {
    /// The job's seed.
    pub seed: u64,
    /// The frame.
    pub frame: u32,
    /// Which of the frame's draws.
    pub number: u32,
}

impl Shown<'_> {
    /// The pixels that were rendered, row by row: what lies beyond the crop is black and no picture.
    pub fn pixels(&self) -> impl Iterator<Item = u32> + Clone {
        let (crop, width) = (self.crop, self.width);
        let is_inside =
            move |x, y| crop.is_none_or(|c| (c.x0..c.x1).contains(&x) && (c.y0..c.y1).contains(&y));
        (0..self.rgb.len() as u32).filter(move |i| is_inside(i % width, i / width))
    }

    /// Whether the pixel may be off at all.
    fn is_lit(&self, i: usize) -> bool {
        self.everywhere || self.sources[i].provenance != Provenance::Background
    }

    /// Whether the pixel was inferred.
    pub fn is_inferred(&self, i: usize) -> bool {
        !matches!(self.sources[i].provenance, Provenance::Background | Provenance::Traced)
    }

    /// For each pixel its variance, foretold, in any unit; negative where it cannot be off.
    pub fn foretold(&self) -> Vec<f32> {
        let width = self.width as usize;
        let mut all = vec![0.0; self.rgb.len()];
        let start = || vec![0.0; width + 2];
        all.par_chunks_mut(width).enumerate().for_each_init(start, |near, (y, row)| {
            self.note_risks(y, &mut near[1..=width]);
            for (x, (out, near)) in row.iter_mut().zip(near.windows(3)).enumerate() {
                let i = y * width + x;
                let risk = near[0].max(near[1]).max(near[2]);
                *out = if self.is_lit(i) { self.variance(i, risk) } else { -1.0 };
            }
        });
        all
    }

    /// The greatest risk in row `y` and those beside it, column by column. With the columns beside it
    /// that is a pixel's own, since a penumbra's rim shows no doubt.
    fn note_risks(&self, y: usize, most: &mut [f32]) {
        most.fill(0.0);
        let width = self.width as usize;
        let rows = y.saturating_sub(1)..(y + 2).min(self.sources.len() / width);
        for row in rows {
            for (most, source) in most.iter_mut().zip(&self.sources[row * width..]) {
                *most = if source.risk.is_finite() { most.max(source.risk) } else { *most };
            }
        }
    }

    /// What radiance off by `risk` does to the shown value. A square root stands in for the
    /// transfer function, which would cost more than the draw.
    fn variance(&self, i: usize, risk: f32) -> f32 {
        if risk <= 0.0 {
            return 0.0;
        }
        let shown = |by: f32| self.display.tone(self.rgb[i] + Rgb::splat(by)).max_element().sqrt();
        let apart = shown(0.5 * risk) - shown(-0.5 * risk);
        apart * apart
    }
}

/// Draws about `count` of the pixels `among`, whose variance is `foretold` for the whole picture
/// (see [`Shown::foretold`]): a function of these and the lot alone.
pub fn draw(
    foretold: &[f32],
    among: impl Iterator<Item = u32> + Clone,
    count: f64,
    lot: Lot,
) -> Vec<Drawn> {
    let lit = || {
        let all = among.clone().map(|i| (i, f64::from(foretold[i as usize])));
        all.filter(|(_, variance)| *variance >= 0.0)
    };
    let (number, sum) = lit().fold((0.0, 0.0), |(n, sum), (_, v)| (n + 1.0, sum + v));
    let equal = if sum > 0.0 { EQUAL } else { 1.0 };
    let (each, by_variance) =
        (count * equal / number, count * (1.0 - equal) / f64::max(sum, 1e-300));
    let mut drawn: Vec<Drawn> = Vec::new();
    let (mut reached, mut next) = (0.0, place(lot, 0));
    let mut unit = 0;
    for (index, variance) in lit() {
        let chance = (each + by_variance * variance).min(1.0);
        reached += chance;
        while next < reached {
            match drawn.last_mut().filter(|last| last.index == index) {
                Some(last) => last.weight += 1.0 / chance,
                None => drawn.push(Drawn { index, weight: 1.0 / chance }),
            }
            unit += 1;
            next = f64::from(unit) + place(lot, unit);
        }
    }
    drawn
}

/// A place in [0, 1).
fn place(lot: Lot, unit: u32) -> f64 {
    let words = [lot.seed, u64::from(lot.frame) << 32 | u64::from(lot.number), u64::from(unit)];
    let v = words.into_iter().fold(0, |v, word| mix(v ^ word));
    (v >> 11) as f64 / (1u64 << 53) as f64
}

/// What two traces `a` and `b` tell about a pixel that is `shown`, squares of a display step, the
/// mean of the channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Squares {
    /// Squared error of what is shown; may be negative.
    pub error: f64,
    /// Squared error of a trace.
    pub trace: f64,
}

impl Squares {
    /// Compares radiances.
    ///
    /// Traces are right on average in radiance, not in display steps: the display's curve bends
    /// them. So the squared error is not `(I - A)(I - B)` itself but `2f(M) - (f(A) + f(B))/2` with
    /// the squared distance f to I, and M the traces' mean: the jackknife (Quenouille, 1956), which
    /// takes the bend's first order away, and the same as the product where there is no bend. To
    /// the trace's own error, whose bend is part of it, the bend's square is added, 4/3 of what the
    /// two show of it, as is right for normal noise.
    ///
    /// Higher orders stay: with noise of a third of the value, next to white, the error comes out
    /// too small by a tenth of a trace's squared error; with half that noise nothing is left to see.
    pub fn of(display: &Display, shown: Rgb, a: Rgb, b: Rgb) -> Self {
        let [i, m, a, b] = [shown, 0.5 * (a + b), a, b].map(|c| display.code(c));
        let (mut error, mut trace) = (0.0, 0.0);
        for k in 0..3 {
            let square = |x: f64| (i[k] - x) * (i[k] - x);
            error += 2.0 * square(m[k]) - 0.5 * (square(a[k]) + square(b[k]));
            let bend = m[k] - 0.5 * (a[k] + b[k]);
            trace += 0.5 * (a[k] - b[k]) * (a[k] - b[k]) + 4.0 / 3.0 * bend * bend;
        }
        let scale = STEPS * STEPS / 3.0;
        Self { error: error * scale, trace: trace * scale }
    }
}

/// How far a shown pixel is from the mean of its traces, display steps, the mean of the channels.
pub fn difference(display: &Display, shown: Rgb, a: Rgb, b: Rgb) -> f32 {
    let [i, m] = [shown, 0.5 * (a + b)].map(|c| display.code(c));
    ((0..3).map(|k| i[k] - m[k]).sum::<f64>() * STEPS / 3.0) as f32
}

/// The sums of a frame, `drawn` from it and traced twice each.
pub fn sums(shown: &Shown, drawn: &[Drawn], traces: [&[Rgb]; 2]) -> AuditSums {
    let [a, b] = traces;
    let mut sums = AuditSums {
        pixels: shown.pixels().count() as u64,
        inferred_pixels: (0..shown.rgb.len()).filter(|i| shown.is_inferred(*i)).count() as u64,
        drawn: drawn.len() as u64,
        ..AuditSums::default()
    };
    for (k, Drawn { index, weight }) in drawn.iter().enumerate() {
        let i = *index as usize;
        let squares = Squares::of(&shown.display, shown.rgb[i], a[k], b[k]);
        if shown.is_inferred(i) {
            sums.inferred.add(squares.error, *weight, UNSEEN);
        }
        sums.shown.add(squares.error, *weight, UNSEEN);
        sums.traced.add(squares.trace, *weight, UNSEEN);
    }
    sums
}

/// Root mean squares with their 95 % intervals, display steps of 255.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rmse {
    /// Of the inferred pixels.
    pub inferred: Interval,
    /// Of the audited frames, all their pixels.
    pub shown: Interval,
    /// Of the same frames, had they been traced.
    pub traced: Interval,
}

/// The figures that `sums` amount to; `None` where nothing was drawn.
pub fn rmse(sums: &AuditSums) -> Option<Rmse> {
    let over = |drawn: &DrawnSum, pixels: u64| {
        let total = drawn_sum_interval(drawn.sum, drawn.squares, drawn.largest);
        let root = |x: f64| (x / pixels.max(1) as f64).sqrt();
        Interval { estimate: root(total.estimate), low: root(total.low), high: root(total.high) }
    };
    (sums.drawn > 0).then(|| Rmse {
        inferred: over(&sums.inferred, sums.inferred_pixels),
        shown: over(&sums.shown, sums.pixels),
        traced: over(&sums.traced, sums.pixels),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ToneCurve;

    const SRGB: Display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
    const LINEAR: Display = Display { exposure: 1.0, tone: ToneCurve::Linear };
    const LOT: Lot = Lot { seed: 5, frame: 3, number: 0 };

    /// Noise of mean 0 and variance 1: the sum of twelve uniform numbers less 6.
    fn noise(k: u32) -> f32 {
        let lot = Lot { seed: 1, frame: k, number: 7 };
        ((0..12).map(|u| place(lot, u)).sum::<f64>() - 6.0) as f32
    }

    fn mean(n: u32, of: impl Fn(u32) -> f64) -> f64 {
        (0..n).map(of).sum::<f64>() / f64::from(n)
    }

    #[test]
    fn without_a_curve_the_error_is_the_product_of_differences() {
        let [i, a, b] = [0.5, 0.41, 0.63].map(Rgb::splat);
        let squares = Squares::of(&LINEAR, i, a, b);
        assert!((squares.error - 0.09 * -0.13 * 255.0 * 255.0).abs() < 1e-2, "{squares:?}");
        assert!((squares.trace - 0.5 * 0.22 * 0.22 * 255.0 * 255.0).abs() < 1e-2, "{squares:?}");
    }

    /// Of a light grey to a dark one, noisy by 15 %: the estimates' means are the truth.
    #[test]
    fn both_estimates_are_unbiased_through_the_curve() {
        for (truth, shown) in [(0.6f32, 0.66f32), (0.2, 0.21), (0.05, 0.04)] {
            let n = 40_000;
            let trace = |k: u32| Rgb::splat(truth * (1.0 + 0.15 * noise(k)).max(0.0));
            let both =
                |k: u32| Squares::of(&SRGB, Rgb::splat(shown), trace(2 * k), trace(2 * k + 1));
            let apart = |x: Rgb, y: Rgb| ((SRGB.code(x)[0] - SRGB.code(y)[0]) * 255.0).powi(2);
            let error = apart(Rgb::splat(shown), Rgb::splat(truth));
            let own = mean(2 * n, |k| apart(trace(k), Rgb::splat(truth)));
            let estimate = mean(n, |k| both(k).error);
            // Its own spread is about that of a trace's squared error.
            assert!((estimate - error).abs() < 0.03 * own, "{truth}: {estimate} of {error}, {own}");
            let estimate = mean(n, |k| both(k).trace);
            assert!((estimate / own - 1.0).abs() < 0.03, "{truth}: {estimate} of {own}");
        }
    }

    fn foretold() -> Vec<f32> {
        // A quarter of the pixels cannot be off, every tenth of the others is risky.
        let one = |i: u32| if i % 4 == 0 { -1.0 } else { f32::from(u8::from(i % 10 == 1)) };
        (0..4000).map(one).collect()
    }

    #[test]
    fn a_draw_has_its_size_favours_risk_and_hits_no_background() {
        let foretold = foretold();
        let drawn = draw(&foretold, 0..4000, 150.0, LOT);
        assert_eq!(drawn, draw(&foretold, 0..4000, 150.0, LOT));
        assert_ne!(drawn, draw(&foretold, 0..4000, 150.0, Lot { frame: 4, ..LOT }));
        assert_ne!(drawn, draw(&foretold, 0..4000, 150.0, Lot { number: 1, ..LOT }));
        assert!((140..=151).contains(&drawn.len()), "{}", drawn.len());
        assert!(drawn.iter().all(|d| foretold[d.index as usize] >= 0.0));
        let risky = drawn.iter().filter(|d| foretold[d.index as usize] > 0.0).count();
        assert!((85..=125).contains(&risky), "{risky} of {}", drawn.len());
        assert!(draw(&foretold, 0..0, 10.0, LOT).is_empty());
        assert!(draw(&foretold, 0..4000, 0.0, LOT).is_empty());
        let all = draw(&foretold, 0..4000, 1e9, LOT);
        assert_eq!(all.len(), 3000);
        assert!(all.iter().all(|d| d.weight == 1.0));
    }

    /// Weighted by one over their chance, the drawn pixels stand for all: any figure's total is
    /// right on average.
    #[test]
    fn totals_are_unbiased_over_draws() {
        let foretold = foretold();
        let figure = |i: u32| f64::from(i % 7) + if i % 10 == 1 { 30.0 } else { 0.0 };
        let total: f64 = (0..4000).filter(|i| i % 4 != 0).map(figure).sum();
        let estimate = mean(2000, |frame| {
            let drawn = draw(&foretold, 0..4000, 33.3, Lot { frame, ..LOT });
            drawn.iter().map(|d| d.weight * figure(d.index)).sum()
        });
        assert!((estimate / total - 1.0).abs() < 0.01, "{estimate} of {total}");
    }

    #[test]
    fn a_penumbras_rim_is_risky_too_and_darkness_hides() {
        let mut sources =
            vec![PixelSource { provenance: Provenance::Both, ..PixelSource::default() }; 25];
        sources[12].risk = 0.1;
        sources[24].provenance = Provenance::Background;
        let mut rgb = vec![Rgb::splat(0.5); 25];
        rgb[7] = Rgb::splat(5.0);
        let mut shown = Shown {
            rgb: &rgb,
            sources: &sources,
            width: 5,
            crop: None,
            display: SRGB,
            everywhere: false,
        };
        let foretold = shown.foretold();
        let risky: Vec<usize> = (0..25).filter(|i| foretold[*i] > 0.0).collect();
        assert_eq!(risky, [6, 8, 11, 12, 13, 16, 17, 18], "7 is white whatever its light");
        assert!(foretold[24] < 0.0);
        shown.everywhere = true;
        assert_eq!(shown.foretold()[24], 0.0);
    }
}
