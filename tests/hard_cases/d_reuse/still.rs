//! What must not drift: a camera that stands, an edge that is inferred a hundred frames long.

use crate::common;
use crate::moves::Set;
use crate::sharpness::{self, Edge};
use crate::suite::{Outcome, Size};
use tweenray::scene::{CameraPath, ReuseSettings, Settings};

/// Ten frames of a camera that stands still: the same bytes in each.
pub fn identity_path(size: Size) -> Outcome {
    standing(size, |_| ())
}

/// The same after a `change`.
pub fn standing(size: Size, change: impl FnOnce(&mut Set)) -> Outcome {
    let mut outcome = Outcome::default();
    let mut set = Set::load("cornell", |_| ());
    let pose = set.shot.pose(1).unwrap();
    set.shot = set.shot(10);
    set.shot.path = CameraPath::Still(pose);
    change(&mut set);
    let stage = set.stage(common::threads());
    let settings = set.settings(size.of((48, 48), (480, 480)), 1, 16);
    let made = stage.frames(&settings, &set.shot, &(1..=10).collect::<Vec<_>>());
    let traced = stage.traced(&settings, &set.shot, 1, 1);
    for (k, made) in made.iter().enumerate() {
        outcome.check(made.film.rgb == traced.rgb, || format!("frame {} differs", k + 1));
    }
    outcome
}

/// Frames of the slow pan.
const FRAMES: u32 = 100;

/// A slanted shadow edge through a hundred frames, all inferred but the ends: as sharp as it is.
pub fn no_accumulated_blur(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let set = sharpness::shadow_edge(FRAMES, 20.0);
    let stage = set.stage(common::threads());
    let reuse = ReuseSettings { segment: FRAMES, ..ReuseSettings::default() };
    let settings = Settings { reuse, ..set.settings(size.of((96, 72), (320, 240)), 4, 16) };
    let all: Vec<u32> = (1..=FRAMES).collect();
    let made = stage.frames(&settings, &set.shot, &all);
    let (mut ratios, mut inferred, mut points) = (Vec::new(), 0, 0);
    for frame in (2..FRAMES).step_by(size.of(12, 4)) {
        let film = &made[frame as usize - 1].film;
        let truth = stage.converged(&settings, &set.shot, frame, 512);
        let edge: Edge = sharpness::edge_of(&truth);
        ratios.push(sharpness::mtf50(film, edge) / sharpness::mtf50(&truth, edge));
        let counts = &made[frame as usize - 1].reuse;
        (inferred, points) = (inferred + counts.direct_inferred, points + counts.direct);
        if frame == 2 {
            outcome.show(format!("MTF50 {:.3} cycles a pixel", sharpness::mtf50(&truth, edge)));
        }
    }
    outcome.count(ratios.len() as u64, 0);
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let spread = ratios.iter().map(|r| (r - 1.0).abs()).fold(0.0, f64::max);
    outcome.show(format!("MTF50 over the true one: mean {mean:.4}, furthest {spread:.4} from 1"));
    // Sharper than true would be as wrong.
    outcome.at_most("MTF50 off by", (mean - 1.0).abs(), 0.02);
    outcome.at_least("share inferred", inferred as f64 / points as f64, 0.8);
    outcome
}
