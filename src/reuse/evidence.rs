//! Evidence: the findings of probes, and which estimates may be used because of them.
//!
//! A probe is a pixel that is estimated from other frames *and* traced twice, independently. With the
//! estimate S and the traces A and B, (S - A)(S - B) is on average the squared error of the estimate, and
//! (A - B)²/2 that of a trace. Estimates are sorted by their risk (`risk.rs`). Estimates of a level may be used
//! if probes of that risk, in the frame itself and in the frames that it is inferred from, found them more
//! accurate than a trace, or off by less than can be seen.
//!
//! Every figure is a sum over findings in a fixed order.

use super::risk::{LEVELS, STEPS, of_lights, risk_of, shown};
use crate::inference::Estimate;
use std::ops::Add;

/// Number of adjacent levels, on each side, whose findings count too when a level is judged. Their errors are scaled
/// by the ratio of the risks.
const BESIDE: usize = 1;
/// This share of the squared risk is added once to the errors that a level's probes found: a few probes
/// without an error say little where errors could be large.
const HIDDEN: f64 = 0.25;
/// The error of estimates, times this factor, must be at most the error of tracing: estimates that are accurate
/// enough on average over a frame are worse in some of its tiles.
const GUARD: f64 = 1.25;
/// The mean squared error of a level may reach this share of the largest squared error that is invisible in a
/// tile: errors are rare and large, so some tiles are above the mean.
const UNSEEN_SHARE: f64 = 0.5;

/// Some of a point's lights have a finding of their own if their risk is so many levels below that of more lights.
const CALMER: usize = 2;

/// The errors of the estimate and of a trace at a surface point of a probe, summed over some or all of the lights that
/// other frames know.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// Level of the estimate's risk: an index into the levels of eight scales, one scale after another (detail and all
    /// else, for points seen directly and for points seen in mirrors or through glass; then the same again for some of a
    /// point's lights).
    pub level: u8,
    /// Whether check rays agreed with the estimates.
    pub agreed: bool,
    /// Squared error of the estimate, squares of a display step of the pixel; may be negative.
    pub error: f32,
    /// Squared error of a trace, in the same unit.
    pub noise: f32,
}

/// What the probes of a frame found.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ProbeFindings {
    /// The findings at the points that other frames know.
    pub list: Vec<Finding>,
    /// The points of the probes' camera samples that a light may reach whose ratios are kept.
    pub lit: LitCounts,
}

/// Numbers of surface points that a light may reach.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LitCounts {
    /// All of them.
    pub all: u64,
    /// Those that have an estimate of a light.
    pub known: u64,
}

impl LitCounts {
    /// The share that has an estimate, 0 to 1.
    pub fn known_share(self) -> f64 {
        self.known as f64 / self.all.max(1) as f64
    }

    /// How many have none for each that has one.
    pub fn unknown_per_known(self) -> f64 {
        (self.all - self.known) as f64 / self.known.max(1) as f64
    }
}

impl Add for LitCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { all: self.all + other.all, known: self.known + other.known }
    }
}

/// Estimate and both traces of one light at a point.
#[derive(Debug, Clone, Copy)]
pub struct LightComparison {
    /// The light's contribution to the pixel without shadows: luminance, exposure applied.
    pub unshadowed: f32,
    /// The estimate from other frames.
    pub estimate: Estimate,
    /// Traced ratios.
    pub traced: [f32; 2],
    /// Whether check rays agreed with the estimates of this light and of those that send less.
    pub agreed: bool,
}

impl LightComparison {
    /// Averages with the comparison of further camera samples, whose share of all samples is `share`. The
    /// higher risk is kept.
    pub fn join(&mut self, other: &Self, share: f32) {
        let (own_light, light) = (self.unshadowed * (1.0 - share), other.unshadowed * share);
        self.unshadowed = own_light + light;
        if light == 0.0 {
            return;
        }
        self.agreed &= other.agreed;
        let by = light / self.unshadowed;
        let mean =
            |own: f32, other: f32| if own_light == 0.0 { other } else { own + (other - own) * by };
        self.estimate.ratio = mean(self.estimate.ratio, other.estimate.ratio);
        let risk = |level: u8| (usize::from(level) % STEPS, of_lights(level, false));
        if risk(other.estimate.level) > risk(self.estimate.level) {
            self.estimate.level = other.estimate.level;
        }
        for (own, other) in self.traced.iter_mut().zip(other.traced) {
            *own = mean(*own, other);
        }
    }
}

