//! How much a probe or a check looks at: a part of it where little time is left.

/// How much is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Frames that errors are told from.
    pub frames: u32,
    /// Pixels of each.
    pub pixels: u32,
    /// Pixels of the pictures that contrast is told from, or more.
    pub picture: f64,
    /// Pixels of the small frames that are timed.
    pub small: f64,
}

/// What a whole probe takes, camera samples of a picture of one sample a pixel: measured on our scenes.
const PROBE: f64 = 9e6;

impl Effort {
    /// What a probe does that has time.
    pub const WHOLE: Self = Self { frames: 16, pixels: 800, picture: 100_000.0, small: 7_000.0 };
    /// Less than this says nothing.
    const LEAST: Self = Self { frames: 3, pixels: 200, picture: 10_000.0, small: 1_200.0 };

    /// What a probe can do in about `seconds`, where tracing takes `each` seconds a camera sample.
    pub fn within(seconds: f64, each: f64) -> Self {
        Self::WHOLE.part(seconds / (PROBE * each.max(1e-12)))
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
        // A fourth of the time: half the frames, half their pixels.
        let part = Effort::within(2.25, 1e-6);
        assert_eq!((part.frames, part.pixels, part.small), (8, 400, 1750.0));
    }
}
