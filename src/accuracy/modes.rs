//! What each way to take over light costs and what it does to errors, from whole small frames.

use super::fit::fit;
use super::foretell::Mode;
use super::probe::Probe;
use crate::error::Result;
use crate::scene::{Policy, ReuseSettings, Settings};

impl Probe<'_> {
    /// All that may be chosen, with `bounces`.
    pub(super) fn modes(&self, bounces: u32) -> Result<Vec<Mode>> {
        let mut modes = Vec::new();
        for reuse in self.kinds_of_reuse() {
            let turned = |(spp, shadow, sky): (u32, u32, u32)| {
                let mut settings = self.stage.base.clone();
                (settings.spp, settings.shadow_samples, settings.sky_samples) = (spp, shadow, sky);
                (settings.bounces, settings.reuse) = (bounces, reuse);
                settings
            };
            let kept = match reuse.policy {
                Policy::Off => [1.0, 0.0],
                _ => self.kept(&turned)?,
            };
            modes.push(Mode { reuse, seconds: self.seconds(&turned)?, kept });
        }
        Ok(modes)
    }

    fn kinds_of_reuse(&self) -> Vec<ReuseSettings> {
        let base = self.stage.base.reuse;
        if self.given.policy && base.policy == Policy::Off {
            return vec![base];
        }
        let mut kinds = vec![ReuseSettings { policy: Policy::Surface, ..base }];
        if !self.given.tolerance {
            kinds.push(ReuseSettings { tolerance: 4.0 * base.tolerance, ..kinds[0] });
        }
        if !self.given.policy {
            kinds.push(ReuseSettings { policy: Policy::Off, ..base });
        }
        kinds
    }

    fn seconds(&self, turned: &dyn Fn((u32, u32, u32)) -> Settings) -> Result<[f64; 4]> {
        let (mut rows, mut measured) = (Vec::new(), Vec::new());
        for samples in [(1, 1, 1), (6, 1, 1), (2, 4, 4), (2, 12, 1), (2, 1, 12)] {
            let (n, m, k) = (f64::from(samples.0), f64::from(samples.1), f64::from(samples.2));
            rows.push([1.0, n, n * m, n * k]);
            measured.push(self.small_trial(&turned(samples))?.seconds);
        }
        let [each, by_spp, by_shadow, by_sky] = fit(&rows, &measured).0;
        let larger = self.enlargement();
        Ok([each, larger * by_spp, larger * by_shadow, larger * by_sky])
    }

    /// See [`Mode::kept`]: audits of few samples and of many.
    fn kept(&self, turned: &dyn Fn((u32, u32, u32)) -> Settings) -> Result<[f64; 2]> {
        let (mut rows, mut measured) = (Vec::new(), Vec::new());
        for samples in [(4, 1, 1), (4, 4, 4), (4, 16, 16)] {
            let mut settings = turned(samples);
            settings.reuse.audit = 0.3;
            let sums = self.small_trial(&settings)?.audit;
            if sums.drawn > 0 && sums.traced.sum > 0.0 {
                let pixels = sums.pixels.max(1) as f64;
                rows.push([sums.traced.sum / pixels, 1.0]);
                measured.push((sums.shown.sum / pixels).max(1e-6));
            }
        }
        Ok(if rows.is_empty() { [1.0, 0.0] } else { fit(&rows, &measured).0 })
    }
}
