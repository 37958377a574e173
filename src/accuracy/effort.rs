//! How much a probe or a check looks at.

/// How much a probe or a check looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Frames that errors are estimated from.
    pub frames: u32,
    /// Pixels of each of these frames.
    pub pixels: u32,
    /// Pixels, at least, of the pictures that contrast is measured on.
    pub picture: f64,
    /// Pixels of the small frames that are timed.
    pub small: f64,
}

/// Camera samples that a probe of [`Effort::WHOLE`] takes as long as, in a picture of one sample a pixel:
/// measured on our scenes.
const PROBE_WORK: f64 = 9e6;
/// Pixels of all frames of a job from which on a probe is [`Effort::WHOLE`].
const LARGE_JOB: f64 = 1e7;
/// Pixels that a check looks at, of those of the job. Each takes four times the samples of the job's, and
/// pixels traced one by one take longer.
const CHECKED: f64 = 0.01;

impl Effort {
    /// The most that is looked at.
    pub const WHOLE: Self = Self { frames: 16, pixels: 800, picture: 100_000.0, small: 7_000.0 };
    /// Less than this says nothing.
    const LEAST: Self = Self { frames: 8, pixels: 200, picture: 10_000.0, small: 2_000.0 };

    /// What a probe can look at in about `seconds`, where tracing takes `each` seconds a camera sample.
    pub fn within(seconds: f64, each: f64) -> Self {
        Self::WHOLE.part(seconds / (PROBE_WORK * each.max(1e-12)))
    }

    /// What a probe looks at in a job of `frames` frames of `pixels` pixels: a small part of the job.
    pub fn of_job(frames: u32, pixels: u64) -> Self {
        Self::WHOLE.part(f64::from(frames) * pixels as f64 / LARGE_JOB).of_frames(frames)
    }

    /// What a check looks at in a job of `frames` frames of `pixels` pixels.
    pub fn of_check(frames: u32, pixels: u64) -> Self {
        let whole = f64::from(Self::WHOLE.frames) * f64::from(Self::WHOLE.pixels);
        Self::WHOLE.part(CHECKED * f64::from(frames) * pixels as f64 / whole).of_frames(frames)
    }

    /// The same number of pixels in `frames` frames, if these are fewer; of each frame at most as many as in
    /// [`Self::WHOLE`].
    pub fn of_frames(self, frames: u32) -> Self {
        let all = self.frames * self.pixels;
        let pixels = (all / frames.clamp(1, self.frames)).min(Self::WHOLE.pixels);
        Self { pixels: pixels.max(self.pixels), ..self }
    }

    /// About `share` of the work, at least [`Self::LEAST`].
    fn part(self, share: f64) -> Self {
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

    #[test]
    fn less_time_or_a_smaller_job_is_less_work_down_to_what_still_says_something() {
        let work = |e: Effort| f64::from(e.frames) * (f64::from(e.pixels) + e.picture) + e.small;
        let mut last = [f64::INFINITY; 3];
        for seconds in [100.0, 9.0, 3.0, 1.0, 0.3, 0.0] {
            let pixels = (1e6 * seconds) as u64;
            let all = [
                Effort::within(seconds, 1e-6),
                Effort::of_job(99, pixels),
                Effort::of_check(99, pixels),
            ];
            let now = all.map(work);
            assert!(now.iter().zip(last).all(|(now, last)| *now <= last), "{all:?}");
            last = now;
        }
        assert_eq!(Effort::within(9.0, 1e-6), Effort::WHOLE);
        assert_eq!(Effort::within(0.0, 1e-6), Effort::LEAST);
        assert_eq!(Effort::LEAST.of_frames(100), Effort::LEAST);
        assert_eq!(
            (Effort::LEAST.of_frames(2).pixels, Effort::LEAST.of_frames(1).pixels),
            (800, 800)
        );
        // A fourth of the time: half the frames, half their pixels.
        let part = Effort::within(2.25, 1e-6);
        assert_eq!((part.frames, part.pixels, part.small), (8, 400, 2000.0));
    }
}
