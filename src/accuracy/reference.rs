//! The truth that candidates are held against: traced frames, averaged until they no longer change.

use super::errors::{Frames, displayed, rms_between};
use super::stage::Stage;
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::film::Film;
use crate::math::Rgb;
use crate::scene::limits::MAX_SEED;
use crate::scene::{Policy, Settings};
use crate::shade::{Progress, Renderer};
use crate::stats::RayCounts;
use std::collections::BTreeMap;

/// The converged frames.
pub struct Truth {
    /// As displayed.
    pub frames: Frames,
    /// Passes that were averaged.
    pub passes: u32,
    /// By how much the last doubling changed them: root mean square, display steps. Nearly the error
    /// that is left.
    pub change: f64,
    /// What the change was to fall below, display steps.
    pub wanted: f64,
    /// The settings of a pass.
    pub settings: Settings,
}

/// The settings of a pass: everything traced, with many samples. More bounces and a lower cut-off
/// than any candidate has; as many shadow samples as the bias of their ratio calls for
/// (`docs/accuracy.md`).
pub fn pass_settings(base: &Settings, candidates: &[&Settings]) -> Settings {
    let most = |of: fn(&Settings) -> u32, least: u32| {
        candidates.iter().map(|s| of(s)).max().unwrap_or(0).max(of(base)).max(least)
    };
    let cutoff = candidates.iter().map(|s| s.cutoff).fold(base.cutoff, f32::min);
    let mut settings = base.clone();
    settings.spp = 4;
    settings.shadow_samples = most(|s| s.shadow_samples, 64);
    settings.sky_samples = most(|s| s.sky_samples, 64);
    settings.bounces = most(|s| s.bounces, 16);
    settings.cutoff = cutoff.min(1e-5);
    settings.reuse.policy = Policy::Off;
    settings.reuse.audit = 0.0;
    settings
}

/// The seed of a pass: half of all seeds away from the candidates', which are the base's and the next
/// few.
fn seed_of_pass(base: u64, pass: u32) -> u64 {
    (base + MAX_SEED / 2 + 1 + u64::from(pass)) % (MAX_SEED + 1)
}

/// The seed of a turn of any candidate.
pub fn seed_of_turn(base: u64, turn: u32) -> u64 {
    (base + u64::from(turn)) % (MAX_SEED + 1)
}

/// Averages passes over `frames`, twice as many each time, until a doubling changes less than
/// `wanted` display steps, or `most` passes are made. `heard` hears of every doubling: passes, and by
/// how much it changed the frames.
///
/// # Errors
/// [`Error::Stopped`]; those of cameras.
pub fn converge(
    stage: &Stage,
    settings: Settings,
    frames: &[u32],
    wanted: f64,
    most: u32,
    heard: &dyn Fn(u32, Option<f64>),
) -> Result<Truth> {
    let mut sums: BTreeMap<u32, Sum> = BTreeMap::new();
    let mut passes = 0;
    let mut last: Option<Frames> = None;
    let mut change = f64::INFINITY;
    loop {
        let goal = (2 * passes).max(1);
        for pass in passes..goal {
            for frame in frames {
                let film = trace(stage, &settings, *frame, pass)?;
                sums.entry(*frame).or_insert_with(|| Sum::new(&film)).add(&film);
            }
        }
        passes = goal;
        let mean = |(frame, sum): (&u32, &Sum)| (*frame, sum.displayed(passes, &settings));
        let now: Frames = stage.pool.install(|| sums.iter().map(mean).collect());
        if let Some(last) = &last {
            change = rms_between(&now, last);
        }
        heard(passes, last.as_ref().map(|_| change));
        if change <= wanted || 2 * passes > most {
            return Ok(Truth { frames: now, passes, change, wanted, settings });
        }
        last = Some(now);
    }
}

/// Light added up over passes, f64.
struct Sum {
    rgb: Vec<[f64; 3]>,
    film: Film,
}

impl Sum {
    fn new(film: &Film) -> Self {
        let film = Film::new(film.width, film.height, false);
        Self { rgb: vec![[0.0; 3]; film.rgb.len()], film }
    }

    fn add(&mut self, film: &Film) {
        for (sum, c) in self.rgb.iter_mut().zip(&film.rgb) {
            for (sum, x) in sum.iter_mut().zip(c.to_array()) {
                *sum += f64::from(x);
            }
        }
    }

    fn displayed(&self, passes: u32, settings: &Settings) -> crate::film::Image {
        let mean = |sum: &[f64; 3]| Rgb::from_array(sum.map(|x| (x / f64::from(passes)) as f32));
        let rgb: Vec<Rgb> = self.rgb.iter().map(mean).collect();
        displayed(&rgb, &self.film, settings)
    }
}

struct Unheard;

impl Progress for Unheard {
    fn tile_done(&self, _: f64, _: &RayCounts) {}
}

fn trace(stage: &Stage, settings: &Settings, frame: u32, pass: u32) -> Result<Film> {
    let seed = seed_of_pass(stage.base.seed, pass);
    let settings = Settings { seed, ..settings.clone() };
    let plan = EffectPlan::of(stage.scene, &settings);
    let intersector = stage.intersector;
    let renderer = Renderer { scene: stage.scene, settings: &settings, plan, intersector };
    let camera = stage.shot.camera(frame, settings.width, settings.height)?;
    let render = || renderer.render(&camera, frame, false, stage.stop, &Unheard);
    stage.pool.install(render).map(|(film, _)| film).ok_or(Error::Stopped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_of_passes_are_no_candidates() {
        for base in [0, 7, 1 << 40, MAX_SEED / 2, MAX_SEED] {
            let candidates: Vec<u64> = (0..100).map(|turn| seed_of_turn(base, turn)).collect();
            for pass in 0..4096 {
                let seed = seed_of_pass(base, pass);
                assert!(seed <= MAX_SEED && !candidates.contains(&seed), "{base} {pass}");
            }
        }
    }
}
