//! Progress of a render on stderr: a bar on a terminal, else a plain line per frame.

use super::say;
use crate::sequence::FrameReport;
use crate::shade::Progress;
use crate::stats::RayCounts;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Bar units in a frame, so that the bar moves within a frame.
const UNITS: f64 = 1000.0;
/// A frame in the count of finished tiles, whose shares are far below a bar unit on large images.
const FRAME: u64 = 1_000_000_000;

/// The display of progress.
pub struct Watch {
    start: Instant,
    bar: Option<ProgressBar>,
    lines: bool,
    kept: u32,
    total: u32,
    finished: AtomicU32,
    rays: AtomicU64,
    /// The share reused in the last frame, as text.
    reused: Mutex<String>,
    /// Finished share of the frames that are being rendered, [`FRAME`] for a whole one.
    partly: AtomicU64,
}

impl Watch {
    /// A display for `total` frames, of which `kept` exist already; prints nothing if `quiet`.
    pub fn new(kept: usize, total: usize, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        Self {
            start: Instant::now(),
            bar: (!quiet && terminal && kept < total).then(|| bar(total - kept)),
            lines: !quiet && !terminal,
            kept: kept as u32,
            total: total as u32,
            finished: AtomicU32::new(0),
            rays: AtomicU64::new(0),
            reused: Mutex::default(),
            partly: AtomicU64::new(0),
        }
    }

    /// A frame of this or another rank is finished.
    pub fn frame_done(&self, report: &FrameReport) {
        let finished = self.finished.fetch_add(1, Ordering::Relaxed) + 1;
        // The next frame may be partly or wholly traced, but none after it.
        let beyond = |partly: u64| Some(partly.saturating_sub(FRAME).min(FRAME));
        _ = self.partly.fetch_update(Ordering::Relaxed, Ordering::Relaxed, beyond);
        let number = self.kept + finished;
        if let Some(bar) = &self.bar {
            *self.reused() = reused(report.reuse.share());
            bar.set_position(u64::from(finished) * UNITS as u64);
            bar.set_prefix(format!("frame {} of {}", (number + 1).min(self.total), self.total));
        } else if self.lines {
            let left = left(self.start.elapsed(), finished, self.total - number);
            say::aside(line(report, number, self.total, left));
        }
    }

    fn reused(&self) -> MutexGuard<'_, String> {
        self.reused.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes the bar, so that later output starts on a clean line.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Progress for Watch {
    fn tile_done(&self, share: f64, rays: &RayCounts) {
        let Some(bar) = &self.bar else { return };
        let cast = self.rays.fetch_add(rays.total(), Ordering::Relaxed) + rays.total();
        let fine = (share * FRAME as f64) as u64;
        let partly = (self.partly.fetch_add(fine, Ordering::Relaxed) + fine) as f64 / FRAME as f64;
        let finished = f64::from(self.finished.load(Ordering::Relaxed));
        bar.set_position(((finished + partly) * UNITS) as u64);
        let seconds = self.start.elapsed().as_secs_f64();
        let mrays = cast as f64 * 1e-6 / seconds.max(1e-9);
        bar.set_message(format!("{mrays:.1} Mrays/s{}", self.reused()));
    }
}

fn bar(frames: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(
        Some(frames as u64 * UNITS as u64),
        ProgressDrawTarget::stderr_with_hz(10),
    );
    let template = "{prefix}  {bar:30}  {msg}  left {eta}";
    bar.set_style(ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar()));
    bar
}

/// `frame 3 of 16  0.41 s  12.3 Mrays/s  98 % reused  left 5 s`
fn line(report: &FrameReport, number: u32, total: u32, left: Duration) -> String {
    let seconds = report.trace_seconds + report.write_seconds;
    let mrays = report.rays.total() as f64 * 1e-6 / report.trace_seconds.max(1e-9);
    format!(
        "frame {number} of {total}  {seconds:.2} s  {mrays:.1} Mrays/s{}  left {}",
        reused(report.reuse.share()),
        duration(left.as_secs_f64())
    )
}

/// `  98 % reused`, or nothing.
fn reused(share: Option<f64>) -> String {
    share.map_or(String::new(), |share| format!("  {} reused", percent(share, 0)))
}

/// A share in per cent; 100 % only if it is exactly 1.
pub fn percent(share: f64, digits: usize) -> String {
    let unit = 10f64.powi(digits as i32);
    format!("{:.digits$} %", (share * 100.0 * unit).floor() / unit)
}

fn left(elapsed: Duration, finished: u32, remaining: u32) -> Duration {
    elapsed.mul_f64(f64::from(remaining) / f64::from(finished.max(1)))
}

/// Seconds in words: `0.41 s`, `5 s`, `3 min 20 s`, `2 h 5 min`.
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::RayKind;

    #[test]
    fn a_line_says_frame_seconds_rays_and_time_left() {
        let rays = RayCounts::of(RayKind::Camera, 4_920_000);
        let report = FrameReport {
            frame: 9,
            trace_seconds: 0.4,
            write_seconds: 0.01,
            bytes: 1,
            rays,
            samples: None,
            reuse: Default::default(),
            audit: None,
            bad: Default::default(),
        };
        assert_eq!(
            line(&report, 3, 16, left(Duration::from_secs(2), 2, 13)),
            "frame 3 of 16  0.41 s  12.3 Mrays/s  left 13 s"
        );
        let (direct, direct_inferred) = (1000, 999);
        let reuse = crate::stats::ReuseCounts { direct, direct_inferred, ..report.reuse };
        let shown = line(&FrameReport { reuse, ..report }, 3, 16, Duration::ZERO);
        assert!(shown.contains("Mrays/s  99 % reused  left"), "{shown}");
        assert_eq!((percent(0.9996, 1), percent(1.0, 1)), ("99.9 %".into(), "100.0 %".into()));
        assert_eq!(duration(200.0), "3 min 20 s");
        assert_eq!(duration(7500.0), "2 h 5 min");
    }
}
