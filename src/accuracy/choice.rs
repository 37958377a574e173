//! Which setting of a measured sweep to recommend for an error or for a time.

use super::errors::Errors;
use super::errors::ROUNDING;
use super::knobs::Knob;
use super::row::CandidateRow;
use super::table::Measured;
use crate::measure::psnr;

/// An error that frames must not exceed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// At least this PSNR, dB.
    Psnr(f64),
    /// At least this SSIM.
    Ssim(f64),
    /// At most this FLIP.
    Flip(f64),
    /// At most this share of pixels off by more than 2 display steps.
    MaxShare(f64),
}

impl std::fmt::Display for Goal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Psnr(least) => write!(f, "psnr={least}"),
            Self::Ssim(least) => write!(f, "ssim={least}"),
            Self::Flip(most) => write!(f, "flip={most}"),
            // Of 0.07 a hundred times is 7, not 7.000000000000001.
            Self::MaxShare(most) => write!(f, "max-share={}%", (100.0 * most) as f32),
        }
    }
}

impl Goal {
    /// The largest figure that reaches it. Figures rise with the error: the squared error in squares of a
    /// display step for PSNR, 1 - SSIM, FLIP, the share of pixels.
    pub fn largest(self) -> f64 {
        match self {
            Self::Psnr(least) => 255.0 * 255.0 * 10f64.powf(-least / 10.0),
            Self::Ssim(least) => 1.0 - least,
            Self::Flip(most) | Self::MaxShare(most) => most,
        }
    }

    /// A figure as [`Self::largest`] has it in words; `None` for PSNR, which is reported for every setting.
    pub fn in_words(self, figure: f64) -> Option<String> {
        match self {
            Self::Psnr(_) => None,
            Self::Ssim(_) => Some(format!("SSIM {:.4}", 1.0 - figure)),
            Self::Flip(_) => Some(format!("FLIP {figure:.4}")),
            Self::MaxShare(_) => Some(format!("share {:.3} %", 100.0 * figure)),
        }
    }

    /// Whether rounding to 8 bits alone is a larger error than the goal allows.
    pub fn is_beyond_8_bits(self) -> bool {
        matches!(self, Self::Psnr(least) if least > Self::most_of_8_bits())
    }

    /// The highest PSNR that rounding to 8 bits leaves, dB.
    pub fn most_of_8_bits() -> f64 {
        psnr(ROUNDING / (255.0 * 255.0))
    }

    /// Whether `errors` reach the goal.
    pub fn is_met(self, errors: &Errors) -> bool {
        match self {
            Self::Psnr(least) => errors.psnr >= least,
            Self::Ssim(least) => errors.ssim >= least,
            Self::Flip(most) => errors.flip <= most,
            Self::MaxShare(most) => errors.share_over_2 <= most,
        }
    }
}

/// The setting to recommend for `goal`: the fastest that reached it, among those that may be recommended.
/// Where the default reached it, another setting is recommended only if it is surely faster, beyond the
/// spread of the turns; none is where there were too few turns.
pub fn fastest_reaching(measured: &Measured, goal: Goal) -> Option<&CandidateRow> {
    let default_reaches = goal.is_met(&measured.default_row().errors);
    let is_surely_faster = |row: &CandidateRow| {
        row.time_ratio.is_some_and(|r| r.differs_from(1.0) && r.interval.estimate < 1.0)
    };
    let reach = recommendable(measured).filter(|row| goal.is_met(&row.errors));
    let reach =
        reach.filter(|row| !default_reaches || row.knob == Knob::Default || is_surely_faster(row));
    reach.min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
}

/// Of the settings that may be faster than `found`, the one recommended for `goal`, but were timed in too
/// few turns to be sure, the one with the shortest time estimated.
pub fn perhaps_faster<'m>(
    measured: &'m Measured,
    goal: Goal,
    found: &CandidateRow,
) -> Option<&'m CandidateRow> {
    let reach = recommendable(measured).filter(|row| goal.is_met(&row.errors));
    let faster = reach.filter(|row| seconds(row) < seconds(found) && is_by_few_turns(row));
    faster.min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
}

/// Whether `row` was timed in too few turns to be sure of any difference from the default's time.
fn is_by_few_turns(row: &CandidateRow) -> bool {
    row.knob != Knob::Default && row.time_ratio.is_none_or(|ratio| !ratio.is_sure())
}

