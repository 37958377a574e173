//! The truth that candidates are held against: traced frames, with twice the samples until they no
//! longer change.

use super::errors::{Frames, rms_between};
use super::stage::Stage;
use crate::error::Result;
use crate::scene::limits::MAX_SEED;
use crate::scene::{Policy, Settings};

/// The converged frames.
pub struct Truth {
    /// As displayed.
    pub frames: Frames,
    /// By how much the last doubling of the samples changed them: root mean square, display steps.
    /// More than the error that is left.
    pub change: f64,
    /// What the change was to fall below, display steps.
    pub wanted: f64,
    /// The settings of the last doubling.
    pub settings: Settings,
}

/// Camera samples to begin with.
const FIRST: u32 = 32;

/// The settings of the truth but for its camera samples: everything traced. More bounces and a lower
/// cut-off than any candidate has; as many shadow samples as the candidate with the most, since the
/// bias of their ratio falls with these alone (`docs/accuracy.md`).
pub fn truth_settings(base: &Settings, candidates: &[&Settings]) -> Settings {
    let most = |of: fn(&Settings) -> u32, least: u32| {
        candidates.iter().map(|s| of(s)).max().unwrap_or(0).max(of(base)).max(least)
    };
    let cutoff = candidates.iter().map(|s| s.cutoff).fold(base.cutoff, f32::min);
    let mut settings = base.clone();
    settings.spp = most(|s| s.spp, FIRST);
    settings.shadow_samples = most(|s| s.shadow_samples, 16);
    settings.sky_samples = most(|s| s.sky_samples, 16);
    settings.bounces = most(|s| s.bounces, 16);
    settings.cutoff = cutoff.min(1e-5);
    settings.reuse.policy = Policy::Off;
    settings.reuse.audit = 0.0;
    settings
}

/// The seed of a doubling: half of all seeds away from the candidates', which are the base's and the
/// next few.
fn seed_of_doubling(base: u64, doubling: u32) -> u64 {
    (base + MAX_SEED / 2 + 1 + u64::from(doubling)) % (MAX_SEED + 1)
}

/// The seed of a turn of any candidate.
pub fn seed_of_turn(base: u64, turn: u32) -> u64 {
    (base + u64::from(turn)) % (MAX_SEED + 1)
}

/// Renders `frames` with twice as many camera samples each time, until a doubling changes them by less
/// than `wanted` display steps, or more than `most` samples would be needed. Each time all samples are
/// new: a doubling that only added to the ones before would seem to change less. Their mean is no
/// better: many samples that were laid out together are worth more than as many that were not.
/// `heard` hears of every doubling: samples, and by how much it changed the frames.
///
/// # Errors
/// Those of [`Stage::trace`].
pub fn converge(
    stage: &Stage,
    mut settings: Settings,
    frames: &[u32],
    wanted: f64,
    most: u32,
    heard: &dyn Fn(u32, Option<f64>),
) -> Result<Truth> {
    let mut last: Option<Frames> = None;
    let mut doubling = 0;
    loop {
        settings.seed = seed_of_doubling(stage.base.seed, doubling);
        let mut now = Frames::new();
        for frame in frames {
            let (image, _) = stage.trace(&settings, stage.intersector, *frame)?;
            now.insert(*frame, image);
        }
        let change = last.as_ref().map(|last| rms_between(&now, last));
        heard(settings.spp, change);
        let is_done = change.is_some_and(|change| change <= wanted);
        if is_done || settings.spp.saturating_mul(2) > most {
            let change = change.unwrap_or(f64::INFINITY);
            return Ok(Truth { frames: now, change, wanted, settings });
        }
        settings.spp *= 2;
        doubling += 1;
        last = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_of_the_truth_are_no_candidates() {
        for base in [0, 7, 1 << 40, MAX_SEED / 2, MAX_SEED] {
            let candidates: Vec<u64> = (0..100).map(|turn| seed_of_turn(base, turn)).collect();
            for doubling in 0..64 {
                let seed = seed_of_doubling(base, doubling);
                assert!(seed <= MAX_SEED && !candidates.contains(&seed), "{base} {doubling}");
            }
        }
    }
}