/// The findings at a point that makes up `share` of its pixel, from the comparisons of its `lights`: of all that other
/// frames know, and of fewer, weaker lights; none where other frames know no light.
pub fn findings_of(share: f32, lights: &[LightComparison]) -> Vec<Finding> {
    let is_known = |l: &&LightComparison| {
        l.unshadowed != 0.0 && !l.estimate.ratio.is_nan() && !l.traced.iter().any(|r| r.is_nan())
    };
    let mut known: Vec<&LightComparison> = lights.iter().filter(is_known).collect();
    known.sort_by_key(|light| light.estimate.order);
    let mut findings = Vec::new();
    let mut last = usize::MAX;
    for count in (1..=known.len()).rev() {
        let (own, others) = known.split_at(count);
        // The ratios of one light are used together.
        let order = |light: &LightComparison| light.estimate.order;
        let (Some(brightest), next) = (own.last(), others.first()) else { continue };
        if next.is_some_and(|next| order(next) == order(brightest)) {
            continue;
        }
        let risk =
            |light: &LightComparison| (usize::from(light.estimate.level) % STEPS, order(light));
        let Some(riskiest) = own.iter().max_by_key(|light| risk(light)) else { continue };
        let (step, _) = risk(riskiest);
        if others.is_empty() || step + CALMER <= last {
            last = step;
            let level = of_lights(riskiest.estimate.level, !others.is_empty());
            findings.extend(finding_of(share, (own, others), level, brightest.agreed));
        }
    }
    findings
}

/// The finding of the lights `own` of a point, beside which the `others` are as they are; `None` where light is beyond what
/// f32 holds.
fn finding_of(
    share: f32,
    (own, others): (&[&LightComparison], &[&LightComparison]),
    level: u8,
    agreed: bool,
) -> Option<Finding> {
    let sum = |lights: &[&LightComparison], ratio: &dyn Fn(&LightComparison) -> f32| -> f32 {
        lights.iter().map(|l| l.unshadowed * ratio(l)).sum()
    };
    let rest = sum(others, &|l| 0.5 * (l.traced[0] + l.traced[1]));
    let shown = |radiance: f32| f64::from(shown(rest + radiance));
    let estimated = shown(sum(own, &|l| l.estimate.ratio));
    let [a, b] = [0, 1].map(|k| shown(sum(own, &|l| l.traced[k])));
    let square = f64::from(share) * f64::from(share);
    let error = (square * (estimated - a) * (estimated - b)) as f32;
    let noise = (square * 0.5 * (a - b) * (a - b)) as f32;
    (error.is_finite() && noise.is_finite()).then_some(Finding { level, agreed, error, noise })
}

/// The levels of risk whose estimates may be used.
///
/// For each level the largest number of camera samples of a pixel for which they may, as a multiple of the least
/// number; less than 1 where they may for none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence([f64; LEVELS]);

/// Sums over findings.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    /// Sum of the errors, each divided by the risk of its level.
    error: f64,
    noise: f64,
}

/// The sum of all `sums`.
fn total(sums: &[Sums]) -> Sums {
    sums.iter().fold(Sums::default(), |all, own| Sums {
        count: all.count + own.count,
        error: all.error + own.error,
        noise: all.noise + own.noise,
    })
}

/// Raises `limits`, the multiples of the steps of a scale of risk, as far as the `sums` of their findings allow. A
/// mean squared error of up to `unseen` is allowed whatever tracing's error is.
fn raise(sums: &[Sums], unseen: f64, limits: &mut [f64]) {
    // What holds of a higher risk holds of a lower one.
    let mut most = f64::INFINITY;
    for step in (0..STEPS).rev() {
        let first = step.saturating_sub(BESIDE);
        let near = total(&sums[first..(step + BESIDE + 1).min(STEPS)]);
        if near.count > 0.0 {
            let risk = risk_of(step);
            // By chance it may be negative, and would speak for all lower levels.
            let found = near.error.max(0.0) * risk + HIDDEN * risk * risk;
            most = most.min(found / near.count);
        }
        // Noise rises with the risk: never that of a higher one.
        let below = total(&sums[first..=step]);
        let noise = if below.count > 0.0 { below.noise / below.count } else { 0.0 };
        // The noise of a trace falls with the number of samples, the error of an estimate does not.
        let limit = if most <= unseen { f64::INFINITY } else { noise / GUARD / most };
        limits[step] = limits[step].max(limit);
    }
}

