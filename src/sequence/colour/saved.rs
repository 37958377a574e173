//! Discoveries on disk, for a job that goes on after this one: of all frames that frames to come need.
//! These are few, about as many as the shot's length has binary digits. A rank puts there what it made
//! itself.

use super::{ColourMaker, State, exchange};
use crate::error::Result;
use crate::reuse::colour::Known;
use crate::sequence::SaveCost;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest that a job which shall stop goes on writing.
const LONGEST_FAREWELL: Duration = Duration::from_secs(5);

/// Discoveries of a running job, by frame.
#[derive(Default)]
pub(super) struct Saved {
    /// Those that this process made and that are not on disk.
    pending: BTreeSet<u32>,
    /// Those that are.
    on_disk: BTreeSet<u32>,
    /// When some were last put there, or the first was made.
    put: Option<Instant>,
    pub cost: SaveCost,
}

impl ColourMaker<'_> {
    /// What `frame` discovered in an earlier run, where that left it.
    pub(super) fn left_on_disk(&self, frame: u32) -> Option<Arc<Known>> {
        let bytes = self.checkpoints?.read_bytes(frame)?;
        let known = exchange::decode(frame, &bytes)?;
        self.with_state(|s| s.saved.on_disk.insert(frame));
        Some(self.keep(known))
    }

    /// `frame` was just made, and its discoveries are worth keeping.
    pub(super) fn made(&self, frame: u32) {
        self.with_state(|s| s.saved.pending.insert(frame));
    }

    /// Puts discoveries on disk where that is due, all of them where the job shall stop, and removes
    /// those that no frame to come needs.
    pub(super) fn tend(&self, stopping: bool) -> Result<()> {
        let Some((checkpoints, every)) = self.checkpoints.and_then(|c| Some((c, c.every?))) else {
            return Ok(());
        };
        let start = Instant::now();
        let every = if stopping { Duration::ZERO } else { every };
        for known in self.with_state(|s| due(s, start, every)) {
            if stopping && start.elapsed() > LONGEST_FAREWELL {
                break;
            }
            let Ok(bytes) = self.pool.install(|| exchange::encode(&known)) else { continue };
            checkpoints.write(known.frame, &bytes)?;
            self.with_state(|s| {
                s.saved.on_disk.insert(known.frame);
                s.saved.cost.bytes += bytes.len() as u64;
            });
        }
        let over = self.with_state(over);
        over.into_iter().for_each(|frame| checkpoints.remove(frame));
        self.with_state(|s| s.saved.cost.seconds += start.elapsed().as_secs_f64());
        Ok(())
    }
}

/// What is to be put on disk, if the last time is `every` ago.
fn due(state: &mut State, now: Instant, every: Duration) -> Vec<Arc<Known>> {
    let State { known, saved, .. } = state;
    saved.pending.retain(|frame| known.contains_key(frame));
    let last = *saved.put.get_or_insert(now);
    if now.duration_since(last) < every {
        return Vec::new();
    }
    saved.put = Some(now);
    let all = std::mem::take(&mut saved.pending);
    all.iter().filter_map(|frame| known.get(frame).cloned()).collect()
}

/// What is on disk and not needed any more.
fn over(state: &mut State) -> Vec<u32> {
    let State { known, saved, .. } = state;
    let over: Vec<u32> =
        saved.on_disk.iter().copied().filter(|frame| !known.contains_key(frame)).collect();
    over.iter().for_each(|frame| _ = saved.on_disk.remove(frame));
    over
}
