//! Which frames a job needs, and which frames each is inferred from.
//!
//! Of frames whose cameras are equal bit for bit only one is rendered, their *representative*; the
//! others are copies of it. The representative is the first of them in the order in which a job of
//! all frames needs them. That order puts a frame after all that it is inferred from, so no frame is
//! inferred from itself, even where the camera returns to an earlier pose. A longer shot only adds
//! frames to the end of the order.

use super::pyramid::Pyramid;
use crate::error::Result;
use crate::scene::{Policy, Settings, Shot};
use std::collections::{BTreeMap, HashMap};

/// Which frames of a shot are inferred from which, and which are copies.
#[derive(Debug, Clone)]
pub struct Schedule {
    pub(super) pyramid: Pyramid,
    /// Copies, each with its representative.
    copies: BTreeMap<u32, u32>,
}

impl Schedule {
    /// The schedule of `shot` for the maker of its policy; `keeps_light` says whether some light is worth a lookup.
    ///
    /// Errors: as [`Shot::camera`].
    pub fn of_shot(shot: &Shot, settings: &Settings, keeps_light: bool) -> Result<Self> {
        let frames = shot.frames;
        let segment = settings.reuse.segment;
        match settings.reuse.policy {
            Policy::Surface if keeps_light => Self::new(Pyramid { segment, frames }, shot),
            Policy::Surface => Self::new(Pyramid { segment: 1, frames }, shot),
            Policy::Colour => Ok(Self::without_copies(Pyramid::whole(frames))),
            Policy::Off => Ok(Self::without_copies(Pyramid { segment: 1, frames })),
        }
    }

    /// The schedule of `shot`, cut as `pyramid` says.
    ///
    /// Errors: those of the shot's cameras.
    pub fn new(pyramid: Pyramid, shot: &Shot) -> Result<Self> {
        let mut first = HashMap::new();
        let mut copies = BTreeMap::new();
        for frame in pyramid.by_need() {
            let representative = *first.entry(shot.camera(frame, 1, 1)?.encode()).or_insert(frame);
            if representative != frame {
                copies.insert(frame, representative);
            }
        }
        Ok(Self { pyramid, copies })
    }

    /// The schedule where no frame is a copy of another, cut as `pyramid` says.
    pub fn without_copies(pyramid: Pyramid) -> Self {
        Self { pyramid, copies: BTreeMap::new() }
    }

    /// All frames, each after those that it is inferred from.
    pub fn by_need(&self) -> Vec<u32> {
        self.pyramid.by_need()
    }

    /// The frame of which `frame` is a copy, or `frame` itself.
    pub fn representative(&self, frame: u32) -> u32 {
        self.copies.get(&frame).copied().unwrap_or(frame)
    }

    /// The representatives that a representative is inferred from, the segment's ends first.
    pub fn ancestors(&self, representative: u32) -> Vec<u32> {
        let mut ancestors = Vec::new();
        for other in self.pyramid.ancestors(representative) {
            let other = self.representative(other);
            if !ancestors.contains(&other) {
                ancestors.push(other);
            }
        }
        ancestors
    }

    /// How many frames are traced whole: key frames that are no copies.
    pub fn key_frames(&self) -> u32 {
        let copies = self.copies.keys().filter(|frame| self.pyramid.is_key(**frame)).count();
        self.pyramid.keys() - copies as u32
    }

    /// How many frames are copies.
    pub fn copies(&self) -> u32 {
        self.copies.len() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{CameraPath, KeyPose, Pose};

    fn shot(frames: u32, path: CameraPath) -> Shot {
        Shot::new(path, frames, 40.0)
    }

    fn pose(x: f64) -> Pose {
        Pose { eye: DVec3::new(x, 1.0, 9.0), target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 }
    }

    fn schedule(segment: u32, shot: &Shot) -> Schedule {
        let pyramid = Pyramid { segment, frames: shot.frames };
        Schedule::new(pyramid, shot).expect("good cameras")
    }

    /// A move to another pose and back, with a rest at either end.
    fn returning(frames: u32) -> Shot {
        let key = |at, x| KeyPose { at, pose: pose(x) };
        let keys =
            vec![key(0.0, 0.0), key(0.25, 0.0), key(0.5, 2.0), key(0.75, 2.0), key(1.0, 0.0)];
        shot(frames, CameraPath::Keys(keys))
    }

    #[test]
    fn a_still_shot_of_a_hundred_thousand_frames_is_one_frame() {
        let still = schedule(64, &shot(100_000, CameraPath::Still(pose(0.0))));
        let frames: Vec<u32> = (1..=100_000).collect();
        assert!(frames.iter().all(|f| still.representative(*f) == 1));
        assert_eq!(still.most_held(&frames), (0, 0));
    }

    #[test]
    fn representatives_are_inferred_from_representatives_that_come_before_them() {
        for (segment, frames) in [(8, 9), (8, 33), (5, 40), (64, 41), (1, 7)] {
            let shot = returning(frames);
            let schedule = schedule(segment, &shot);
            let camera = |f| shot.camera(f, 1, 1).expect("a camera").encode();
            let order = schedule.pyramid.by_need();
            let place = |f| order.iter().position(|other| *other == f);
            for frame in 1..=frames {
                let representative = schedule.representative(frame);
                assert_eq!(camera(frame), camera(representative));
                assert_eq!(schedule.representative(representative), representative);
                for other in schedule.ancestors(representative) {
                    assert_eq!(schedule.representative(other), other);
                    assert!(place(other) < place(representative), "{segment} {frames}: {frame}");
                }
            }
            let copies = (1..=frames).filter(|f| schedule.representative(*f) != *f).count();
            assert!(copies > 0 || frames < 8, "{segment} {frames}");
        }
    }
}
