//! What frames left, on disk for a job that goes on after this one: when it is put there, and when removed.
//!
//! Of a [`SurfaceReuse`] only references of key frames: they are expensive, and serve long. The others would take
//! more time to put on disk, one after every other frame, than the few of them that are lost take to be
//! made again.

use super::checkpoint::Checkpoints;
use super::{SaveCost, SurfaceReuse};
use crate::inference::TracedPoints;
use crate::reuse::Reference;
use crate::reuse::evidence::Finding;
use crate::scene::Camera;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest that a job which shall stop goes on writing.
const LONGEST_FAREWELL: Duration = Duration::from_secs(5);

/// What the frames of a running job left, by frame; as bytes, or as something that bytes can be made of.
pub(super) struct Saved<T = Arc<[u8]>> {
    /// What is not on disk.
    pending: BTreeMap<u32, T>,
    /// What is.
    on_disk: BTreeSet<u32>,
    /// When some was last put there, or the job began.
    put: Instant,
    pub cost: SaveCost,
}

/// A maker of frames that keeps on disk what its frames leave for others.
pub(super) trait Keeps {
    /// What a frame left.
    type Left;

    /// Where it is kept; `None` for nowhere.
    fn checkpoints(&self) -> Option<&Checkpoints<'_>>;

    /// Calls `act` with what is kept and with a function that says whether a later frame needs what a given frame
    /// left.
    fn with_saved<R>(
        &self,
        act: impl FnOnce(&mut Saved<Self::Left>, &dyn Fn(u32) -> bool) -> R,
    ) -> R;

    /// As it lies on disk; `None` where it cannot.
    fn bytes(&self, left: &Self::Left) -> Option<Arc<[u8]>>;

    /// Puts what frames left on disk where that is due, all of it where the job shall stop, and removes
    /// what no frame to come needs. Where it cannot be written the job goes on without: it only saves time
    /// after a kill.
    fn put_away(&self, stopping: bool) {
        let Some((checkpoints, every)) = self.checkpoints().and_then(|c| Some((c, c.every?)))
        else {
            return;
        };
        let start = Instant::now();
        let every = if stopping { Duration::ZERO } else { every };
        for (frame, left) in self.with_saved(|saved, is_needed| saved.due(is_needed, start, every))
        {
            if stopping && start.elapsed() > LONGEST_FAREWELL {
                break;
            }
            let Some(bytes) = self.bytes(&left) else { continue };
            if let Err(why) = checkpoints.write(frame, &bytes) {
                checkpoints.note_unwritten(&why);
                continue;
            }
            self.with_saved(|saved, _| {
                saved.on_disk.insert(frame);
                saved.cost.bytes += bytes.len() as u64;
            });
        }
        let over = self.with_saved(|saved, is_needed| saved.over(is_needed));
        over.into_iter().for_each(|frame| checkpoints.remove(frame));
        self.with_saved(|saved, _| saved.cost.seconds += start.elapsed().as_secs_f64());
    }
}

impl<T> Default for Saved<T> {
    fn default() -> Self {
        let (pending, on_disk, cost) = Default::default();
        Self { pending, on_disk, put: Instant::now(), cost }
    }
}

impl<T> Saved<T> {
    /// What a frame left is to be put on disk, sooner or later.
    pub fn add(&mut self, frame: u32, left: T) {
        self.pending.insert(frame, left);
    }

    /// What a frame left was found on disk.
    pub fn found(&mut self, frame: u32) {
        self.on_disk.insert(frame);
    }

    /// The file of a frame is about to hold what it left.
    pub fn has_file(&mut self, frame: u32) {
        self.pending.remove(&frame);
    }

    /// What is to be put on disk, if the last time is `every` ago.
    fn due(
        &mut self,
        is_needed: &dyn Fn(u32) -> bool,
        now: Instant,
        every: Duration,
    ) -> BTreeMap<u32, T> {
        self.pending.retain(|frame, _| is_needed(*frame));
        if now.duration_since(self.put) < every {
            return BTreeMap::new();
        }
        self.put = now;
        std::mem::take(&mut self.pending)
    }

    /// What is on disk and not needed any more.
    fn over(&mut self, is_needed: &dyn Fn(u32) -> bool) -> Vec<u32> {
        let over: Vec<u32> = self.on_disk.iter().copied().filter(|f| !is_needed(*f)).collect();
        over.iter().for_each(|frame| _ = self.on_disk.remove(frame));
        over
    }
}

impl Saved {
    /// Bytes that wait to be put on disk.
    pub fn memory(&self) -> u64 {
        self.pending.values().map(|bytes| bytes.len() as u64).sum()
    }
}

impl Keeps for SurfaceReuse<'_> {
    type Left = Arc<[u8]>;

    fn checkpoints(&self) -> Option<&Checkpoints<'_>> {
        self.checkpoints
    }

    fn with_saved<R>(&self, act: impl FnOnce(&mut Saved, &dyn Fn(u32) -> bool) -> R) -> R {
        self.with_state(|s| act(&mut s.saved, &|frame| s.references.get(frame).is_some()))
    }

    fn bytes(&self, left: &Arc<[u8]>) -> Option<Arc<[u8]>> {
        Some(Arc::clone(left))
    }
}

impl SurfaceReuse<'_> {
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
            s.saved.found(frame);
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
        left: (&TracedPoints, &[Finding]),
        kept: Option<&Arc<[u8]>>,
    ) {
        let saves = |c: &&Checkpoints| c.every.is_some() && self.pyramid.is_key(frame);
        let saved = self.checkpoints.filter(saves);
        let Some(terms) = self.exchange.as_ref().or(saved.map(|c| c.terms)) else {
            return;
        };
        let start = Instant::now();
        // A cropped frame's file holds less.
        let bytes = match kept.filter(|_| self.renderer.settings.crop.is_none()) {
            Some(bytes) => Some(Arc::clone(bytes)),
            None => self.encode(terms, frame, camera, None, left),
        };
        let Some(bytes) = bytes else { return };
        if self.exchange.is_some() {
            self.with_state(|s| s.exports.insert(frame, Arc::clone(&bytes)));
        }
        if saved.is_none() {
            return;
        }
        self.with_state(|s| {
            s.saved.add(frame, bytes);
            s.saved.cost.seconds += start.elapsed().as_secs_f64();
        });
        self.put_away(false);
    }
}
