//! The references of an [`Inferrer`] on disk: when they are put there, read and removed.
//!
//! Only those of key frames: they are dear, and serve long. The others would take more time to put on
//! disk, one after every other frame, than the few of them that are lost take to be made again.

use super::checkpoint::Checkpoints;
use super::schedule::Stock;
use super::{Inferrer, SaveCost};
use crate::error::Result;
use crate::inference::TracedPoints;
use crate::reuse::Reference;
use crate::scene::Camera;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest that a job which shall stop goes on writing references.
const LONGEST_FAREWELL: Duration = Duration::from_secs(5);

/// References of a running job, as bytes.
#[derive(Default)]
pub(super) struct Saved {
    /// Those that are not on disk.
    pending: BTreeMap<u32, Arc<[u8]>>,
    /// Those that are.
    on_disk: BTreeSet<u32>,
    /// When some were last put there, or the first was made.
    put: Option<Instant>,
    pub cost: SaveCost,
}

impl Inferrer<'_> {
    /// The reference of an original that an earlier run left. Not where the original itself is asked
    /// for: then it is made anyway.
    pub(super) fn left_on_disk(&self, frame: u32) -> Option<Arc<Reference>> {
        let checkpoints = self.checkpoints?;
        if self.with_state(|s| s.references.asked(frame)) > 0 {
            return None;
        }
        let (reference, bytes) = self.pool.install(|| checkpoints.read(frame))?;
        self.with_state(|s| {
            if self.exchange.is_some() {
                s.exports.insert(frame, bytes);
            }
            s.saved.on_disk.insert(frame);
            s.keep(&self.schedule, frame, reference);
            s.references.get(frame).cloned()
        })
    }

    /// Keeps the new reference of a frame as bytes where they may be wanted: for other ranks, and a key
    /// frame's for a job that goes on after this one. `kept` is what the frame's file will hold.
    pub(super) fn leave(
        &self,
        frame: u32,
        camera: &Camera,
        traced: &TracedPoints,
        kept: Option<&Arc<[u8]>>,
    ) -> Result<()> {
        let saves = |c: &&Checkpoints| c.every.is_some() && self.pyramid.is_key(frame);
        let saved = self.checkpoints.filter(saves);
        let Some(terms) = self.exchange.as_ref().or(saved.map(|c| c.terms)) else {
            return Ok(());
        };
        let start = Instant::now();
        // A cropped frame's file holds less.
        let bytes = match kept.filter(|_| self.renderer.settings.crop.is_none()) {
            Some(bytes) => Some(Arc::clone(bytes)),
            None => self.encode(terms, frame, camera, None, traced),
        };
        let Some(bytes) = bytes else { return Ok(()) };
        if self.exchange.is_some() {
            self.with_state(|s| s.exports.insert(frame, Arc::clone(&bytes)));
        }
        if saved.is_none() {
            return Ok(());
        }
        self.with_state(|s| {
            s.saved.pending.insert(frame, bytes);
            s.saved.cost.seconds += start.elapsed().as_secs_f64();
        });
        self.tend(false)
    }

    /// Puts references on disk where that is due, all of them where the job shall stop, and removes
    /// those that no frame to come needs.
    pub(super) fn tend(&self, stopping: bool) -> Result<()> {
        let Some((checkpoints, every)) = self.checkpoints.and_then(|c| Some((c, c.every?))) else {
            return Ok(());
        };
        let start = Instant::now();
        let every = if stopping { Duration::ZERO } else { every };
        let put = self.with_state(|s| s.saved.due(&s.references, start, every));
        for (frame, bytes) in put {
            if stopping && start.elapsed() > LONGEST_FAREWELL {
                break;
            }
            checkpoints.write(frame, &bytes)?;
            self.with_state(|s| {
                s.saved.on_disk.insert(frame);
                s.saved.cost.bytes += bytes.len() as u64;
            });
        }
        let over = self.with_state(|s| s.saved.over(&s.references));
        over.into_iter().for_each(|frame| checkpoints.remove(frame));
        self.with_state(|s| s.saved.cost.seconds += start.elapsed().as_secs_f64());
        Ok(())
    }
}

impl Saved {
    /// Bytes that wait to be put on disk.
    pub fn memory(&self) -> u64 {
        self.pending.values().map(|bytes| bytes.len() as u64).sum()
    }

    /// The file of a frame is about to hold its reference.
    pub fn has_file(&mut self, frame: u32) {
        self.pending.remove(&frame);
    }

    /// What is to be put on disk, the dearest first, if the last time is `every` ago.
    fn due(
        &mut self,
        references: &Stock<Arc<Reference>>,
        now: Instant,
        every: Duration,
    ) -> Vec<(u32, Arc<[u8]>)> {
        self.pending.retain(|frame, _| references.get(*frame).is_some());
        let last = *self.put.get_or_insert(now);
        if now.duration_since(last) < every {
            return Vec::new();
        }
        self.put = Some(now);
        let mut all: Vec<_> = std::mem::take(&mut self.pending).into_iter().collect();
        all.sort_by_key(|(_, bytes)| std::cmp::Reverse(bytes.len()));
        all
    }

    /// What is on disk and not needed any more.
    fn over(&mut self, references: &Stock<Arc<Reference>>) -> Vec<u32> {
        let is_over = |frame: &u32| references.get(*frame).is_none();
        let over: Vec<u32> = self.on_disk.iter().copied().filter(is_over).collect();
        over.iter().for_each(|frame| _ = self.on_disk.remove(frame));
        over
    }
}
