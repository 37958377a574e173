//! What frames take under each reuse policy, from whole small frames.

use super::fit::fit;
use super::predictor::ReuseMode;
use super::probe::SettingsProbe;
use crate::error::Result;
use crate::scene::{Policy, ReuseSettings};

/// The least time of a shadow or sky sample, as a share of that of a camera sample.
const LEAST: f64 = 0.03;

/// Seconds that something took. Settings are compared by CPU time, which other programs on the machine
/// change less; the ratio to wall time is taken from many settings together.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Times {
    pub wall: f64,
    pub cpu: f64,
}

impl Times {
    /// Wall seconds per second of CPU.
    pub fn pace(self) -> f64 {
        self.wall / f64::max(self.cpu, 1e-9)
    }
}

impl SettingsProbe<'_> {
    /// The reuse policies to choose from, with what frames take by each: fitted to the times of frames of
    /// about `pixels` pixels with `bounces`.
    pub(super) fn modes(&self, bounces: u32, pixels: f64) -> Result<Vec<ReuseMode>> {
        let sources = self.sources();
        let mut turned = vec![(1, 1, 1), (6, 1, 1), (2, 4, 4)];
        turned.extend(sources.shadow.then_some((2, 8, 1)));
        turned.extend(sources.sky.then_some((2, 1, 8)));
        let mut modes = Vec::new();
        for reuse in self.kinds_of_reuse() {
            let (mut rows, mut measured) = (Vec::new(), Vec::new());
            let mut spent = Times::default();
            for &(spp, shadow, sky) in &turned {
                let mut settings = self.context.base.clone();
                (settings.spp, settings.shadow_samples, settings.sky_samples) = (spp, shadow, sky);
                (settings.bounces, settings.reuse) = (bounces, reuse);
                let by = |is_there, count: u32| if is_there { f64::from(spp * count) } else { 0.0 };
                let (shadow, sky) = (by(sources.shadow, shadow), by(sources.sky, sky));
                rows.push([1.0, f64::from(spp), shadow, sky]);
                let small = self.small(&settings, pixels)?;
                measured.push(small.cpu);
                spent = Times { wall: spent.wall + small.wall, cpu: spent.cpu + small.cpu };
            }
            let [each, by_spp, by_shadow, by_sky] = fit(&rows, &measured);
            // Such a sample is never free, whatever the noise says.
            let least = |is_there, by: f64| if is_there { by.max(LEAST * by_spp) } else { 0.0 };
            let (by_shadow, by_sky) =
                (least(sources.shadow, by_shadow), least(sources.sky, by_sky));
            let larger = self.enlargement(pixels);
            let seconds = [each, larger * by_spp, larger * by_shadow, larger * by_sky];
            modes.push(ReuseMode { reuse, seconds: seconds.map(|cpu| cpu * spent.pace()) });
        }
        Ok(modes)
    }

    fn kinds_of_reuse(&self) -> Vec<ReuseSettings> {
        let base = self.context.base.reuse;
        if self.given.policy {
            return vec![base];
        }
        let surface = ReuseSettings { policy: Policy::Surface, ..base };
        vec![surface, ReuseSettings { policy: Policy::Off, ..base }]
    }
}
