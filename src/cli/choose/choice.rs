//! What was chosen, as the manifest keeps it.

use super::decibels;
use crate::accuracy::{FixedSettings, Prediction, Predictor, Verdict};
use crate::cli::{spelled, values};
use crate::effects::EffectPlan;
use crate::output::manifest::Header;
use crate::page::words::seconds;
use crate::scene::{FrameRange, Settings};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// What was chosen and why; the manifest keeps it, so that a job that goes on chooses nothing anew.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Choice {
    /// What was wanted, in words.
    pub wanted: String,
    /// The settings before, and which of them the user gave.
    pub(super) base: Value,
    pub(super) given: FixedSettings,
    /// The squared error that the target allows, display steps.
    pub(super) allowed: Option<f64>,
    /// What is foretold of the choice.
    pub foretold: Prediction,
    /// All that the probe found out.
    pub(super) foretelling: Predictor,
    /// Wall seconds that rendering and writing all frames is foretold to take.
    pub(super) seconds: f64,
    /// How often it was tightened.
    pub tightened: u32,
    /// What was held against what came out: the shot's hash, and frames of it.
    pub(super) checked: Option<(String, FrameRange)>,
    /// How good these came out, in words, if they were looked at.
    #[serde(default)]
    pub came_out: Option<String>,
    /// What came of the target then.
    #[serde(default)]
    pub(super) verdict: Option<Verdict>,
}

impl Choice {
    /// The settings that were chosen over `base`.
    pub fn settings(&self, base: &Settings) -> Settings {
        self.foretold.settings(base)
    }

    /// As the manifest keeps it.
    pub fn value(&self) -> Value {
        serde_json::to_value(self).unwrap_or_default()
    }

    /// Whether `frames` of the shot of this hash were held against what came out.
    pub fn is_checked(&self, shot: &str, frames: FrameRange) -> bool {
        let holds = |seen: &FrameRange| seen.first <= frames.first && frames.last <= seen.last;
        self.checked.as_ref().is_some_and(|(hash, seen)| hash == shot && holds(seen))
    }

    /// The choice whose `frames` were.
    pub fn checked(self, shot: &str, frames: FrameRange) -> Self {
        Self { checked: Some((shot.into(), frames)), ..self }
    }

    /// The choice that a manifest's header holds, if this version can read it.
    pub fn of(header: &Header) -> Option<Self> {
        serde_json::from_value(header.chosen.clone()?).ok()
    }

    /// What came of the target, if there was one and it was looked at.
    pub fn verdict(&self) -> Option<String> {
        let came = match self.verdict? {
            Verdict::Reached => "reached",
            Verdict::Open => "not told apart from the target by so few pixels",
            Verdict::Missed => "missed",
        };
        Some(format!("{}: {came}", self.wanted))
    }

    /// All options that stand for it, whether they have a part in the scene or not.
    pub fn options(&self) -> String {
        spelled::options(&self.foretold.settings(&Settings::default()), &EffectPlan::EVERYTHING)
    }

    /// The command that gives the same frames whatever the clock says: what was chosen in place of the
    /// wish. Options that are given stay.
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

    /// What is foretold of it, in words.
    pub fn foretold_in_words(&self) -> String {
        format!(
            "{}PSNR {} in the worst frame, {} a frame, {} in all",
            self.figure().map_or(String::new(), |figure| format!("{figure}, ")),
            decibels(self.foretold.psnr()),
            seconds(self.foretold.seconds),
            seconds(self.seconds)
        )
    }

    /// What is foretold of it in the target's own unit, unless that is PSNR.
    pub(super) fn figure(&self) -> Option<String> {
        let figure = self.foretelling.foretold_figure(&self.foretold)?;
        values::goal(&self.wanted).ok()?.in_words(figure)
    }
}

/// Whether a command leaves settings to the program.
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
