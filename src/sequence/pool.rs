//! The references of a running job. Each stays in memory as long as later frames are inferred from it, with its
//! bytes for disk and for other ranks until these are taken.
//!
//! References of earlier jobs (`--references`) are in a [`ReferenceCache`](super::ReferenceCache) instead: this job
//! does not make them, and a limit of memory decides which of them stay.

use super::SaveCost;
use super::checkpoint::Checkpoints;
use super::schedule::Schedule;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Longest time for which a job that was asked to stop still writes references.
const LONGEST_SAVE_AT_STOP: Duration = Duration::from_secs(5);

/// References of type `T` by representative frame; an `S` holds what is written of a reference to disk.
#[derive(Debug)]
pub(super) struct ReferencePool<T, S = Arc<[u8]>> {
    /// By representative: how many frames (it and its copies) are still to be returned.
    asked: BTreeMap<u32, u32>,
    /// By representative: how many later frames are inferred from it, plus one for each hold of other ranks.
    uses: BTreeMap<u32, u32>,
    /// Representatives in use whose reference is not made yet.
    due: BTreeSet<u32>,
    held: BTreeMap<u32, Held<T, S>>,
    /// Representatives whose reference is on disk.
    on_disk: BTreeSet<u32>,
    /// Time of the last writing, or of the job's start.
    last_save: Instant,
    pub save_cost: SaveCost,
    /// The most memory that references took at a time, bytes.
    pub most_memory: u64,
}

/// A reference in memory.
#[derive(Debug)]
struct Held<T, S> {
    reference: T,
    /// Data to be written to disk; `None` once it is written.
    unsaved: Option<S>,
    /// The bytes for other ranks; `None` once they are taken.
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
    /// Announces that `frames` will be made.
    pub fn expect(&mut self, schedule: &Schedule, frames: &[u32]) {
        for frame in frames {
            let representative = schedule.representative(*frame);
            *self.asked.entry(representative).or_default() += 1;
            self.use_ancestors(schedule, representative);
        }
    }

