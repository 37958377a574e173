//! Progress of a sweep on stderr: one line that is redrawn on a terminal, plain lines elsewhere.

use crate::cli::progress::duration;
use crate::cli::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::Instant;

/// Units of a whole bar.
const UNITS: f64 = 1000.0;

/// Who hears of progress, and how.
pub struct ProgressLine {
    start: Instant,
    bar: Option<ProgressBar>,
    is_plain: bool,
}

impl ProgressLine {
    /// `quiet` says nothing at all.
    pub fn new(quiet: bool) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        Self {
            start: Instant::now(),
            bar: (!quiet && is_terminal).then(bar),
            is_plain: !quiet && !is_terminal,
        }
    }

    /// What is being done, the share that is over, and how many seconds are left, if that is known.
    pub fn tell(&self, text: &str, share: f64, left: Option<f64>) {
        if let Some(bar) = &self.bar {
            bar.set_position((UNITS * share) as u64);
            bar.set_message(format!("{text}{}", left.map_or(String::new(), left_text)));
        } else if self.is_plain {
            say::aside(format_args!("{text}{}", left.map_or(String::new(), left_text)));
        }
    }

    /// Whether it is redrawn, so that small steps may be told.
    pub fn is_drawn(&self) -> bool {
        self.bar.is_some()
    }

    /// What stays to be read.
    pub fn note(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| say::aside(text)),
            None if self.is_plain => say::aside(text),
            None => {}
        }
    }

    /// Seconds since the beginning.
    pub fn seconds(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Takes the line away, so that what follows stands on clean lines.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

fn left_text(seconds: f64) -> String {
    format!("  left {}", duration(seconds))
}

fn bar() -> ProgressBar {
    let target = ProgressDrawTarget::stderr_with_hz(10);
    let bar = ProgressBar::with_draw_target(Some(UNITS as u64), target);
    let style = ProgressStyle::with_template("{bar:20}  {wide_msg}");
    bar.set_style(style.unwrap_or(ProgressStyle::default_bar()));
    bar
}
