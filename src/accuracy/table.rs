//! The table of a sweep: a row of figures for each candidate.

use super::errors::{Errors, Frames};
use super::front;
use super::knobs::{Candidate, Knob};
use super::ledger::TrialRecord;
use crate::measure::{Median, largest_error, median, share_exceeding};
use crate::stats::RayCounts;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// All rows, the default's first.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// A row for each candidate.
    pub rows: Vec<Row>,
}

/// The figures of a candidate. Seconds and rays are per frame, means over the move.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// The knob that the candidate turns.
    pub knob: Knob,
    /// Command-line options of the setting; empty for the default.
    pub options: String,
    /// Errors, means over the turns.
    pub errors: Errors,
    /// Root mean squared error of each turn, display steps.
    pub rmse_of_turns: Vec<f64>,
    /// Wall seconds.
    pub seconds: Spread,
    /// CPU seconds of all threads together.
    pub cpu_seconds: Spread,
    /// Wall seconds to build the intersector, once a job.
    pub build_seconds: Spread,
    /// Ratio of wall seconds to the default's of the same turn and run; `None` for the default.
    pub time_ratio: Option<Median>,
    /// Ratio of CPU seconds to the default's of the same turn: on a busy machine it is known better.
    pub cpu_ratio: Option<Median>,
    /// Ratio of the root mean squared error to the default's of the same turn.
    pub error_ratio: Option<Median>,
    /// How pixels differ from the default's with the same seed.
    pub change: Option<Change>,
    /// Rays a frame.
    pub rays_per_frame: f64,
    /// Rays by kind, of all frames made in a turn.
    pub rays: RayCounts,
    /// Memory of the intersector and of the references, bytes.
    pub memory_bytes: u64,
    /// Whether it is on the front of error and wall time: no other candidate that may be recommended is both
    /// faster and more accurate.
    pub on_front: bool,
    /// Whether it is on the front of error and CPU time.
    pub on_cpu_front: bool,
}

impl Row {
    /// Whether all pixels are those of the default.
    pub fn has_pixels_of_default(&self) -> bool {
        self.change.is_some_and(|change| change.pixels > 0 && change.differing == 0)
    }
}

/// A median with the values of the turns.
#[derive(Debug, Clone, Serialize)]
pub struct Spread {
    /// The median and its interval.
    #[serde(flatten)]
    pub median: Median,
    /// A value for each turn.
    pub turns: Vec<f64>,
}

/// How pixels differ from the default's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Pixels compared.
    pub pixels: u64,
    /// Pixels that differ at all.
    pub differing: u64,
    /// Pixels of which some channel differs by more than 2 display steps.
    pub over_2: u64,
    /// The largest difference, display steps.
    pub largest: f64,
}

impl Change {
    /// Between the same frames of two candidates.
    pub fn between(default: &Frames, other: &Frames) -> Self {
        let mut change = Self::default();
        for (frame, image) in other {
            let reference = &default[frame];
            let pixels = image.rgb.len() as f64;
            let differing = image.rgb.iter().zip(&reference.rgb).filter(|(a, b)| a != b).count();
            change += Self {
                pixels: pixels as u64,
                differing: differing as u64,
                over_2: (share_exceeding(reference, image, 2) * pixels).round() as u64,
                largest: 255.0 * f64::from(largest_error(reference, image).value),
            };
        }
        change
    }
}

impl AddAssign for Change {
    fn add_assign(&mut self, o: Self) {
        self.pixels += o.pixels;
        self.differing += o.differing;
        self.over_2 += o.over_2;
        self.largest = self.largest.max(o.largest);
    }
}

/// What a candidate's turns gave so far, by turn.
#[derive(Default)]
pub struct Taken(BTreeMap<u32, TrialRecord>);

impl Taken {
    /// The entries of `candidate`, by turn.
    pub fn of(entries: &[TrialRecord], candidate: usize) -> Self {
        let own = entries.iter().filter(|entry| entry.candidate == candidate);
        Self(own.map(|entry| (entry.turn, entry.clone())).collect())
    }

    /// Whether any turn was timed: the first one warms up.
    pub fn is_timed(&self) -> bool {
        self.0.keys().any(|turn| *turn > 0)
    }

    fn timed(&self, of: fn(&TrialRecord) -> f64) -> Vec<f64> {
        self.0.range(1..).map(|(_, entry)| of(entry)).collect()
    }

    fn errors(&self) -> Vec<Errors> {
        self.0.values().map(|entry| entry.errors.into()).collect()
    }

    fn change(&self) -> Change {
        let mut sum = Change::default();
        self.0.values().for_each(|entry| sum += entry.change);
        sum
    }

