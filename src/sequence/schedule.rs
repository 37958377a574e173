//! Which frames a job needs, what each is made of, and how long each is held for others.
//!
//! Frames with bit for bit the same camera are one frame, their *original*: the first of them in the
//! order in which a job of all frames needs them. That order puts a frame after all that it is
//! inferred from, so no frame is ever inferred from itself, however often a camera comes back; and a
//! longer shot only adds to its end.

use super::pyramid::Pyramid;
use crate::error::Result;
use crate::scene::{Camera, Policy, Settings, Shot};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// What the frames of a shot are made of.
#[derive(Debug, Clone)]
pub struct Schedule {
    pyramid: Pyramid,
    /// Frames that are not their own original, with it.
    copies: BTreeMap<u32, u32>,
}

impl Schedule {
    /// Which frames of `shot` the makers infer from which; `keeps_light`: some light is worth a lookup.
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
            let original = *first.entry(bits(&shot.camera(frame, 1, 1)?)).or_insert(frame);
            if original != frame {
                copies.insert(frame, original);
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

    /// The frame that `frame` is: itself unless another has its camera.
    pub fn original(&self, frame: u32) -> u32 {
        self.copies.get(&frame).copied().unwrap_or(frame)
    }

    /// The originals that an original is inferred from: the segment's ends first.
    pub fn ancestors(&self, original: u32) -> Vec<u32> {
        let mut ancestors = Vec::new();
        for other in self.pyramid.ancestors(original) {
            let other = self.original(other);
            if !ancestors.contains(&other) {
                ancestors.push(other);
            }
        }
        ancestors
    }

    /// How many frames are traced whole: key frames that are their own originals.
    pub fn key_frames(&self) -> u32 {
        let copies = self.copies.keys().filter(|frame| self.pyramid.is_key(**frame)).count();
        self.pyramid.keys() - copies as u32
    }

    /// How many frames are not their own originals.
    pub fn copies(&self) -> u32 {
        self.copies.len() as u32
    }

    /// The most references that a job over `frames` holds at a time: key frames, and others.
    pub fn most_held(&self, frames: &[u32]) -> (usize, usize) {
        let mut pool = ReferencePool::default();
        let mut most = (0, 0);
        let ordered = self.pyramid.order(frames);
        pool.expect(self, &ordered);
        for frame in ordered {
            let mut wanted = vec![self.original(frame)];
            while let Some(next) = wanted.pop() {
                let missing = self.ancestors(next).into_iter().find(|f| !pool.holds(*f));
                match missing {
                    Some(missing) => wanted.extend([next, missing]),
                    None => pool.keep(self, next, || ()),
                }
                let keys = pool.held.keys().filter(|f| self.pyramid.is_key(**f)).count();
                most = (most.0.max(keys), most.1.max(pool.held.len() - keys));
            }
            pool.done(self, self.original(frame));
        }
        most
    }
}

/// What tells cameras of a shot apart.
pub(super) fn bits(camera: &Camera) -> [u64; 12] {
    let vectors = [camera.eye, camera.forward, camera.half_right, camera.half_up];
    let mut bits = [0; 12];
    let numbers = vectors.iter().flat_map(|v| v.to_array());
    bits.iter_mut().zip(numbers).for_each(|(bits, x)| *bits = x.to_bits());
    bits
}

/// References, each held as long as a frame to come is inferred from it.
#[derive(Debug)]
pub(super) struct ReferencePool<T> {
    /// By original: how often it is still asked for.
    asked: BTreeMap<u32, u32>,
    /// By original: how many frames to come are inferred from it.
    uses: BTreeMap<u32, u32>,
    /// References that are used, but not made yet.
    due: BTreeSet<u32>,
    held: BTreeMap<u32, T>,
}

impl<T> Default for ReferencePool<T> {
    fn default() -> Self {
        let (asked, uses, held) = Default::default();
        Self { asked, uses, due: BTreeSet::new(), held }
    }
}

impl<T> ReferencePool<T> {
    /// `frames` will be asked for.
    pub fn expect(&mut self, schedule: &Schedule, frames: &[u32]) {
        for frame in frames {
            let original = schedule.original(*frame);
            *self.asked.entry(original).or_default() += 1;
            self.lean(schedule, original);
        }
    }

    /// `user` will be made from its ancestors, and these, where they are not at hand, from theirs.
    fn lean(&mut self, schedule: &Schedule, user: u32) {
        let mut users = vec![user];
        while let Some(user) = users.pop() {
            for other in schedule.ancestors(user) {
                *self.uses.entry(other).or_default() += 1;
                if !self.held.contains_key(&other) && self.due.insert(other) {
                    users.push(other);
                }
            }
        }
    }

    /// Keeps the reference of `original`, which other frames than the schedule's need, until it is released.
    pub fn hold(&mut self, schedule: &Schedule, original: u32) {
        *self.uses.entry(original).or_default() += 1;
        if !self.held.contains_key(&original) && self.due.insert(original) {
            self.lean(schedule, original);
        }
    }

    /// Takes in and holds a reference that was made elsewhere.
    pub fn take(&mut self, original: u32, reference: T) {
        *self.uses.entry(original).or_default() += 1;
        self.held.entry(original).or_insert(reference);
    }

    /// Nobody wants what was held.
    pub fn release(&mut self, schedule: &Schedule, original: u32) {
        self.drop_use(schedule, original);
    }

    /// How often an original is still asked for.
    pub fn asked(&self, original: u32) -> u32 {
        self.asked.get(&original).copied().unwrap_or(0)
    }

