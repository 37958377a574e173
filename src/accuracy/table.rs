//! What was measured, a row a candidate.

use super::front;
use super::knobs::Candidate;
use super::row::{CandidateRow, Taken, row};
use serde::Serialize;

/// All rows, the default's first.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// One a candidate.
    pub rows: Vec<CandidateRow>,
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

    /// The row of the default settings.
    pub fn default_row(&self) -> &CandidateRow {
        &self.rows[0]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::accuracy::errors::Errors;
    use crate::accuracy::knobs::Knob;
    use crate::accuracy::ledger::TrialRecord;
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
            (Knob::Probes, "--probes 0.003", 0.9, 2.0),
            (Knob::Denoiser, "--spp 1", 0.9, 1.0),
            (Knob::Policy, "--policy off", 3.0, 1.0),
            (Knob::Tolerance, "--tolerance 2", 1.0, 2.0),
        ]);
        let front: Vec<bool> = measured.rows.iter().map(|row| row.on_front).collect();
        assert_eq!(front, [true, false, false, false, false, false, true, false]);
        let ratio = measured.rows[1].time_ratio.expect("timed");
        assert!(ratio.interval.estimate == 4.0 && ratio.differs_from(1.0));
        assert!(measured.default_row().time_ratio.is_none());
    }
}