    /// `of` each turn from the `first` on over that of the same turn of `other`.
    fn ratios(&self, other: &Self, first: u32, of: fn(&TrialRecord) -> f64) -> Vec<f64> {
        let ratio = |(turn, entry): (&u32, &TrialRecord)| Some(of(entry) / of(other.0.get(turn)?));
        self.0.range(first..).filter_map(ratio).collect()
    }
}

impl Measured {
    /// Of `candidates` and what each gave, the default first.
    pub fn of(candidates: &[Candidate], taken: &[Taken]) -> Self {
        let rows = candidates.iter().zip(taken).enumerate();
        let rows =
            rows.map(|(k, (candidate, own))| row(candidate, own, (k > 0).then(|| &taken[0])));
        let mut measured = Self { rows: rows.collect() };
        let rows = &mut measured.rows;
        front::of(rows, |row| &row.seconds).into_iter().for_each(|k| rows[k].on_front = true);
        let by_cpu = front::of(rows, |row| &row.cpu_seconds);
        by_cpu.into_iter().for_each(|k| rows[k].on_cpu_front = true);
        measured
    }

    /// The default's.
    pub fn default_row(&self) -> &Row {
        &self.rows[0]
    }
}

fn row(candidate: &Candidate, own: &Taken, default: Option<&Taken>) -> Row {
    let sure = |ratios: &[f64]| median(ratios).filter(|m| m.interval.estimate.is_finite());
    let errors = own.errors();
    let first = own.0.values().next().cloned().unwrap_or_default();
    Row {
        knob: candidate.knob,
        options: candidate.options.clone(),
        errors: Errors::mean(&errors),
        rmse_of_turns: errors.iter().map(|e| e.rmse_steps).collect(),
        seconds: spread(&own.timed(|e| e.seconds)),
        cpu_seconds: spread(&own.timed(|e| e.cpu_seconds)),
        build_seconds: spread(&own.timed(|e| e.build_seconds)),
        time_ratio: default.and_then(|_| sure(&own.timed(|e| e.seconds / e.default_seconds))),
        cpu_ratio: default.and_then(|d| sure(&own.ratios(d, 1, |e| e.cpu_seconds))),
        error_ratio: default
            .and_then(|d| sure(&own.ratios(d, 0, |e| Errors::from(e.errors).rmse_steps))),
        change: default.map(|_| own.change()),
        rays_per_frame: first.rays_per_frame,
        rays: first.rays,
        memory_bytes: own.0.values().map(|entry| entry.memory).max().unwrap_or(0),
        on_front: false,
        on_cpu_front: false,
    }
}

fn spread(turns: &[f64]) -> Spread {
    const NOTHING: Median = Median {
        interval: crate::measure::Interval { estimate: f64::NAN, low: f64::NAN, high: f64::NAN },
        confidence: 0.0,
    };
    Spread { median: median(turns).unwrap_or(NOTHING), turns: turns.to_vec() }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::scene::Settings;

    pub fn measured(list: &[(Knob, &str, f64, f64)]) -> Measured {
        let candidate = |(knob, options, ..): &(Knob, &str, f64, f64)| Candidate {
            knob: *knob,
            options: (*options).into(),
            settings: Settings::default(),
        };
        let default = list[0].2;
        let taken = |(.., seconds, rmse): &(Knob, &str, f64, f64)| {
            let mse = (rmse / 255.0) * (rmse / 255.0);
            let errors = Errors {
                mse,
                rmse_steps: *rmse,
                psnr: crate::measure::psnr(mse),
                ssim: 1.0 - mse,
                flip: mse.sqrt(),
                share_over_2: 0.0,
                flicker: None,
            };
            let entry = |turn| TrialRecord {
                turn,
                seconds: *seconds,
                default_seconds: default,
                cpu_seconds: *seconds,
                errors: errors.into(),
                ..TrialRecord::default()
            };
            Taken((0..=6).map(|turn| (turn, entry(turn))).collect())
        };
        let candidates: Vec<Candidate> = list.iter().map(candidate).collect();
        let taken: Vec<Taken> = list.iter().map(taken).collect();
        Measured::of(&candidates, &taken)
    }

    #[test]
    fn the_front_is_what_nothing_recommendable_beats() {
        let measured = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::CameraSamples, "--spp 16", 4.0, 1.0),
            (Knob::ShadowSamples, "--shadow-samples 64", 4.0, 1.5),
            (Knob::Retry, "--retry off", 0.9, 2.0),
            (Knob::Policy, "--policy off", 3.0, 1.0),
            (Knob::Tolerance, "--tolerance 2", 1.0, 2.0),
        ]);
        let front: Vec<bool> = measured.rows.iter().map(|row| row.on_front).collect();
        assert_eq!(front, [true, false, false, false, true, false]);
        let ratio = measured.rows[1].time_ratio.expect("timed");
        assert!(ratio.interval.estimate == 4.0 && ratio.differs_from(1.0));
        assert!(measured.default_row().time_ratio.is_none());
    }
}