    /// Announces `frame`, unless it was announced already.
    pub fn expect_once(&mut self, schedule: &Schedule, frame: u32) {
        if self.asked(schedule.representative(frame)) == 0 {
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

    /// Keeps the reference of `representative`, which other ranks need, until [`release`](Self::release).
    pub fn hold(&mut self, schedule: &Schedule, representative: u32) {
        *self.uses.entry(representative).or_default() += 1;
        if !self.held.contains_key(&representative) && self.due.insert(representative) {
            self.use_ancestors(schedule, representative);
        }
    }

    /// Keeps a reference that another rank made, until [`release`](Self::release).
    pub fn import(&mut self, representative: u32, reference: T) {
        *self.uses.entry(representative).or_default() += 1;
        self.held.entry(representative).or_insert(Held { reference, unsaved: None, export: None });
    }

    /// Ends one use of the reference of `representative`; the end of the last use drops it.
    pub fn release(&mut self, schedule: &Schedule, representative: u32) {
        let Some(uses) = self.uses.get_mut(&representative) else { return };
        *uses -= 1;
        if *uses == 0 {
            self.uses.remove(&representative);
            self.held.remove(&representative);
            if self.due.remove(&representative) {
                // It was never made: all frames that need it came from elsewhere.
                self.release_ancestors(schedule, representative);
            }
        }
    }

    fn release_ancestors(&mut self, schedule: &Schedule, representative: u32) {
        schedule
            .ancestors(representative)
            .into_iter()
            .for_each(|other| self.release(schedule, other));
    }

    /// How many frames, the representative and its copies, are still to be returned.
    pub fn asked(&self, representative: u32) -> u32 {
        self.asked.get(&representative).copied().unwrap_or(0)
    }

    /// The reference of a representative, if it is in memory.
    pub fn get(&self, representative: u32) -> Option<&T> {
        self.held.get(&representative).map(|held| &held.reference)
    }

    /// Whether the reference is in use and not made yet.
    pub fn is_due(&self, representative: u32) -> bool {
        self.due.contains(&representative)
    }

    /// The representatives whose references are in memory.
    pub fn held(&self) -> impl Iterator<Item = u32> {
        self.held.keys().copied()
    }

    /// Keeps the reference of a representative that was just made or read, if it is in use.
    pub fn keep(&mut self, schedule: &Schedule, representative: u32, make: impl FnOnce() -> T) {
        if self.due.remove(&representative) {
            let held = Held { reference: make(), unsaved: None, export: None };
            self.held.insert(representative, held);
            self.release_ancestors(schedule, representative);
        }
    }

    /// Notes that a frame with this representative was returned, and ends its use of its ancestors' references: those that
    /// no other frame needs are dropped.
    pub fn done(&mut self, schedule: &Schedule, representative: u32) {
        if let Some(asked) = self.asked.get_mut(&representative) {
            *asked -= 1;
            if *asked == 0 {
                self.asked.remove(&representative);
            }
            self.release_ancestors(schedule, representative);
        }
    }

    /// Updates [`most_memory`](Self::most_memory); `size` returns the bytes of a reference and of its unsaved
    /// data.
    pub fn note_memory(&mut self, size: impl Fn(&T, Option<&S>) -> u64) {
        let held = self.held.values();
        let memory = held.map(|held| size(&held.reference, held.unsaved.as_ref())).sum();
        self.most_memory = self.most_memory.max(memory);
    }

    /// Keeps the bytes of a reference for other ranks.
    pub fn set_export(&mut self, representative: u32, bytes: Arc<[u8]>) {
        self.held.entry(representative).and_modify(|held| held.export = Some(bytes));
    }

    /// Takes the bytes of a reference for other ranks.
    pub fn take_export(&mut self, representative: u32) -> Option<Arc<[u8]>> {
        self.held.get_mut(&representative)?.export.take()
    }

    /// Sets the data to be written of a reference; `None` if a file holds it already.
    pub fn set_unsaved(&mut self, representative: u32, unsaved: Option<S>) {
        self.held.entry(representative).and_modify(|held| held.unsaved = unsaved);
    }

    /// Notes that a reference is on disk.
    pub fn note_on_disk(&mut self, representative: u32) {
        self.on_disk.insert(representative);
    }

    /// Takes all unsaved data if the last writing was at least `every` ago.
    fn take_unsaved(&mut self, now: Instant, every: Duration) -> Vec<(u32, S)> {
        if now.duration_since(self.last_save) < every {
            return Vec::new();
        }
        self.last_save = now;
        let held = self.held.iter_mut();
        held.filter_map(|(representative, held)| Some((*representative, held.unsaved.take()?)))
            .collect()
    }

    /// Takes the representatives whose reference is on disk and no longer needed.
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
            let mut wanted = vec![self.representative(frame)];
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
            pool.done(self, self.representative(frame));
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

    /// Writes unsaved references, encoded by `encode`, if the interval has passed or the job is to stop. Removes
    /// references from disk that no later frame needs. If one cannot be written, the job goes on, since
    /// references on disk only save time after a kill.
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
        for (representative, unsaved) in unsaved {
            if is_stopping && start.elapsed() > LONGEST_SAVE_AT_STOP {
                break;
            }
            let Some(bytes) = encode(&unsaved) else { continue };
            if let Err(why) = checkpoints.write(representative, &bytes) {
                checkpoints.note_unwritten(&why);
                continue;
            }
            let mut pool = self.lock();
            pool.note_on_disk(representative);
            pool.save_cost.bytes += bytes.len() as u64;
        }
        let expired = self.lock().take_expired();
        expired.into_iter().for_each(|representative| checkpoints.remove(representative));
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
    fn few_references_are_held_at_a_time() {
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
    fn references_held_for_other_ranks_stay_until_released() {
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
    fn bytes_for_disk_and_ranks_are_taken_once_and_dropped_with_their_reference() {
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
