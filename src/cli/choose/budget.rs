//! A budget: the time that a job is to take, and how much of it is left for rendering.

use super::{Choice, Chooser};
use crate::film::Film;
use crate::math::Rgb;
use crate::output::{WriteOptions, write_image};
use crate::page::words::seconds;
use crate::sampling::mix;
use crate::scene::Settings;
use std::time::Instant;

/// Share of the time left when the probe begins that its sweep takes.
const PROBE_SHARE: f64 = 0.15;
/// Share of the time left for rendering that is kept back for the check and for errors of predicted times.
const RESERVE: f64 = 0.1;
/// Seconds of a video: to start its program, and for each pixel; measured.
const VIDEO: [f64; 2] = [0.2, 4e-8];

/// A budget, counted from the start of the program.
pub(super) struct Budget {
    started: Instant,
    seconds: f64,
    /// Seconds for the video.
    video: f64,
    /// Seconds that a rank takes to write its frames.
    pub writing: f64,
}

impl Budget {
    /// The job's budget; `None` where there is none.
    pub fn of(chooser: &Chooser) -> Option<Self> {
        let (started, seconds) = (chooser.started, chooser.args.budget?.as_secs_f64());
        let (request, settings) = (chooser.request, chooser.context.base);
        let frames = f64::from(request.frames.last - request.frames.first + 1);
        let pixels = f64::from(settings.width) * f64::from(settings.height);
        let [start, each] = VIDEO;
        let is_video = request.options.video && frames > 1.0;
        let ending = request.pattern.path(request.frames.first);
        let ending = ending.extension().and_then(|e| e.to_str()).unwrap_or("png").to_string();
        Some(Self {
            started,
            seconds,
            video: if is_video { start + each * pixels * frames } else { 0.0 },
            writing: (frames / f64::from(chooser.ranks)).ceil() * writing(settings, &ending),
        })
    }

    fn gone(&self) -> f64 {
        self.started.elapsed().as_secs_f64()
    }

    /// Seconds for the probe's sweep.
    pub fn probe_seconds(&self) -> f64 {
        PROBE_SHARE * (self.seconds - self.gone()).max(0.0)
    }

    /// Seconds that are left, as of now, for tracing frames.
    pub fn left(&self) -> f64 {
        let left = self.seconds - self.gone() - self.video - self.writing;
        (1.0 - RESERVE) * left.max(0.0)
    }
}

impl Chooser<'_> {
    /// Warns where the frames still to be rendered are predicted to take longer than the budget leaves: `before`
    /// may have been chosen for fewer frames.
    pub(super) fn warn_if_long(&self, before: &Choice) {
        let Some(budget) = Budget::of(self) else { return };
        let (first, last) = (self.request.frames.first, self.request.frames.last);
        let left = (first..=last).filter(|n| !self.request.pattern.path(*n).exists()).count();
        let share = left as f64 / f64::from(last - first + 1);
        let predicted = &before.predicted;
        let rendering = predicted.seconds * self.probe().frames_each(predicted.reuse);
        let all = budget.gone() + share * (rendering + budget.writing) + budget.video;
        if left > 0 && all > budget.seconds {
            let [all, asked] = [all, budget.seconds].map(seconds);
            let frames = if left == 1 { "1 frame is" } else { &format!("{left} frames are") };
            self.warn(format!(
                "{frames} left and the job is predicted to take {all}, not {asked}; --overwrite \
                 chooses anew"
            ));
        }
    }
}

/// Wall seconds to write a frame in the temporary folder; 0 where that fails: the job itself will say why.
fn writing(settings: &Settings, ending: &str) -> f64 {
    let Ok(folder) = tempfile::tempdir() else { return 0.0 };
    let mut film = Film::new(settings.width, settings.height, false);
    // Smooth with some noise, as frames are.
    for (i, rgb) in (0_u32..).zip(&mut film.rgb) {
        let noise = (mix(u64::from(i)) % 64) as f32;
        *rgb = Rgb::splat((((i % settings.width) as f32) + noise) / (settings.width as f32 + 64.0));
    }
    let begun = Instant::now();
    let path = folder.path().join("frame").with_extension(ending);
    match write_image(path, &film, &WriteOptions::of(settings, None)) {
        Ok(_) => begun.elapsed().as_secs_f64(),
        Err(_) => 0.0,
    }
}
