//! What was measured of one candidate.

use super::change::Change;
use super::errors::Errors;
use super::knobs::{Candidate, Knob};
use super::ledger::TrialRecord;
use crate::measure::{Median, median};
use crate::stats::RayCounts;
use serde::Serialize;
use std::collections::BTreeMap;

/// A candidate's figures. Seconds, rays: per frame, the mean over the move.
#[derive(Debug, Clone, Serialize)]
pub struct CandidateRow {
    /// What it turns.
    pub knob: Knob,
    /// The options that turn it; empty for the default.
    pub options: String,
    /// The mean of the turns.
    pub errors: Errors,
    /// Root mean squared error of each turn, display steps.
    pub rmse_of_turns: Vec<f64>,
    /// Wall seconds.
    pub seconds: Spread,
    /// CPU seconds, all threads together.
    pub cpu_seconds: Spread,
    /// Wall seconds to build the intersector, once a job.
    pub build_seconds: Spread,
    /// Seconds over the default's of the same turn and run; `None` for the default.
    pub time_ratio: Option<Median>,
    /// CPU seconds over the default's of the same turn: on a busy machine they tell more.
    pub cpu_ratio: Option<Median>,
    /// Root mean squared error over the default's of the same turn.
    pub error_ratio: Option<Median>,
    /// How its pixels differ from the default's with the same seed.
    pub change: Option<Change>,
    /// Rays a frame.
    pub rays_per_frame: f64,
    /// Camera samples a pixel; `None` where all pixels take as many.
    pub camera_samples: Option<f64>,
    /// Rays by kind, of all frames made in a turn.
    pub rays: RayCounts,
    /// Intersector and references, bytes.
    pub memory_bytes: u64,
    /// Whether the candidate is on the front by wall seconds: it may be recommended, no other that may be is both
    /// faster and nearer to the truth, and its difference from its neighbours on the front is not noise.
    pub on_front: bool,
    /// The same by CPU seconds.
    pub on_cpu_front: bool,
}

impl CandidateRow {
    /// The setting's name.
    pub fn name(&self) -> String {
        self.knob.name_of(&self.options)
    }

    /// Whether its pixels were compared with the default's and are the same.
    pub fn has_pixels_of_default(&self) -> bool {
        self.change.is_some_and(|change| change.pixels > 0 && change.differing == 0)
    }
}

/// A median, and what it is the median of.
#[derive(Debug, Clone, Serialize)]
pub struct Spread {
    /// The middle.
    #[serde(flatten)]
    pub median: Median,
    /// The measured values behind the median, one for each repetition.
    pub turns: Vec<f64>,
}

/// What a candidate's turns gave so far, by turn.
#[derive(Default)]
pub struct Taken(pub(super) BTreeMap<u32, TrialRecord>);

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

/// The row of `candidate`, whose turns gave `own`, beside the `default`'s; on no front yet.
pub(super) fn row(candidate: &Candidate, own: &Taken, default: Option<&Taken>) -> CandidateRow {
    let sure = |ratios: &[f64]| median(ratios).filter(|m| m.interval.estimate.is_finite());
    let errors = own.errors();
    let first = own.0.values().next().cloned().unwrap_or_default();
    CandidateRow {
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
        camera_samples: first.camera_samples,
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
