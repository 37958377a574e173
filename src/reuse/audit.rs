//! The audit: an estimate of the error of inferred pixels, from traces of a few of them.
//!
//! Some pixels, the frame's probes, are traced twice, independently. With the shown value I and the
//! traces A and B, (I - A)(I - B) is on average the squared error of the shown value, and (A - B)²/2 that of
//! a trace, whatever the noise of A and B. The weight of a drawn pixel is one over its probability.

use crate::film::Provenance;
use crate::math::Rgb;
use crate::measure::{CONFIDENCE, Interval, drawn_sum_interval};
use crate::output::Display;
use crate::stats::{AuditSums, DrawnSum};
use std::collections::BTreeMap;

/// Largest squared error that the audit may have missed in a traced pixel, squared display steps. It raises only the
/// upper end of the interval, not the estimate. Noise is alike everywhere, so one step is enough.
const UNSEEN: f64 = 1.0;
/// The same of an inferred pixel: eight display steps, since errors of inferred pixels are rare and large.
const UNSEEN_INFERRED: f64 = 64.0;
/// Display steps from black to white.
const STEPS: f64 = 255.0;

/// A frame that is audited.
#[derive(Clone, Copy)]
pub struct AuditedFrame<'a> {
    /// Radiance, row by row.
    pub rgb: &'a [Rgb],
    /// Where each pixel's light comes from.
    pub provenance: &'a [Provenance],
    /// How radiance becomes display values.
    pub display: Display,
}

/// A pixel that was drawn at random for the audit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AuditedPixel {
    /// Index of the pixel, row by row.
    pub index: u32,
    /// One over the probability with which it was drawn.
    pub weight: f64,
    /// Pixels with one group number are neighbours that were drawn together; their errors are alike.
    pub group: u64,
    /// How many times as many camera samples as the traces the frame has of it, where it is traced: its squared error
    /// is smaller by that.
    pub refinement: f64,
}

impl AuditedFrame<'_> {
    /// Whether the pixel was inferred.
    fn is_inferred(&self, i: usize) -> bool {
        self.provenance[i].is_inferred()
    }
}

/// Squared errors of a shown pixel and of a trace, estimated from two independent traces: squares of a display
/// step, means over the channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SquaredErrors {
    /// Squared error of the shown value; may be negative.
    pub error: f64,
    /// Squared error of a trace.
    pub trace: f64,
    /// How much of `error` corrects for the display curve.
    pub correction: f64,
}

impl SquaredErrors {
    /// The squared errors of the radiance `shown`, from the traces `a` and `b`.
    ///
    /// Traces are unbiased in radiance, but not in display steps, since the display curve is not
    /// linear. So the squared error is not `(I - A)(I - B)` itself but `2f(M) - (f(A) + f(B))/2`, where f is
    /// the squared distance to I and M the mean of the traces. This jackknife (Quenouille, 1956)
    /// removes the bias to first order, and equals the product for a linear curve. The trace's own
    /// error includes its bias, so the square of the bias is added to it: 4/3 of the square that the
    /// two traces show, which is right for normal noise.
    ///
    /// Higher orders remain: with noise of a third of the value, next to white, the error is
    /// too small by a tenth of a trace's squared error; with half that noise the bias is negligible. Where few rays find
    /// any light, as in a room lit through small windows, most of the sum may be missing. It is then off by up to as much as
    /// the jackknife corrects.
    pub fn of(display: &Display, shown: Rgb, a: Rgb, b: Rgb) -> Self {
        let [i, m, a, b] = [shown, 0.5 * (a + b), a, b].map(|c| display.code(c));
        let (mut error, mut trace, mut correction) = (0.0, 0.0, 0.0);
        for k in 0..3 {
            let square = |x: f64| (i[k] - x) * (i[k] - x);
            let of_k = 2.0 * square(m[k]) - 0.5 * (square(a[k]) + square(b[k]));
            error += of_k;
            correction += of_k - (i[k] - a[k]) * (i[k] - b[k]);
            let bend = m[k] - 0.5 * (a[k] + b[k]);
            trace += 0.5 * (a[k] - b[k]) * (a[k] - b[k]) + 4.0 / 3.0 * bend * bend;
        }
        let scale = STEPS * STEPS / 3.0;
        let [error, trace, correction] = [error, trace, correction].map(|sum| sum * scale);
        Self { error, trace, correction }
    }
}

/// How far a shown pixel is from the mean of its traces, display steps, the mean of the channels.
pub fn difference(display: &Display, shown: Rgb, a: Rgb, b: Rgb) -> f32 {
    let [i, m] = [shown, 0.5 * (a + b)].map(|c| display.code(c));
    ((0..3).map(|k| i[k] - m[k]).sum::<f64>() * STEPS / 3.0) as f32
}