    /// The reference, if it is made.
    pub fn get(&self, original: u32) -> Option<&T> {
        self.held.get(&original)
    }

    /// Whether a reference is used that is not made yet.
    pub fn is_due(&self, original: u32) -> bool {
        self.due.contains(&original)
    }

    fn holds(&self, original: u32) -> bool {
        self.held.contains_key(&original)
    }

    /// An original was made: its reference is held where it is due.
    pub fn keep(&mut self, schedule: &Schedule, original: u32, make: impl FnOnce() -> T) {
        if self.due.remove(&original) {
            self.held.insert(original, make());
            self.release_ancestors(schedule, original);
        }
    }

    /// An original was handed out as a frame.
    pub fn done(&mut self, schedule: &Schedule, original: u32) {
        if let Some(asked) = self.asked.get_mut(&original) {
            *asked -= 1;
            if *asked == 0 {
                self.asked.remove(&original);
            }
            self.release_ancestors(schedule, original);
        }
    }

    /// What `original` was inferred from has one user less.
    fn release_ancestors(&mut self, schedule: &Schedule, original: u32) {
        for other in schedule.ancestors(original) {
            self.drop_use(schedule, other);
        }
    }

    fn drop_use(&mut self, schedule: &Schedule, original: u32) {
        let Some(uses) = self.uses.get_mut(&original) else { return };
        *uses -= 1;
        if *uses == 0 {
            self.uses.remove(&original);
            self.held.remove(&original);
            if self.due.remove(&original) {
                // All that would be made of it came from elsewhere, so it never was.
                self.release_ancestors(schedule, original);
            }
        }
    }

    /// All that is held.
    pub fn held(&self) -> impl Iterator<Item = &T> {
        self.held.values()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::{CameraPath, Easing, KeyPose, Pose};

    fn shot(frames: u32, path: CameraPath) -> Shot {
        Shot { path, easing: Easing::Linear, frames, vfov_degrees: 40.0 }
    }

    fn pose(x: f64) -> Pose {
        Pose { eye: DVec3::new(x, 1.0, 9.0), target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 }
    }

    fn schedule(segment: u32, shot: &Shot) -> Schedule {
        let pyramid = Pyramid { segment, frames: shot.frames };
        Schedule::new(pyramid, shot).expect("good cameras")
    }

    /// There and back again, with a rest at either end.
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
        assert!(frames.iter().all(|f| still.original(*f) == 1));
        assert_eq!(still.most_held(&frames), (0, 0));
    }

    #[test]
    fn originals_are_made_of_originals_that_come_before_them() {
        for (segment, frames) in [(8, 9), (8, 33), (5, 40), (64, 41), (1, 7)] {
            let shot = returning(frames);
            let schedule = schedule(segment, &shot);
            let camera = |f| bits(&shot.camera(f, 1, 1).expect("a camera"));
            let order = schedule.pyramid.by_need();
            let place = |f| order.iter().position(|other| *other == f);
            for frame in 1..=frames {
                let original = schedule.original(frame);
                assert_eq!(camera(frame), camera(original));
                assert_eq!(schedule.original(original), original);
                for other in schedule.ancestors(original) {
                    assert_eq!(schedule.original(other), other);
                    assert!(place(other) < place(original), "{segment} {frames}: {frame}");
                }
            }
            let copies = (1..=frames).filter(|f| schedule.original(*f) != *f).count();
            assert!(copies > 0 || frames < 8, "{segment} {frames}");
        }
    }

    #[test]
    fn references_are_few_and_none_is_left() {
        let pan = CameraPath::Pan {
            from: DVec3::new(-6.0, 4.0, 9.0),
            to: DVec3::new(6.0, 4.0, 9.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            roll_degrees: 0.0,
        };
        let schedule = schedule(64, &shot(1000, pan));
        let all: Vec<u32> = (1..=1000).collect();
        let (keys, others) = schedule.most_held(&all);
        assert!(keys <= 3 && (5..=6).contains(&others), "{keys} {others}");
        assert_eq!(schedule.most_held(&[2]), (2, 5));
        assert_eq!(schedule.most_held(&[1]), (0, 0));
        let mut pool = ReferencePool::default();
        pool.expect(&schedule, &[3, 4]);
        for frame in [1, 65, 33, 17, 9, 5, 3] {
            pool.keep(&schedule, frame, || ());
        }
        pool.done(&schedule, 3);
        assert!(pool.holds(3) && pool.holds(1));
        pool.done(&schedule, 4);
        assert_eq!(pool.held().count(), 0);
        assert!(pool.uses.is_empty() && pool.due.is_empty() && pool.asked.is_empty());
    }

    #[test]
    fn what_is_held_for_others_stays_until_it_is_let_go() {
        let pan = returning(9);
        let schedule = schedule(4, &pan);
        let frame = (1..=9).find(|f| !schedule.ancestors(*f).is_empty()).expect("an in-between");
        let mut pool = ReferencePool::default();
        for other in schedule.ancestors(frame) {
            pool.take(other, ());
        }
        pool.hold(&schedule, frame);
        assert!(pool.is_due(frame));
        pool.keep(&schedule, frame, || ());
        pool.expect(&schedule, &[frame]);
        pool.done(&schedule, frame);
        assert!(pool.holds(frame) && schedule.ancestors(frame).iter().all(|f| pool.holds(*f)));
        for other in schedule.ancestors(frame).into_iter().chain([frame]) {
            pool.release(&schedule, other);
        }
        assert_eq!(pool.held().count(), 0);
        assert!(pool.uses.is_empty() && pool.due.is_empty());
    }
}
