//! Reuse through a lens: samples of a pixel out of focus end far from one another.

use super::{fence, still};
use crate::common;
use crate::moves::{self, Set};
use crate::suite::{Outcome, Size};
use tweenray::scene::{Focus, LensKey, ReuseSettings, Settings, ShotLens, ThinLensPath};

/// Edge of a tile, pixels.
const TILE: usize = 16;
/// What nobody sees, display steps: RMSE of a tile.
const UNSEEN: f64 = 0.25;

/// The lens that opens to `share` of its focus, which lies on the target.
pub fn lens(set: &mut Set, share: f64) {
    let pose = set.shot.pose(1).unwrap();
    let key =
        LensKey { at: 0.0, radius: share * pose.eye.distance(pose.target), focus: Focus::Target };
    let path = ThinLensPath { keys: vec![key], blades: 0, blade_rotation_degrees: 0.0 };
    set.shot.lens = ShotLens::Thin(path);
}

/// Frames through a lens: the same bytes in each where the camera stands; tile by tile no further from the truth
/// than traced ones where it moves; no stale pixels behind pickets.
pub fn defocus(size: Size) -> Outcome {
    let mut outcome = still::standing(size, |set| lens(set, 0.02));
    for (scene, share) in [("cornell", 0.1), ("reflective_spheres", 0.06), ("demo", 0.05)] {
        outcome.merge(moving(size, scene, share));
    }
    outcome.merge(fence::behind_pickets(size, fence::WIDE, |set| lens(set, 0.01)));
    outcome
}

/// Frames in between of a move through `scene`, with a lens that opens to `share` of its focus.
fn moving(size: Size, scene: &str, share: f64) -> Outcome {
    let mut outcome = Outcome::default();
    let mut set = Set::load(scene, |_| ());
    lens(&mut set, share);
    let stage = set.stage(common::threads());
    let shot = set.shot(9);
    let reuse = ReuseSettings { segment: 64, ..ReuseSettings::default() };
    let settings = Settings { reuse, ..set.settings(size.of((64, 48), (192, 128)), 4, 16) };
    let made = stage.frames(&settings, &shot, &(1..=9).collect::<Vec<_>>());
    let width = settings.width as usize;
    for frame in size.of(&[5][..], &[2, 5, 8]) {
        let counts = &made[*frame as usize - 1].reuse;
        // Else the lens was no trial: points in focus, of which reuse has its share, beside others.
        outcome.check(counts.direct > 0 && counts.specular > counts.direct / 10, || {
            format!("{scene}, frame {frame}: {counts:?}")
        });
        let truth = stage.converged(&settings, &shot, *frame, 256);
        let traced = stage.traced(&settings, &shot, *frame, *frame);
        let errors = |film| tile_errors(&settings, film, &truth, width);
        let inferred = errors(&made[*frame as usize - 1].film);
        let pairs = inferred.iter().zip(errors(&traced));
        // By chance a tile of so few pixels is a little worse; nine tenths of them must not be.
        let worse = pairs.clone().filter(|(a, b)| **a > UNSEEN.max(1.1 * b)).count();
        let far = pairs.filter(|(a, b)| **a > 2.0 * UNSEEN.max(1.5 * b)).count();
        outcome.count(inferred.len() as u64, far as u64);
        let share = worse as f64 / inferred.len() as f64;
        outcome.at_most(&format!("{scene}, frame {frame}: share of tiles worse"), share, 0.1);
    }
    outcome
}

/// RMSE of each tile, display steps.
fn tile_errors(
    settings: &Settings,
    film: &tweenray::film::Film,
    truth: &tweenray::film::Film,
    width: usize,
) -> Vec<f64> {
    let pairs = moves::codes(settings, film).into_iter().zip(moves::codes(settings, truth));
    let across = width.div_ceil(TILE);
    let mut sums = vec![(0.0, 0u32); across * film.rgb.len().div_ceil(width).div_ceil(TILE)];
    for (i, (a, b)) in pairs.enumerate() {
        let sum = &mut sums[i / width / TILE * across + i % width / TILE];
        sum.0 += (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
        sum.1 += 3;
    }
    sums.into_iter().map(|(sum, count)| 255.0 * (sum / f64::from(count)).sqrt()).collect()
}