/// The audit's sums over the pixels `drawn` from a frame: `shown` has their inferred values, `traces` their two
/// traces. A drawn pixel represents as many pixels as its weight: itself, which shows its first trace, and others,
/// which show inferred values like its own. The count of the frame's pixels stays 0.
pub fn sums(shown: &AuditedFrame, drawn: &[AuditedPixel], traces: [&[Rgb]; 2]) -> AuditSums {
    let [a, b] = traces;
    let mut sums = AuditSums { drawn: drawn.len() as u64, ..AuditSums::default() };
    let mut groups: BTreeMap<u64, Group> = BTreeMap::new();
    for AuditedPixel { index, weight, group, refinement } in drawn {
        let group = groups.entry(*group).or_default();
        let i = *index as usize;
        let squares = SquaredErrors::of(&shown.display, shown.rgb[i], a[i], b[i]);
        let others = weight - 1.0;
        if shown.is_inferred(i) {
            sums.inferred_pixels += others as u64;
            let inferred = group.inferred.get_or_insert_default();
            inferred.add(squares.error, others, UNSEEN_INFERRED);
            inferred.correction += others * squares.correction;
        }
        let trace = squares.trace / refinement;
        let mean = (others * squares.error + trace) / weight;
        let unseen = if shown.is_inferred(i) { UNSEEN_INFERRED } else { UNSEEN };
        group.shown.add(mean, *weight, unseen);
        group.shown.correction += others * squares.correction;
        group.traced.add(trace, *weight, UNSEEN);
    }
    for Group { inferred, shown, traced } in groups.values() {
        inferred.iter().for_each(|part| part.add_to(&mut sums.inferred));
        shown.add_to(&mut sums.shown);
        traced.add_to(&mut sums.traced);
    }
    sums
}

/// The contribution of a group of pixels to the sums.
#[derive(Default)]
struct Group {
    /// `None` where none of them is inferred.
    inferred: Option<Part>,
    shown: Part,
    traced: Part,
}

#[derive(Default)]
struct Part {
    sum: f64,
    /// Squared error assumed for the pixels that were not drawn.
    unseen: f64,
    /// How much of the sum corrects for the display curve.
    correction: f64,
}

impl Part {
    fn add(&mut self, figure: f64, weight: f64, unseen: f64) {
        self.sum += figure * weight;
        self.unseen = self.unseen.max(unseen * weight);
    }

    fn add_to(&self, sum: &mut DrawnSum) {
        sum.add(self.sum, 1.0, self.unseen);
        sum.correction += self.correction;
    }
}

/// Root mean square errors with their 95 % intervals, display steps of 1/255.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rmse {
    /// RMSE of the inferred pixels.
    pub inferred: Interval,
    /// RMSE of the audited frames as they are shown, inferred and traced pixels together.
    pub shown: Interval,
    /// RMSE that the same frames would have if every pixel had been traced.
    pub traced: Interval,
}

/// The root mean square errors of `sums`, with intervals of 95 %; `None` where no pixel was drawn.
pub fn rmse(sums: &AuditSums) -> Option<Rmse> {
    rmse_within(sums, CONFIDENCE)
}

/// Whether `sums` show that inferred frames are less accurate than traced ones, by more than `tolerance` display steps: the
/// interval of their error lies above that of tracing. Of as many `audits` one finds this by chance in fewer than 5 %
/// (Bonferroni's correction).
pub fn is_worse_than_traced(sums: &AuditSums, tolerance: f32, audits: usize) -> bool {
    let confidence = 1.0 - (1.0 - CONFIDENCE) / audits.max(1) as f64;
    rmse_within(sums, confidence)
        .is_some_and(|rmse| rmse.shown.low > rmse.traced.high.max(tolerance.into()))
}

