//! The recipe of a frame: all that its bytes depend on besides world and settings.
//!
//! A recipe has the number and camera of the frame, and the numbers and cameras of all frames that it is
//! inferred from, directly or through other frames. A longer shot changes few recipes, so the other
//! finished frames can be kept.

use super::schedule::Schedule;
use crate::error::Result;
use crate::scene::{Camera, Settings, Shot};
use rayon::prelude::*;
use std::fmt;

/// A short BLAKE3; its `Display` is hexadecimal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tag([u8; 16]);

/// Hashes of all that a frame's bytes depend on, besides world and settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Recipe {
    /// Hash of number and camera, and of the camera before where the frame's file holds motion.
    pub view: Tag,
    /// Hash of the view and of the numbers and cameras of all frames that it is inferred from.
    pub whole: Tag,
}

/// The recipes of a shot's frames.
#[derive(Debug, Clone, Default)]
pub struct Recipes(Vec<Recipe>);

impl Recipes {
    /// The recipes of all frames of `shot` under `settings`. `keeps_light` says whether some light is worth a lookup,
    /// `with_motion` whether files hold the motion since the frame before.
    ///
    /// Errors: as [`Shot::camera`].
    pub fn new(
        shot: &Shot,
        settings: &Settings,
        keeps_light: bool,
        with_motion: bool,
    ) -> Result<Self> {
        let camera = |frame| shot.camera(frame, settings.width, settings.height);
        let cameras = (1..=shot.frames).into_par_iter().map(camera).collect::<Result<Vec<_>>>()?;
        let schedule = Schedule::of_shot(shot, settings, keeps_light)?;
        let sources = sources(&schedule, &cameras);
        let recipe = |frame: u32| {
            let at = frame as usize - 1;
            let before = cameras[..at].last().filter(|_| with_motion);
            let own = number_and_camera(frame, &cameras[at]);
            let view = Tag::of([own, before.map_or(Tag::default(), |c| number_and_camera(0, c))]);
            let whole = Tag::of([view, sources[schedule.representative(frame) as usize - 1]]);
            Recipe { view, whole }
        };
        Ok(Self((1..=shot.frames).into_par_iter().map(recipe).collect()))
    }

    /// The recipe of `frame`, if the shot has it.
    pub fn get(&self, frame: u32) -> Option<&Recipe> {
        self.0.get(frame.checked_sub(1)? as usize)
    }
}

/// For each representative, by frame, the hash of all that its traced points depend on.
fn sources(schedule: &Schedule, cameras: &[Camera]) -> Vec<Tag> {
    let mut tags = vec![Tag::default(); cameras.len()];
    for frame in schedule.by_need() {
        let at = frame as usize - 1;
        let own = std::iter::once(number_and_camera(frame, &cameras[at]));
        let others = schedule.ancestors(frame).into_iter().map(|f| tags[f as usize - 1]);
        tags[at] = Tag::of(own.chain(others));
    }
    tags
}

fn number_and_camera(frame: u32, camera: &Camera) -> Tag {
    let mut hash = blake3::Hasher::new();
    hash.update(&frame.to_le_bytes());
    hash.update(&camera.encode());
    Tag::first_half(&hash)
}

impl Tag {
    fn of(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut hash = blake3::Hasher::new();
        parts.into_iter().for_each(|part| _ = hash.update(&part.0));
        Self::first_half(&hash)
    }

    fn first_half(hash: &blake3::Hasher) -> Self {
        let mut half = [0; 16];
        hash.finalize_xof().fill(&mut half);
        Self(half)
    }
}

impl fmt::Display for Tag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{CameraPath, KeyPose, Policy, Pose, ReuseSettings};

    /// A move with one key pose per frame, as other programs export it.
    fn shot(frames: u32) -> Shot {
        let key = |i: u32| {
            let eye = DVec3::new(0.3 * f64::from(i), 2.0, 9.0);
            let pose = Pose { eye, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
            KeyPose { at: f64::from(i) / f64::from(frames - 1), pose }
        };
        let path = CameraPath::Keys((0..frames).map(key).collect());
        Shot::new(path, frames, 40.0)
    }

    fn settings(policy: Policy) -> Settings {
        Settings {
            reuse: ReuseSettings { policy, segment: 8, ..Default::default() },
            ..Settings::default()
        }
    }

    fn recipes(frames: u32, policy: Policy) -> Recipes {
        Recipes::new(&shot(frames), &settings(policy), true, true).expect("good cameras")
    }

    fn same(a: &Recipes, b: &Recipes, part: fn(&Recipe) -> Tag) -> Vec<u32> {
        let both = |f: &u32| a.get(*f).map(part) == b.get(*f).map(part);
        (1..=20).filter(both).collect()
    }

    #[test]
    fn a_longer_shot_changes_the_recipes_of_its_last_segment_alone() {
        let (short, long) = (recipes(20, Policy::Surface), recipes(31, Policy::Surface));
        assert_eq!(same(&short, &long, |r| r.view), (1..=20).collect::<Vec<_>>());
        assert_eq!(same(&short, &long, |r| r.whole), (1..=17).collect::<Vec<_>>());
        let (short, long) = (recipes(20, Policy::Off), recipes(31, Policy::Off));
        assert_eq!(same(&short, &long, |r| r.whole), (1..=20).collect::<Vec<_>>());
        let (short, long) = (recipes(20, Policy::Colour), recipes(31, Policy::Colour));
        assert_eq!(same(&short, &long, |r| r.whole), [1]);
    }

    #[test]
    fn a_key_frame_that_moves_changes_all_that_is_inferred_from_it() {
        let mut moved = shot(20);
        let CameraPath::Keys(keys) = &mut moved.path else { panic!("keys") };
        keys[8].pose.eye.y += 1e-9;
        let moved =
            Recipes::new(&moved, &settings(Policy::Surface), true, false).expect("good cameras");
        let plain = Recipes::new(&shot(20), &settings(Policy::Surface), true, false);
        let plain = plain.expect("good cameras");
        let others: Vec<u32> = (1..=20).filter(|f| *f != 9).collect();
        assert_eq!(same(&plain, &moved, |r| r.view), others);
        assert_eq!(same(&plain, &moved, |r| r.whole), [1, 17, 18, 19, 20]);
        assert_eq!(plain.get(0), None);
        assert_eq!(plain.get(21), None);
    }

    #[test]
    fn recipes_include_motion_if_files_hold_it() {
        let with = recipes(20, Policy::Off);
        let without = Recipes::new(&shot(20), &settings(Policy::Off), true, false);
        assert_eq!(same(&with, &without.expect("good cameras"), |r| r.view), [1]);
    }
}
