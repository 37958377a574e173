//! How much a probe or a check looks at: a part of it where little time is left.

/// How much is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Frames that errors are estimated from.
    pub frames: u32,
    /// Pixels of each.
    pub pixels: u32,
    /// Least pixels of the pictures that contrast is measured on.
    pub picture: f64,
    /// Pixels of the small frames that are timed.
    pub small: f64,
}

/// What a whole probe takes, camera samples of a picture of one sample a pixel: measured on our scenes.
const PROBE_WORK: f64 = 9e6;

/// Steps in which a check's work is made less.
const STEPS: u32 = 64;

impl Effort {
    /// What a probe does that has time.
    pub const WHOLE: Self = Self { frames: 16, pixels: 800, picture: 100_000.0, small: 7_000.0 };
    /// Less than this says nothing.
    pub const LEAST: Self = Self { frames: 8, pixels: 100, picture: 10_000.0, small: 1_200.0 };

    /// What a probe can do in about `seconds`, where tracing takes `each` seconds a camera sample.
    pub fn within(seconds: f64, each: f64) -> Self {
        Self::WHOLE.part(seconds / (PROBE_WORK * each.max(1e-12)))
    }

    /// The same where there are only so many frames: with as many pixels in all, if that is no more of each
    /// than a whole probe looks at.
    pub fn of_frames(self, frames: u32) -> Self {
        let all = self.frames * self.pixels;
        let pixels = (all / frames.clamp(1, self.frames)).min(Self::WHOLE.pixels);
        Self { pixels: pixels.max(self.pixels), ..self }
    }

    /// The most that a check can look at in `seconds`, in a job of `frames` frames of `pixels` pixels,
    /// where a whole check of a long one of large frames takes `whole` seconds; `None` where even the
    /// least that says something takes longer.
    pub fn of_check(seconds: f64, whole: f64, frames: u32, pixels: u64) -> Option<Self> {
        let mut steps =
            (0..=STEPS).rev().map(|k| Self::WHOLE.part(f64::from(k) / f64::from(STEPS)));
        steps.find(|effort| whole * effort.looked_at(frames, pixels) <= seconds)
    }

    /// What a check of this looks at in a job of `frames` frames of `pixels` pixels, a share of what a
    /// whole check does in a long one of large frames.
    pub fn looked_at(self, frames: u32, pixels: u64) -> f64 {
        let count = |effort: Self, frames: u32, pixels: u64| {
            let each = u64::from(effort.checked_pixels()).min(pixels);
            f64::from(effort.frames.min(frames)) * each as f64
        };
        count(self, frames, pixels) / count(Self::WHOLE, u32::MAX, u64::MAX)
    }

    /// Pixels that a check looks at in each frame: more than the probe, since it does so once.
    pub fn checked_pixels(self) -> u32 {
        self.pixels + self.pixels / 2
    }

    /// About `share` of the work.
    pub fn part(self, share: f64) -> Self {
        let (share, least) = (share.clamp(0.0, 1.0), Self::LEAST);
        let count = |all: u32, least: u32| {
            ((f64::from(all) * share.sqrt()).round() as u32).max(least.min(all))
        };
        Self {
            frames: count(self.frames, least.frames),
            pixels: count(self.pixels, least.pixels),
            picture: (self.picture * share.sqrt()).max(least.picture),
            small: (self.small * share).max(least.small),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A job of few small frames has less to look at.
    #[test]
    fn a_check_looks_at_what_there_is_and_at_no_more_than_there_is_time_for() {
        let large = 640 * 360;
        assert_eq!(Effort::of_check(2.0, 2.0, 16, large), Some(Effort::WHOLE));
        let least = Effort::of_check(0.13, 2.0, 16, large).expect("time for the least");
        assert_eq!((least.frames, least.pixels), (8, 100));
        // Eight frames of 150 pixels of sixteen of 1200.
        let least = 8.0 * 150.0 / (16.0 * 1200.0);
        assert_eq!(Effort::LEAST.looked_at(100, large), least);
        assert_eq!(Effort::of_check(1.9 * least, 2.0, 16, large), None);
        assert_eq!(Effort::WHOLE.looked_at(3, 256), 3.0 * 256.0 / (16.0 * 1200.0));
        assert_eq!(Effort::of_check(0.081, 2.0, 3, 256), Some(Effort::WHOLE));
        // Three frames of 150 pixels.
        assert!(Effort::of_check(0.048, 2.0, 3, 256).is_some());
        assert_eq!(Effort::of_check(0.046, 2.0, 3, 256), None);
        let mut last = f64::INFINITY;
        for seconds in [3.0, 1.0, 0.5, 0.2, 0.13] {
            let effort = Effort::of_check(seconds, 2.0, 16, large).expect("time for some");
            let share = effort.looked_at(16, large);
            assert!(2.0 * share <= seconds && share <= last, "{effort:?}");
            last = share;
        }
    }

    #[test]
    fn less_time_is_less_work_down_to_what_still_says_something() {
        let work = |e: Effort| f64::from(e.frames) * (f64::from(e.pixels) + e.picture) + e.small;
        let mut last = f64::INFINITY;
        for seconds in [100.0, 9.0, 3.0, 1.0, 0.3, 0.0] {
            let effort = Effort::within(seconds, 1e-6);
            assert!(work(effort) <= last, "{effort:?}");
            last = work(effort);
        }
        assert_eq!(Effort::within(9.0, 1e-6), Effort::WHOLE);
        assert_eq!(Effort::within(0.0, 1e-6), Effort::LEAST);
        assert_eq!(Effort::within(1.0, 0.0), Effort::WHOLE);
        assert_eq!(Effort::LEAST.of_frames(100), Effort::LEAST);
        assert_eq!(Effort::LEAST.of_frames(2).pixels, 400);
        assert_eq!(Effort::LEAST.of_frames(1).pixels, 800);
        assert_eq!(Effort::WHOLE.of_frames(1), Effort::WHOLE);
        // A fourth of the time: half the frames, half their pixels.
        let part = Effort::within(2.25, 1e-6);
        assert_eq!((part.frames, part.pixels, part.small), (8, 400, 1750.0));
    }
}