fn rmse_within(sums: &AuditSums, confidence: f64) -> Option<Rmse> {
    let over = |drawn: &DrawnSum, pixels: u64| {
        let total = drawn_sum_interval(drawn.sum, drawn.squares, drawn.largest, confidence);
        let root = |x: f64| (x.max(0.0) / pixels.max(1) as f64).sqrt();
        let doubt = drawn.correction.abs();
        let (low, high) = (root(total.low - doubt), root(total.high + doubt));
        Interval { estimate: root(total.estimate), low, high }
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
    use crate::film::ProvenanceKind;
    use crate::sampling::mix;
    use crate::scene::ToneCurve;

    const SRGB: Display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
    const LINEAR: Display = Display { exposure: 1.0, tone: ToneCurve::Linear };

    /// Noise of mean 0 and variance 1: the sum of twelve uniform numbers less 6.
    fn noise(k: u32) -> f32 {
        let uniform = |u: u32| (mix(u64::from(k) << 32 | u64::from(u)) >> 11) as f64;
        ((0..12).map(|u| uniform(u) / (1u64 << 53) as f64).sum::<f64>() - 6.0) as f32
    }

    fn mean(n: u32, of: impl Fn(u32) -> f64) -> f64 {
        (0..n).map(of).sum::<f64>() / f64::from(n)
    }

    /// Of 16 rays few find the light, as in a room that is lit through small windows.
    #[test]
    fn the_interval_contains_the_error_where_a_trace_finds_light_by_chance() {
        let uniform = |k: u32| (mix(u64::from(k) + 7) >> 11) as f64 / (1u64 << 53) as f64;
        for (truth, chance) in [(0.05f32, 0.1), (0.1, 0.1), (0.2, 0.2), (0.2, 0.3), (0.05, 0.05)] {
            let n = 4000;
            let trace = |k: u32| {
                let found = (0..16).filter(|ray| uniform(16 * k + ray) < chance).count();
                Rgb::splat(truth * found as f32 / (16.0 * chance as f32))
            };
            let shown = |k: u32| Rgb::splat(truth * (1.0 + 0.25 * noise(k)).max(0.0));
            let traces = |first: u32| (0..n).map(|k| trace(2 * k + first)).collect::<Vec<Rgb>>();
            let rgb: Vec<Rgb> = (0..n).map(shown).collect();
            let both = Provenance { kind: ProvenanceKind::Both, ..Provenance::default() };
            let inferred = vec![both; n as usize];
            let frame = AuditedFrame { rgb: &rgb, provenance: &inferred, display: SRGB };
            let drawn: Vec<AuditedPixel> = (0..n)
                .map(|index| AuditedPixel {
                    index,
                    weight: 2.0,
                    group: index.into(),
                    refinement: 1.0,
                })
                .collect();
            let sums = sums(&frame, &drawn, [&traces(0), &traces(1)]);
            let apart =
                |x: Rgb| ((SRGB.code(x)[0] - SRGB.code(Rgb::splat(truth))[0]) * 255.0).powi(2);
            let error = mean(n, |k| apart(shown(k))).sqrt();
            let found = rmse(&sums).expect("an audit").inferred;
            assert!(
                found.low <= error && error <= found.high,
                "{truth}, {chance}: {error}, {found:?}"
            );
        }
    }

    /// Four pixels that err alike tell as much as one.
    #[test]
    fn pixels_that_were_drawn_together_are_one_figure() {
        let rgb = vec![Rgb::splat(0.5); 4];
        let provenance = vec![Provenance::default(); 4];
        let shown = AuditedFrame { rgb: &rgb, provenance: &provenance, display: LINEAR };
        let (a, b) = (vec![Rgb::splat(0.4); 4], vec![Rgb::splat(0.6); 4]);
        let of = |group: fn(u32) -> u64| {
            let drawn: Vec<AuditedPixel> = (0..4)
                .map(|k| AuditedPixel { index: k, weight: 8.0, group: group(k), refinement: 1.0 })
                .collect();
            sums(&shown, &drawn, [&a, &b]).traced
        };
        let (apart, together) = (of(u64::from), of(|_| 0));
        assert!((apart.sum - together.sum).abs() < 1e-9 * apart.sum);
        assert!((4.0 * apart.squares - together.squares).abs() < 1e-9 * together.squares);
    }

    #[test]
    fn without_a_curve_the_error_is_the_product_of_differences() {
        let [i, a, b] = [0.5, 0.41, 0.63].map(Rgb::splat);
        let squares = SquaredErrors::of(&LINEAR, i, a, b);
        assert!((squares.error - 0.09 * -0.13 * 255.0 * 255.0).abs() < 1e-2, "{squares:?}");
        assert!((squares.trace - 0.5 * 0.22 * 0.22 * 255.0 * 255.0).abs() < 1e-2, "{squares:?}");
    }

    /// From a light grey to a dark one, with 15 % noise, the estimates' means are the true errors.
    #[test]
    fn both_estimates_are_unbiased_through_the_curve() {
        for (truth, shown) in [(0.6f32, 0.66f32), (0.2, 0.21), (0.05, 0.04)] {
            let n = 40_000;
            let trace = |k: u32| Rgb::splat(truth * (1.0 + 0.15 * noise(k)).max(0.0));
            let both = |k: u32| {
                SquaredErrors::of(&SRGB, Rgb::splat(shown), trace(2 * k), trace(2 * k + 1))
            };
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
}
