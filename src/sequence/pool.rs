//! The references of a running job: each in memory as long as a frame to come is inferred from it, and until
//! then what of it waits to be written to disk or sent to other ranks.
//!
//! References of earlier jobs (`--reference`) are not here but in [`ReferenceCache`](super::ReferenceCache):
//! no frame of this job makes them, and room decides which of them stay.

use super::SaveCost;
use super::checkpoint::Checkpoints;
use super::schedule::Schedule;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longest time for which a job that shall stop goes on writing references.
const LONGEST_SAVE_AT_STOP: Duration = Duration::from_secs(5);

/// References `T` by original, which reach the disk as the bytes of an `S`.
#[derive(Debug)]
pub(super) struct ReferencePool<T, S = Arc<[u8]>> {
    /// By original: how often it is still asked for as a frame.
    asked: BTreeMap<u32, u32>,
    /// By original: how many frames to come are inferred from it, or other ranks hold it.
    uses: BTreeMap<u32, u32>,
    /// Originals in use whose reference is not made yet.
    due: BTreeSet<u32>,
    held: BTreeMap<u32, Held<T, S>>,
    /// Originals whose reference lies on disk.
    on_disk: BTreeSet<u32>,
    /// When references were last written, or the job began.
    last_save: Instant,
    pub save_cost: SaveCost,
    /// The most memory that references took at a time, bytes.
    pub most_memory: u64,
}

/// A reference in memory.
#[derive(Debug)]
struct Held<T, S> {
    reference: T,
    /// What is to be written to disk, until it is.
    unsaved: Option<S>,
    /// The bytes for other ranks, until they are fetched.
    export: Option<Arc<[u8]>>,
}

impl<T, S> Default for ReferencePool<T, S> {
    fn default() -> Self {
        Self {
            asked: BTreeMap::new(),
            uses: BTreeMap::new(),
            due: BTreeSet::new(),
            held: BTreeMap::new(),
            on_disk: BTreeSet::new(),
            last_save: Instant::now(),
            save_cost: SaveCost::default(),
            most_memory: 0,
        }
    }
}

impl<T, S> ReferencePool<T, S> {
    /// Announces that `frames` will be asked for.
    pub fn expect(&mut self, schedule: &Schedule, frames: &[u32]) {
        for frame in frames {
            let original = schedule.original(*frame);
            *self.asked.entry(original).or_default() += 1;
            self.use_ancestors(schedule, original);
        }
    }

    /// Announces `frame` unless that was done already.
    pub fn expect_once(&mut self, schedule: &Schedule, frame: u32) {
        if self.asked(schedule.original(frame)) == 0 {
            self.expect(schedule, &[frame]);
        }
    }