impl Evidence {
    /// The evidence of `findings`. An error of up to `tolerance` display steps (root mean square over a tile) is
    /// allowed whatever tracing's error is.
    pub fn of<'f>(findings: impl Iterator<Item = &'f Finding>, tolerance: f32) -> Self {
        Self::counted(findings, 1.0, tolerance)
    }

    /// The evidence if each of `findings` had been made so many `times`.
    pub fn counted<'f>(
        findings: impl Iterator<Item = &'f Finding>,
        times: f64,
        tolerance: f32,
    ) -> Self {
        let unseen = UNSEEN_SHARE * f64::from(tolerance) * f64::from(tolerance);
        let mut sums = [Sums::default(); LEVELS];
        // Where check rays do not agree, the point is traced whatever its level.
        for finding in findings.filter(|finding| finding.agreed) {
            let level = usize::from(finding.level);
            sums[level].count += times;
            sums[level].error += times * f64::from(finding.error) / risk_of(level);
            sums[level].noise += times * f64::from(finding.noise);
        }
        let mut limits = [0.0; LEVELS];
        for (sums, limits) in sums.chunks_exact(2 * STEPS).zip(limits.chunks_exact_mut(2 * STEPS)) {
            let (noisy, detailed) = sums.split_at(STEPS);
            let (noise, detail) = limits.split_at_mut(STEPS);
            raise(detailed, unseen, detail);
            raise(noisy, unseen, noise);
            // Detail is no less wrong than noise of the same risk: what both show holds of noise.
            let both: Vec<Sums> =
                noisy.iter().zip(detailed).map(|(a, b)| total(&[*a, *b])).collect();
            raise(&both, unseen, noise);
        }
        Self(limits)
    }

    /// Whether estimates of `level` may be used where check rays agree, in a pixel that has `refinement` times the
    /// least number of camera samples.
    pub fn may_use(&self, level: u8, refinement: f32) -> bool {
        self.0.get(usize::from(level)).is_some_and(|limit| *limit >= f64::from(refinement))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Level of calm estimates; the next one is of estimates beside a shadow's edge.
    const CALM: u8 = 0;
    const EDGE: u8 = 12;

    fn found(level: u8, error: f32, noise: f32) -> Finding {
        Finding { level, agreed: true, error, noise }
    }

    fn may_use(findings: &[Finding], level: u8) -> bool {
        Evidence::of(findings.iter(), 0.25).may_use(level, 1.0)
    }

    #[test]
    fn camera_samples_estimated_separately_are_one_finding() {
        let light = |ratio, traced, level| light(ratio, traced, level, 0);
        // The estimates are off by the same, the traces by chance.
        let mut one = light(0.5, [0.75, 0.85], 3);
        one.join(&light(0.5, [0.85, 0.75], 5), 0.5);
        assert_eq!(
            (one.unshadowed, one.estimate),
            (0.5, Estimate { ratio: 0.5, level: 5, order: 0 })
        );
        assert!(one.traced.iter().all(|traced| (traced - 0.8).abs() < 1e-6));
        let found = findings_of(1.0, &[one])[0];
        assert!(found.noise < 1e-6 && found.error > 100.0, "{found:?}");
        // More risk counts, on whichever scale.
        one.join(&light(0.5, [0.8; 2], STEPS as u8 + 4), 0.5);
        assert_eq!(one.estimate.level, 5);
        one.join(&light(0.5, [0.8; 2], STEPS as u8 + 5), 0.5);
        assert_eq!(one.estimate.level, STEPS as u8 + 5);
        // What no light reached tells nothing.
        let dark = LightComparison { unshadowed: 0.0, ..light(f32::NAN, [f32::NAN; 2], 0) };
        let before = one.estimate;
        one.join(&dark, 0.5);
        assert_eq!((one.unshadowed, one.estimate), (0.25, before));
    }

    #[test]
    fn nothing_is_used_without_a_probe() {
        assert!(!may_use(&[], CALM));
        assert!(!may_use(&[found(CALM, 0.0, 0.0)], EDGE));
        assert!(!may_use(&[found(CALM, 0.0, 0.0); 9], u8::MAX));
    }

    #[test]
    fn estimates_are_used_only_if_they_are_no_worse_than_a_trace() {
        let probes = |error, noise| vec![found(EDGE, error, noise); 2000];
        assert!(may_use(&probes(1.0, 2.0), EDGE));
        assert!(!may_use(&probes(1.9, 2.0), EDGE));
        // Nobody sees it.
        let calm = |error| vec![found(CALM, error, 0.0); 400];
        assert!(may_use(&calm(0.01), CALM));
        assert!(!may_use(&calm(0.1), CALM));
    }

    /// One estimate between its two traces has a negative error.
    #[test]
    fn one_lucky_finding_of_a_higher_level_does_not_outweigh_many() {
        let known = vec![found(4, 3.0, 1.0); 500];
        assert!(!may_use(&known, 4));
        assert!(!may_use(&[&known[..], &[found(8, -10.0, 9.0)]].concat(), 4));
    }

    #[test]
    fn an_edge_needs_more_probes_than_a_calm_surface() {
        let clean = |level, count| vec![found(level, 0.0, 0.5); count];
        assert!(may_use(&clean(CALM, 9), CALM));
        assert!(!may_use(&clean(EDGE, 100), EDGE));
        assert!(may_use(&clean(EDGE, 1000), EDGE));
    }

    #[test]
    fn findings_count_for_adjacent_and_lower_levels() {
        let clean = vec![found(EDGE, 0.0, 0.5); 1000];
        let may_use = |level| may_use(&clean, level);
        assert!(may_use(EDGE + 1));
        assert!(!may_use(EDGE + 2));
        // Nothing is known of tracing's noise there.
        assert!(!may_use(EDGE - 2));
        let seen = [&clean[..], &[found(EDGE - 2, 9.0, 0.5)]].concat();
        let may_use = |level| Evidence::of(seen.iter(), 0.25).may_use(level, 1.0);
        assert!(may_use(EDGE - 2));
        // Detail, and what is seen in mirrors, are other matters.
        let of_scale = |scale: usize| (scale * STEPS) as u8;
        assert!((1..LEVELS / STEPS).all(|scale| !may_use(EDGE + of_scale(scale))));
        // But what is no worse than a trace in detail is none the worse where it may be noise.
        let detail = vec![found(EDGE + of_scale(1), 0.0, 0.5); 1000];
        let evidence = Evidence::of(detail.iter(), 0.25);
        let is_taken = |scale| evidence.may_use(EDGE + of_scale(scale), 1.0);
        assert_eq!([0, 1, 2, 3].map(is_taken), [true, true, false, false]);
    }

    #[test]
    fn findings_that_check_rays_contradict_do_not_count() {
        let wrong = Finding { agreed: false, ..found(EDGE, 900.0, 0.5) };
        let mut probes = vec![found(EDGE, 0.0, 0.5); 2000];
        probes.extend([wrong; 100]);
        assert!(may_use(&probes, EDGE));
        probes.iter_mut().for_each(|probe| probe.agreed = true);
        assert!(!may_use(&probes, EDGE));
    }

    fn light(ratio: f32, traced: [f32; 2], level: u8, order: u32) -> LightComparison {
        let estimate = Estimate { ratio, level, order };
        LightComparison { unshadowed: 0.5, estimate, traced, agreed: true }
    }

    #[test]
    fn a_finding_compares_all_known_lights_together() {
        let light = |ratio: f32, traced| light(ratio, traced, EDGE, 0);
        let all = |share, lights: &[LightComparison]| findings_of(share, lights)[0];
        // One light's error makes up for the other's.
        let finding = all(1.0, &[light(0.5, [0.25; 2]), light(0.5, [0.75; 2])]);
        assert_eq!((finding.error, finding.noise, finding.level), (0.0, 0.0, EDGE));
        let noisy = [light(0.5, [0.25, 0.75]), light(f32::NAN, [1.0, 0.0])];
        let finding = all(1.0, &noisy);
        assert!(finding.error < 0.0 && finding.noise > 0.0);
        assert!((all(0.5, &noisy).noise / finding.noise - 0.25).abs() < 1e-6);
        assert!(findings_of(1.0, &noisy[1..]).is_empty());
    }

    #[test]
    fn calm_lights_beside_a_brighter_risky_one_have_a_finding_of_their_own() {
        let lights = [
            light(0.0, [1.0, 0.5], EDGE, 2),
            light(0.5, [0.25; 2], CALM, 0),
            // As calm as the one before it.
            LightComparison { agreed: false, ..light(0.5, [0.5; 2], CALM + 1, 1) },
        ];
        let found = findings_of(1.0, &lights);
        let part = of_lights(CALM + 1, true);
        assert_eq!(found.iter().map(|f| f.level).collect::<Vec<_>>(), [EDGE, part]);
        assert_eq!([found[0].agreed, found[1].agreed], [true, false]);
        assert!(found[0].noise > 0.0 && found[1].noise == 0.0);
        // Beside the risky light as it is, not beside its estimate.
        let shown = |ratio: f32| f64::from(shown(0.5 * (0.75 + 0.5 + ratio)));
        let expected = (shown(0.5) - shown(0.25)).powi(2);
        assert!((f64::from(found[1].error) / expected - 1.0).abs() < 1e-4);
        // Two ratios of one light are one set.
        let parts = [light(0.0, [1.0, 0.5], EDGE, 0), light(0.5, [0.25; 2], EDGE, 0)];
        assert_eq!(findings_of(1.0, &parts).len(), 1);
    }
}
