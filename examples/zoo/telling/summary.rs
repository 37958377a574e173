//! The targets, and what was met.

use super::record::{Frame, Told};
use super::table::median;
use crate::judging::Failure;
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// What was wanted and what came out.
#[derive(Serialize)]
pub struct Summary {
    pub text: String,
    pub all_met: bool,
}

/// Moves shorter than this say little of speed: most of their frames are key frames.
pub const LONG: usize = 24;

/// Holds the figures against the targets.
pub fn summary(told: &[Told], frames_of_move: usize) -> Summary {
    let frames: Vec<&Frame> = told.iter().flat_map(|t| &t.frames).collect();
    let mut summary = Summary { text: String::new(), all_met: true };
    let of_frames =
        |is: fn(&Frame) -> bool| [frames.iter().filter(|f| is(f)).count(), frames.len()];
    summary.want("frames that keep the contract, chance allowed for", of_frames(|f| f.keeps), 0.99);
    let strictly = of_frames(|f| f.keeps_strictly);
    summary.tell(&format!("  strictly: {} of {}", strictly[0], strictly[1]));
    let (breaks, traces): (usize, usize) =
        frames.iter().fold((0, 0), |(b, t), f| (b + f.chance_breaks, t + f.chance.len()));
    summary.tell(&format!(
        "  independent traces that break the bound which others give: {breaks} of {traces} frames"
    ));
    summary.want(
        "frames not worse than traced by more than 0.3 dB and visible (RMSE above 0.25)",
        of_frames(|f| !f.is_visibly_worse),
        1.0,
    );
    let ratios: Vec<f64> = told.iter().filter_map(|t| t.flicker_ratio).collect();
    let calm = ratios.iter().filter(|r| **r <= 1.0).count();
    summary.want("moves that flicker at most as traced ones", [calm, ratios.len()], 0.95);
    let audits: Vec<bool> = told.iter().filter_map(|t| Some(t.audit.as_ref()?.holds)).collect();
    let holds = audits.iter().filter(|holds| **holds).count();
    summary.want("audits whose interval holds the truth", [holds, audits.len()], 0.95);
    for (k, name) in ["inferred", "traced"].into_iter().enumerate() {
        let gains: Vec<f64> = told.iter().filter_map(|t| Some(t.gains?[k])).collect();
        if gains.is_empty() {
            continue;
        }
        let met = gains.iter().filter(|gain| **gain >= -0.2).count();
        let what = format!("moves at most 0.2 dB above uniform samples of as many rays, {name}");
        summary.want(&what, [met, gains.len()], 1.0);
        let worst = gains.iter().copied().fold(f64::INFINITY, f64::min);
        summary.tell(&format!(
            "  nearer by {:.2} dB in the median, {worst:.2} at worst",
            median(&gains)
        ));
    }
    let speeds: Vec<f64> = told.iter().map(|t| t.speed).collect();
    let slow = speeds.iter().filter(|s| **s < 1.0 / 1.05).count();
    if frames_of_move >= LONG {
        summary.all_met &= median(&speeds) >= 2.5;
        let met = if median(&speeds) >= 2.5 { "met   " } else { "MISSED" };
        summary.tell(&format!("{met} median speed, CPU: {:.2} (wanted 2.5)", median(&speeds)));
        summary.want(
            "moves not slower than 1.05 times traced",
            [speeds.len() - slow, speeds.len()],
            1.0,
        );
    } else {
        summary.tell(&format!(
            "-      median speed, CPU: {:.2}, slower than 1.05 times traced: {slow}; --frames 48 for the target",
            median(&speeds)
        ));
    }
    summary
}

impl Summary {
    fn tell(&mut self, line: &str) {
        let _ = writeln!(self.text, "{line}");
    }

    /// So many of so many are to be a share of them.
    fn want(&mut self, what: &str, [met, all]: [usize; 2], share: f64) {
        if all == 0 {
            return self.tell(&format!("-      {what}: none here"));
        }
        let is_met = met as f64 >= share * all as f64;
        self.all_met &= is_met;
        let word = if is_met { "met   " } else { "MISSED" };
        let percent = 100.0 * met as f64 / all as f64;
        self.tell(&format!(
            "{word} {what}: {met} of {all}, {percent:.1} % (wanted {:.0} %)",
            100.0 * share
        ));
    }
}

/// Writes all of it.
pub fn save_json(path: &Path, told: &[Told], summary: &Summary) -> Result<(), Failure> {
    let all = serde_json::json!({ "scenes": told, "summary": summary });
    Ok(std::fs::write(path, serde_json::to_vec_pretty(&all)?)?)
}
