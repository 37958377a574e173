//! What each way to take over light costs, from whole small frames.

use super::fit::fit;
use super::predictor::Mode;
use super::probe::Probe;
use crate::error::Result;
use crate::scene::{Policy, ReuseSettings};

/// The least that a shadow or sky sample takes, of what a camera sample does.
const LEAST: f64 = 0.03;

/// Seconds. Settings are compared by those of CPU, which others on the machine change less; how these
/// pass on the clock is told by many together.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Spent {
    pub wall: f64,
    pub cpu: f64,
}

impl Spent {
    /// Wall seconds per second of CPU.
    pub fn pace(self) -> f64 {
        self.wall / f64::max(self.cpu, 1e-9)
    }
}

impl Probe<'_> {
    /// All that may be chosen, with `bounces`, told from frames of about `pixels` pixels.
    pub(super) fn modes(&self, bounces: u32, pixels: f64) -> Result<Vec<Mode>> {
        let causes = self.causes();
        let mut turned = vec![(1, 1, 1), (6, 1, 1), (2, 4, 4)];
        turned.extend(causes.shadow.then_some((2, 8, 1)));
        turned.extend(causes.sky.then_some((2, 1, 8)));
        let mut modes = Vec::new();
        for reuse in self.kinds_of_reuse() {
            let (mut rows, mut measured) = (Vec::new(), Vec::new());
            let mut spent = Spent::default();
            for &(spp, shadow, sky) in &turned {
                let mut settings = self.stage.base.clone();
                (settings.spp, settings.shadow_samples, settings.sky_samples) = (spp, shadow, sky);
                (settings.bounces, settings.reuse) = (bounces, reuse);
                let by = |is_there, count: u32| if is_there { f64::from(spp * count) } else { 0.0 };
                let (shadow, sky) = (by(causes.shadow, shadow), by(causes.sky, sky));
                rows.push([1.0, f64::from(spp), shadow, sky]);
                let small = self.small(&settings, pixels)?;
                measured.push(small.cpu);
                spent = Spent { wall: spent.wall + small.wall, cpu: spent.cpu + small.cpu };
            }
            let [each, by_spp, by_shadow, by_sky] = fit(&rows, &measured).0;
            // Such a sample is never free, whatever the noise says.
            let least = |is_there, by: f64| if is_there { by.max(LEAST * by_spp) } else { 0.0 };
            let (by_shadow, by_sky) = (least(causes.shadow, by_shadow), least(causes.sky, by_sky));
            let larger = self.enlargement(pixels);
            let seconds = [each, larger * by_spp, larger * by_shadow, larger * by_sky];
            modes.push(Mode { reuse, seconds: seconds.map(|cpu| cpu * spent.pace()) });
        }
        Ok(modes)
    }

    /// Pixels of a frame over those of one of about `pixels`.
    fn enlargement(&self, pixels: f64) -> f64 {
        let (width, height) = self.small_size(pixels);
        let base = self.stage.base;
        f64::from(base.width) * f64::from(base.height) / (f64::from(width) * f64::from(height))
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
