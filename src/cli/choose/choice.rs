//! The chosen settings, as the manifest keeps them.

use super::decibels;
use crate::accuracy::{FixedSettings, Prediction, Predictor, Verdict};
use crate::cli::{spelled, values};
use crate::effects::EffectPlan;
use crate::output::manifest::Header;
use crate::page::words::seconds;
use crate::scene::{FrameRange, Settings};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The settings that were chosen, and why. The manifest keeps them, so that a job that goes on does not choose
/// again.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Choice {
    /// The target or budget, as on the command line.
    pub wanted: String,
    /// The settings before the choice.
    pub(super) base: Value,
    /// Which of them the user gave.
    pub(super) given: FixedSettings,
    /// The setting that was chosen, with its predicted error and time.
    pub predicted: Prediction,
    /// The predictor that the probe made.
    pub(super) predictor: Predictor,
    /// Wall seconds that rendering and writing all frames is predicted to take.
    pub(super) seconds: f64,
    /// How often the choice was tightened after a miss.
    pub tightened: u32,
    /// The finished frames that were checked: the shot's hash, and the range of frames.
    pub(super) checked: Option<(String, FrameRange)>,
    /// The check's result in words; `None` before a check.
    #[serde(default)]
    pub came_out: Option<String>,
    /// Whether the target was reached; `None` before a check, and for a budget.
    #[serde(default)]
    pub(super) verdict: Option<Verdict>,
}

impl Choice {
    /// `base` with the settings that were chosen.
    pub fn settings(&self, base: &Settings) -> Settings {
        self.predicted.settings(base)
    }

    /// The choice as JSON, for the manifest.
    pub fn value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// Whether a check was made of a range that has all of `frames`, of the shot of this hash.
    pub fn is_checked(&self, shot: &str, frames: FrameRange) -> bool {
        let holds = |seen: &FrameRange| seen.first <= frames.first && frames.last <= seen.last;
        self.checked.as_ref().is_some_and(|(hash, seen)| hash == shot && holds(seen))
    }

    /// The choice with the note that `frames` of the shot of this hash were checked.
    pub fn checked(self, shot: &str, frames: FrameRange) -> Self {
        Self { checked: Some((shot.into(), frames)), ..self }
    }

    /// The choice in a manifest's header; `None` where there is none that this version can read.
    pub fn of(header: &Header) -> Option<Self> {
        serde_json::from_value(header.chosen.clone()?).ok()
    }

    /// Whether the target was reached, in words; `None` before a check, and for a budget.
    pub fn verdict(&self) -> Option<String> {
        let came = match self.verdict? {
            Verdict::Reached => "reached",
            Verdict::Open => "undecided: too close to the target for so few pixels",
            Verdict::Missed => "missed",
        };
        Some(format!("{}: {came}", self.wanted))
    }

    /// All command-line options of the choice, also those without effect in the scene.
    pub fn options(&self) -> String {
        spelled::options(&self.predicted.settings(&Settings::default()), &EffectPlan::EVERYTHING)
    }

    /// `command` with the chosen options in place of `--target` or `--budget`: it gives the same frames on any
    /// machine. Options in `command` stay.
    pub fn spelled_out(&self, command: &[String]) -> Vec<String> {
        let options = self.options();
        let options: Vec<&str> = options.split(' ').collect();
        let is_given = |name: &str| command.iter().any(|word| is_option(word, name));
        let chosen = options.chunks(2).filter(|pair| !is_given(pair[0])).flatten();
        let mut words = Vec::new();
        let mut left = command.iter();
        while let Some(word) = left.next() {
            if !is_wish(word) {
                words.push(word.clone());
                continue;
            }
            words.extend(chosen.clone().map(ToString::to_string));
            if !word.contains('=') {
                left.next();
            }
        }
        words
    }

    /// Predicted error and time, in words.
    pub fn prediction_in_words(&self) -> String {
        format!(
            "{}PSNR {} in the worst frame, {} a frame, {} in all",
            self.figure().map_or(String::new(), |figure| format!("{figure}, ")),
            decibels(self.predicted.psnr()),
            seconds(self.predicted.seconds),
            seconds(self.seconds)
        )
    }

    /// The target's figure of the choice as the probe measured it, in words; `None` for PSNR and for budgets.
    pub(super) fn figure(&self) -> Option<String> {
        values::goal(&self.wanted).ok()?.in_words(self.predicted.figure?)
    }
}

/// Whether a command has `--target` or `--budget`.
pub fn asks_for_choice(command: &[String]) -> bool {
    command.iter().any(|word| is_wish(word))
}

fn is_wish(word: &str) -> bool {
    is_option(word, "--target") || is_option(word, "--budget")
}

/// Whether a word of a command is the option `name`, with its value or before it.
fn is_option(word: &str, name: &str) -> bool {
    word.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('='))
}