/// The setting nearest to the truth that took at most `most` seconds a frame, among those that may be
/// recommended.
pub fn best_within(measured: &Measured, most: f64) -> Option<&CandidateRow> {
    let within = recommendable(measured).filter(|row| seconds(row) <= most);
    within.min_by(|a, b| a.errors.mse.total_cmp(&b.errors.mse))
}

fn recommendable(measured: &Measured) -> impl Iterator<Item = &CandidateRow> {
    measured.rows.iter().filter(|row| row.knob.is_ranked())
}

fn seconds(row: &CandidateRow) -> f64 {
    row.seconds.median.interval.estimate
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::measured;
    use super::*;

    #[test]
    fn the_fastest_that_is_good_enough_and_the_best_that_is_fast_enough() {
        let measured = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::CameraSamples, "--spp 16", 4.0, 0.5),
            (Knob::Tolerance, "--tolerance 0.5", 1.3, 1.2),
            (Knob::Retry, "--retry off", 0.1, 0.1),
        ]);
        let options = |row: Option<&CandidateRow>| row.map(|row| row.options.clone());
        let psnr = |steps: f64| crate::measure::psnr((steps / 255.0) * (steps / 255.0)) - 1e-9;
        let fastest = |goal| options(fastest_reaching(&measured, goal));
        assert_eq!(fastest(Goal::Psnr(psnr(2.0))), Some(String::new()));
        assert_eq!(fastest(Goal::Psnr(psnr(1.2))), Some("--tolerance 0.5".into()));
        assert_eq!(fastest(Goal::Flip(0.5 / 255.0 + 1e-9)), Some("--spp 16".into()));
        assert_eq!(fastest(Goal::Psnr(99.0)), None);
        assert_eq!(fastest(Goal::MaxShare(0.0)), Some(String::new()));
        assert_eq!(options(best_within(&measured, 1.3)), Some("--tolerance 0.5".into()));
        assert_eq!(options(best_within(&measured, 0.5)), None);
    }

    #[test]
    fn few_turns_recommend_nothing_beside_the_default() {
        let mut measured = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::CutOff, "--cutoff 0.01", 0.9, 2.0),
            (Knob::Tolerance, "--tolerance 2", 0.5, 2.0),
            (Knob::CameraSamples, "--spp 16", 4.0, 0.5),
        ]);
        // Of six turns one was fast by chance.
        let turns = [0.3, 1.1, 1.2, 1.1, 1.1, 1.2];
        measured.rows[2].time_ratio = crate::measure::median(&turns);
        let goal = Goal::Psnr(20.0);
        let told = |m: &Measured, goal| {
            let row = fastest_reaching(m, goal).expect("some reach");
            (row.options.clone(), perhaps_faster(m, goal, row).map(|row| row.options.clone()))
        };
        assert_eq!(told(&measured, goal), ("--cutoff 0.01".into(), None));
        // All faster in each of three turns, which still may be chance.
        for row in &mut measured.rows[1..] {
            row.time_ratio = crate::measure::median(&[0.5, 0.6, 0.55]);
        }
        assert_eq!(told(&measured, goal), (String::new(), Some("--tolerance 2".into())));
        // What alone reaches it is recommended however few turns there are.
        let near = Goal::Flip(0.5 / 255.0 + 1e-9);
        assert_eq!(told(&measured, near), ("--spp 16".into(), None));
    }

    #[test]
    fn rounding_alone_decides_of_psnr_only() {
        assert!((Goal::most_of_8_bits() - 58.92).abs() < 0.01);
        assert!(Goal::Psnr(59.0).is_beyond_8_bits() && !Goal::Psnr(58.9).is_beyond_8_bits());
        assert!(!Goal::Ssim(0.9999).is_beyond_8_bits() && !Goal::Flip(1e-6).is_beyond_8_bits());
    }

    #[test]
    fn a_share_is_told_as_it_was_asked_for() {
        for percent in [0.1, 0.3, 5.0, 7.0, 29.0] {
            let told = Goal::MaxShare(0.01 * percent).to_string();
            assert_eq!(told, format!("max-share={percent}%"));
        }
    }

    #[test]
    fn a_figure_is_told_in_the_unit_that_it_was_asked_in() {
        let words = |goal: Goal, figure| goal.in_words(figure).unwrap_or_default();
        assert_eq!(words(Goal::Ssim(0.99), 0.0125), "SSIM 0.9875");
        assert_eq!(words(Goal::Flip(0.01), 0.0125), "FLIP 0.0125");
        assert_eq!(words(Goal::MaxShare(0.05), 0.0125), "share 1.250 %");
        assert_eq!(Goal::Psnr(40.0).in_words(0.0125), None);
    }
}
