//! Progress of a sweep on stderr: one line that is redrawn on a terminal, plain lines elsewhere.

use crate::cli::progress::duration;
use crate::cli::say;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::time::Instant;

/// Units of a whole bar.
const UNITS: f64 = 1000.0;

/// The line of progress.
pub struct ProgressLine {
    start: Instant,
    bar: Option<ProgressBar>,
    is_plain: bool,
}

impl ProgressLine {
    /// A line that prints nothing if `quiet`.
    pub fn new(quiet: bool) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        Self {
            start: Instant::now(),
            bar: (!quiet && is_terminal).then(bar),
            is_plain: !quiet && !is_terminal,
        }
    }

    /// Shows the current work, the finished share, and the seconds left, if known.
    pub fn tell(&self, text: &str, share: f64, left: Option<f64>) {
        if let Some(bar) = &self.bar {
            bar.set_position((UNITS * share) as u64);
            bar.set_message(format!("{text}{}", left.map_or(String::new(), left_text)));
        } else if self.is_plain {
            say::aside(format_args!("{text}{}", left.map_or(String::new(), left_text)));
        }
    }

    /// Whether the line is redrawn, so that small steps may be shown.
    pub fn is_drawn(&self) -> bool {
        self.bar.is_some()
    }

    /// Prints a line that stays.
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

    /// Removes the line, so that later output starts on a clean line.
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
