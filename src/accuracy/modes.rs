//! What each way to take over light costs, from whole small frames.

use super::fit::fit;
use super::foretell::Mode;
use super::probe::{Probe, SMALL};
use crate::error::Result;
use crate::scene::{Policy, ReuseSettings, Settings};

/// A trial shorter than this, seconds, is repeated: the shortest counts.
const SHORT: f64 = 0.1;

impl Probe<'_> {
    /// All that may be chosen, with `bounces`.
    pub(super) fn modes(&self, bounces: u32) -> Result<Vec<Mode>> {
        let mut modes = Vec::new();
        for reuse in self.kinds_of_reuse() {
            let (mut rows, mut measured) = (Vec::new(), Vec::new());
            for (spp, shadow, sky) in [(1, 1, 1), (6, 1, 1), (2, 4, 4), (2, 8, 1), (2, 1, 8)] {
                let mut settings = self.stage.base.clone();
                (settings.spp, settings.shadow_samples, settings.sky_samples) = (spp, shadow, sky);
                (settings.bounces, settings.reuse) = (bounces, reuse);
                let (n, m, k) = (f64::from(spp), f64::from(shadow), f64::from(sky));
                rows.push([1.0, n, n * m, n * k]);
                measured.push(self.small_seconds(&settings, SMALL)?);
            }
            let [each, by_spp, by_shadow, by_sky] = fit(&rows, &measured).0;
            let larger = self.enlargement();
            modes.push(Mode {
                reuse,
                seconds: [each, larger * by_spp, larger * by_shadow, larger * by_sky],
            });
        }
        Ok(modes)
    }

    /// Seconds of a frame with about `pixels` pixels.
    pub(super) fn small_seconds(&self, settings: &Settings, pixels: f64) -> Result<f64> {
        let mut shortest = f64::INFINITY;
        for _ in 0..3 {
            let trial = self.small_trial(settings, pixels)?;
            shortest = shortest.min(trial.seconds);
            if trial.seconds > SHORT {
                break;
            }
        }
        Ok(shortest)
    }

    fn kinds_of_reuse(&self) -> Vec<ReuseSettings> {
        let base = self.stage.base.reuse;
        if self.given.policy {
            return vec![base];
        }
        let surface = ReuseSettings { policy: Policy::Surface, ..base };
        vec![surface, ReuseSettings { policy: Policy::Off, ..base }]
    }
}