    /// Counts a use of all ancestors of `user`, and of the ancestors of those that have to be made for it.
    fn use_ancestors(&mut self, schedule: &Schedule, user: u32) {
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

    /// Keeps the reference of `original`, which other ranks need, until [`release`](Self::release).
    pub fn hold(&mut self, schedule: &Schedule, original: u32) {
        *self.uses.entry(original).or_default() += 1;
        if !self.held.contains_key(&original) && self.due.insert(original) {
            self.use_ancestors(schedule, original);
        }
    }

    /// Takes in and holds a reference that another rank made.
    pub fn import(&mut self, original: u32, reference: T) {
        *self.uses.entry(original).or_default() += 1;
        self.held.entry(original).or_insert(Held { reference, unsaved: None, export: None });
    }

    /// Ends one use of `original`: the last one drops its reference.
    pub fn release(&mut self, schedule: &Schedule, original: u32) {
        let Some(uses) = self.uses.get_mut(&original) else { return };
        *uses -= 1;
        if *uses == 0 {
            self.uses.remove(&original);
            self.held.remove(&original);
            if self.due.remove(&original) {
                // All that would be made from it came from elsewhere, so it was never made.
                self.release_ancestors(schedule, original);
            }
        }
    }

    fn release_ancestors(&mut self, schedule: &Schedule, original: u32) {
        schedule.ancestors(original).into_iter().for_each(|other| self.release(schedule, other));
    }

    /// How often an original is still asked for as a frame.
    pub fn asked(&self, original: u32) -> u32 {
        self.asked.get(&original).copied().unwrap_or(0)
    }

    /// The reference of an original, if it is in memory.
    pub fn get(&self, original: u32) -> Option<&T> {
        self.held.get(&original).map(|held| &held.reference)
    }

    /// Whether a reference is in use that is not made yet.
    pub fn is_due(&self, original: u32) -> bool {
        self.due.contains(&original)
    }

    /// The originals whose references are in memory.
    pub fn held(&self) -> impl Iterator<Item = u32> {
        self.held.keys().copied()
    }

    /// Keeps the reference of an original that was just made or read, where it is due.
    pub fn keep(&mut self, schedule: &Schedule, original: u32, make: impl FnOnce() -> T) {
        if self.due.remove(&original) {
            let held = Held { reference: make(), unsaved: None, export: None };
            self.held.insert(original, held);
            self.release_ancestors(schedule, original);
        }
    }

    /// Notes that an original was handed out as a frame.
    pub fn done(&mut self, schedule: &Schedule, original: u32) {
        if let Some(asked) = self.asked.get_mut(&original) {
            *asked -= 1;
            if *asked == 0 {
                self.asked.remove(&original);
            }
            self.release_ancestors(schedule, original);
        }
    }

    /// Updates [`most_memory`](Self::most_memory); `size` gives the bytes of a reference, and of what is to be
    /// written of it.
    pub fn note_memory(&mut self, size: impl Fn(&T, Option<&S>) -> u64) {
        let held = self.held.values();
        let memory = held.map(|held| size(&held.reference, held.unsaved.as_ref())).sum();
        self.most_memory = self.most_memory.max(memory);
    }

    /// Keeps the bytes of a reference for other ranks.
    pub fn set_export(&mut self, original: u32, bytes: Arc<[u8]>) {
        self.held.entry(original).and_modify(|held| held.export = Some(bytes));
    }

    /// The bytes of a reference for other ranks, once.
    pub fn take_export(&mut self, original: u32) -> Option<Arc<[u8]>> {
        self.held.get_mut(&original)?.export.take()
    }

    /// Sets what is to be written of a reference; `None` where that lies in a file already.
    pub fn set_unsaved(&mut self, original: u32, unsaved: Option<S>) {
        self.held.entry(original).and_modify(|held| held.unsaved = unsaved);
    }

    /// Notes that a reference lies on disk.
    pub fn note_on_disk(&mut self, original: u32) {
        self.on_disk.insert(original);
    }

    /// All that is to be written, if the last time is `every` ago.
    fn take_unsaved(&mut self, now: Instant, every: Duration) -> Vec<(u32, S)> {
        if now.duration_since(self.last_save) < every {
            return Vec::new();
        }
        self.last_save = now;
        let held = self.held.iter_mut();
        held.filter_map(|(original, held)| Some((*original, held.unsaved.take()?))).collect()
    }

    /// The originals whose reference lies on disk although no frame to come needs it; once.
    fn take_expired(&mut self) -> Vec<u32> {
        let held = &self.held;
        let expired = self.on_disk.iter().copied().filter(|f| !held.contains_key(f));
        let expired: Vec<u32> = expired.collect();
        self.on_disk.retain(|f| held.contains_key(f));
        expired
    }
}

impl Schedule {
    /// The most references that a job over `frames` holds at a time: key frames, and others.
    pub fn most_held(&self, frames: &[u32]) -> (usize, usize) {
        let mut pool = ReferencePool::<()>::default();
        let mut most = (0, 0);
        let ordered = self.pyramid.order(frames);
        pool.expect(self, &ordered);
        for frame in ordered {
            let mut wanted = vec![self.original(frame)];
            while let Some(next) = wanted.pop() {
                let missing = self.ancestors(next).into_iter().find(|f| pool.get(*f).is_none());
                match missing {
                    Some(missing) => wanted.extend([next, missing]),
                    None => pool.keep(self, next, || ()),
                }
                let (keys, others): (Vec<u32>, Vec<u32>) =
                    pool.held().partition(|f| self.pyramid.is_key(*f));
                most = (most.0.max(keys.len()), most.1.max(others.len()));
            }
            pool.done(self, self.original(frame));
        }
        most
    }
}

/// A [`ReferencePool`] that several threads use.
pub(super) struct SharedPool<T, S = Arc<[u8]>>(Mutex<ReferencePool<T, S>>);

impl<T, S> Default for SharedPool<T, S> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T, S> SharedPool<T, S> {
    pub fn lock(&self) -> MutexGuard<'_, ReferencePool<T, S>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes unsaved references, as `encode` makes bytes of them, where that is due, all of them where the
    /// job shall stop, and removes from disk what no frame to come needs. Where one cannot be written the
    /// job goes on without: references on disk only save time after a kill.
    pub fn save(
        &self,
        checkpoints: Option<&Checkpoints>,
        is_stopping: bool,
        encode: impl Fn(&S) -> Option<Arc<[u8]>>,
    ) {
        let Some((checkpoints, every)) = checkpoints.and_then(|c| Some((c, c.every?))) else {
            return;
        };
        let start = Instant::now();
        let every = if is_stopping { Duration::ZERO } else { every };
        let unsaved = self.lock().take_unsaved(start, every);
        for (original, unsaved) in unsaved {
            if is_stopping && start.elapsed() > LONGEST_SAVE_AT_STOP {
                break;
            }
            let Some(bytes) = encode(&unsaved) else { continue };
            if let Err(why) = checkpoints.write(original, &bytes) {
                checkpoints.note_unwritten(&why);
                continue;
            }
            let mut pool = self.lock();
            pool.note_on_disk(original);
            pool.save_cost.bytes += bytes.len() as u64;
        }
        let expired = self.lock().take_expired();
        expired.into_iter().for_each(|original| checkpoints.remove(original));
        self.lock().save_cost.seconds += start.elapsed().as_secs_f64();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::Pyramid;

    fn schedule(segment: u32, frames: u32) -> Schedule {
        Schedule::without_copies(Pyramid { segment, frames })
    }

    fn is_empty(pool: &ReferencePool<()>) -> bool {
        pool.held.is_empty() && pool.uses.is_empty() && pool.due.is_empty() && pool.asked.is_empty()
    }

    #[test]
    fn references_are_few() {
        let schedule = schedule(64, 1000);
        let all: Vec<u32> = (1..=1000).collect();
        let (keys, others) = schedule.most_held(&all);
        assert!(keys <= 3 && (5..=6).contains(&others), "{keys} {others}");
        assert_eq!(schedule.most_held(&[2]), (2, 5));
        assert_eq!(schedule.most_held(&[1]), (0, 0));
    }

    #[test]
    fn references_stay_until_the_last_frame_that_needs_them_and_no_longer() {
        let schedule = schedule(64, 1000);
        let mut pool = ReferencePool::default();
        pool.expect(&schedule, &[3, 4]);
        for frame in [1, 65, 33, 17, 9, 5, 3] {
            pool.keep(&schedule, frame, || ());
        }
        pool.done(&schedule, 3);
        assert!([1, 3].iter().all(|f| pool.get(*f).is_some()));
        pool.done(&schedule, 4);
        assert!(is_empty(&pool));
    }

    #[test]
    fn what_is_held_for_others_stays_until_it_is_released() {
        let schedule = schedule(4, 9);
        let (frame, ancestors) = (2, schedule.ancestors(2));
        let mut pool = ReferencePool::default();
        ancestors.iter().for_each(|other| pool.import(*other, ()));
        pool.hold(&schedule, frame);
        assert!(pool.is_due(frame));
        pool.keep(&schedule, frame, || ());
        pool.expect(&schedule, &[frame]);
        pool.done(&schedule, frame);
        assert!(ancestors.iter().chain([&frame]).all(|f| pool.get(*f).is_some()));
        ancestors.iter().chain([&frame]).for_each(|f| pool.release(&schedule, *f));
        assert!(is_empty(&pool));
    }

    #[test]
    fn what_waits_for_disk_or_ranks_is_given_once_and_goes_with_its_reference() {
        let schedule = schedule(2, 3);
        let mut pool = ReferencePool::<(), u8>::default();
        pool.set_unsaved(1, Some(1));
        pool.expect(&schedule, &[2]);
        for frame in [1, 3] {
            pool.keep(&schedule, frame, || ());
            pool.set_unsaved(frame, Some(frame as u8));
            pool.set_export(frame, [0].into());
        }
        pool.set_unsaved(3, None);
        assert!(pool.take_unsaved(Instant::now(), Duration::from_secs(999)).is_empty());
        assert_eq!(pool.take_unsaved(Instant::now(), Duration::ZERO), [(1, 1)]);
        assert!(pool.take_unsaved(Instant::now(), Duration::ZERO).is_empty());
        assert!(pool.take_export(1).is_some() && pool.take_export(1).is_none());
        pool.note_on_disk(1);
        assert!(pool.take_expired().is_empty());
        pool.done(&schedule, 2);
        assert_eq!((pool.take_expired(), pool.take_expired()), (vec![1], vec![]));
        assert!(pool.take_export(3).is_none());
    }
}
