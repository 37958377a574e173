//! A time that a job is to take, and what is left of it for rendering.

use super::{Choice, Chooser};
use crate::accuracy::{Check, Effort, Predictor, Samples};
use crate::film::Film;
use crate::math::Rgb;
use crate::output::{WriteOptions, write_image};
use crate::page::words::seconds;
use crate::sampling::mix;
use crate::scene::Settings;
use std::time::Instant;

/// Shares of what is left when the probe begins: for the probe's sweep, and for the check at most.
const PROBE_SHARE: f64 = 0.15;
const CHECK_SHARE: f64 = 0.07;
/// Kept back of what is left for rendering: times predicted are off by some per cent either way.
const RESERVE: f64 = 0.05;
/// What a video takes: to start its program, and by the pixel; measured.
const VIDEO: [f64; 2] = [0.2, 4e-8];

/// A budget, counted from the start of the program.
pub(super) struct Budget {
    started: Instant,
    seconds: f64,
    /// Seconds kept back for the check at most.
    check: f64,
    /// Frames, and pixels of each: what there is for a check to look at.
    there_is: (u32, u64),
    /// Seconds for the video.
    video: f64,
    /// Seconds that a rank takes to write its frames.
    pub writing: f64,
}

impl Budget {
    /// The budget asked for, if any.
    pub fn of(chooser: &Chooser) -> Option<Self> {
        let (started, seconds) = (chooser.started, chooser.args.budget?.as_secs_f64());
        let (request, settings) = (chooser.request, chooser.context.base);
        let count = request.frames.last - request.frames.first + 1;
        let there_is = (count, u64::from(settings.width) * u64::from(settings.height));
        let (frames, pixels) = (f64::from(count), there_is.1 as f64);
        let [start, each] = VIDEO;
        let is_video = request.fps.is_some() && frames > 1.0;
        let check = CHECK_SHARE * (seconds - started.elapsed().as_secs_f64()).max(0.0);
        let ending = request.pattern.path(request.frames.first);
        let ending = ending.extension().and_then(|e| e.to_str()).unwrap_or("png").to_string();
        Some(Self {
            started,
            seconds,
            check,
            there_is,
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

    /// Seconds that are left, as of now, for tracing frames of `samples`.
    pub fn left(&self, predictor: &Predictor, samples: Samples) -> f64 {
        let check = self.kept_back(predictor, samples);
        let left = self.seconds - self.gone() - check - self.video - self.writing;
        (1.0 - RESERVE) * left.max(0.0)
    }

    /// Seconds for the check of frames of `samples`; none where their share is too little for any.
    fn kept_back(&self, predictor: &Predictor, samples: Samples) -> f64 {
        let all = |effort: Effort| self.check_seconds(effort, predictor, samples);
        self.effort_in(self.check, predictor, samples).map_or(0.0, all)
    }

    fn check_seconds(&self, effort: Effort, predictor: &Predictor, samples: Samples) -> f64 {
        let (frames, pixels) = self.there_is;
        Check::seconds(predictor, samples) * effort.looked_at(frames, pixels)
    }

    fn effort_in(&self, time: f64, predictor: &Predictor, samples: Samples) -> Option<Effort> {
        let (frames, pixels) = self.there_is;
        Effort::of_check(time, Check::seconds(predictor, samples), frames, pixels)
    }

    /// What there is time for now to look at; else the seconds that the least check would take.
    pub fn effort(&self, predictor: &Predictor, samples: Samples) -> Result<Effort, f64> {
        let left = self.seconds - self.gone() - self.video;
        let least = || self.check_seconds(Effort::LEAST, predictor, samples);
        self.effort_in(left, predictor, samples).ok_or_else(least)
    }
}

impl Chooser<'_> {
    /// Warns where frames that are not there yet, under what was chosen for fewer frames or more time,
    /// are predicted to take longer than there is.
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

/// Wall seconds that writing a frame takes, in the temporary folder; 0 where it cannot be tried: the
/// job itself will say why.
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
