//! Adaptive camera samples beside uniform ones.

#![allow(dead_code, missing_docs, reason = "the tests and the bench each use their part")]

use super::moves::{Set, psnr_of};
use tweenray::scene::Settings;

pub fn uniform(settings: &Settings, spp: u32, seed: u64) -> Settings {
    Settings { spp, most_spp: None, seed, ..settings.clone() }
}

/// PSNR of an adaptive reference with the range that `tweenray accuracy` uses and the scene file's light samples, that of
/// one with half as many as its most samples in every pixel, and the adaptive one's mean samples.
pub fn references(scene: &str, size: (u32, u32), most: u32) -> ([f64; 2], f64) {
    let set = Set::load(scene, |_| ());
    let (stage, shot) = (set.stage(2), set.shot(16));
    let base = Settings { width: size.0, height: size.1, ..set.settings.clone() };
    let traced = |settings: &Settings| stage.traced(settings, &shot, 8, 8);
    let truth = traced(&uniform(&base, 8 * most, 77));
    let range = Settings { spp: most / 8, most_spp: Some(most), seed: 5, ..base.clone() };
    let adaptive = traced(&range);
    let same = traced(&uniform(&base, most / 2, 5));
    (
        [&adaptive, &same].map(|film| psnr_of(&base, film, &truth)),
        adaptive.mean_samples().expect("samples"),
    )
}
