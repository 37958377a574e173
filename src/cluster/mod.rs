//! Who renders which frames: one process alone, or the ranks of an MPI job, by the same code.
//!
//! [`World`] is the process's place among the ranks; [`render`] makes the frames of a sequence. MPI is
//! initialised only when a launcher started the process and the feature `mpi` is compiled in. The
//! bytes of a frame do not depend on who renders it.
//!
//! On every rank one thread, the `worker`, renders, and the main thread, the `clerk`, talks to
//! other ranks meanwhile. Rank 0's clerk keeps the `board`, which says who makes what and who sends
//! which reference to whom; references travel from the rank that has them to the one that needs them
//! (`docs/decisions/019-ranks.md`).

mod board;
mod clerk;
mod collective;
mod failure;
mod frames;
mod launcher;
#[cfg(feature = "mpi")]
mod mpi;
mod nodes;
mod note;
mod parcel;
mod post;
pub mod simulation;
mod traffic;
mod worker;

pub use failure::FAULT;
pub use frames::{Duty, Outcome, lock, prepare, render};
pub use launcher::{
    Binding, LauncherProcess, alone, default_threads, is_follower, launcher_process,
};
pub use nodes::{check_rank_map, rank_order};
pub use traffic::{Sent, Traffic};

use crate::error::{Error, Result};
use launcher::Launcher;
use std::cell::Cell;
use std::time::Duration;

/// How many discoveries a message carries at most, unless told; docs/decisions/019-ranks.md has the
/// measurement.
pub const EXCHANGE: u64 = 100_000;

/// This process's place in the job.
pub struct World {
    ranks: Ranks,
    /// What this rank sent, so far.
    sent: Cell<Traffic>,
    /// How many discoveries a message carries at most.
    exchange: Cell<u64>,
    /// Whether this rank failed and could not tell the others.
    is_stranded: Cell<bool>,
    /// Says why the job ends, and gives its exit code.
    #[cfg_attr(not(feature = "mpi"), allow(dead_code))]
    tell: Box<dyn Fn(&Error) -> u8>,
}

enum Ranks {
    Solo,
    #[cfg(feature = "mpi")]
    Mpi(mpi::Session),
}

impl World {
    /// A world of one process.
    pub fn solo() -> Self {
        Self::of(Ranks::Solo, Box::new(|_| 1))
    }

    fn of(ranks: Ranks, tell: Box<dyn Fn(&Error) -> u8>) -> Self {
        Self {
            ranks,
            sent: Cell::default(),
            exchange: Cell::new(EXCHANGE),
            is_stranded: Cell::default(),
            tell,
        }
    }

    /// From here on a message carries so many discoveries at most. It decides when bytes arrive, never
    /// which.
    pub fn set_exchange(&self, discoveries: u64) {
        self.exchange.set(discoveries);
    }

    /// Joins the ranks that a launcher started with this one; alone without a launcher. Where a rank
    /// fails while others are busy, `tell` says why and gives the exit code: on rank 0 if that
    /// hears of it in time, else on the rank that failed, and all end.
    ///
    /// Errors: several processes were started, but they cannot know of each other, so each would
    /// render everything.
    pub fn join(tell: impl Fn(&Error) -> u8 + 'static) -> Result<Self> {
        match launcher::several() {
            Some(launcher) => Self::join_by(&launcher, Box::new(tell)),
            None => Ok(Self::solo()),
        }
    }

    #[cfg(feature = "mpi")]
    fn join_by(launcher: &Launcher, tell: Box<dyn Fn(&Error) -> u8>) -> Result<Self> {
        let session = mpi::Session::start(failure::of_panic)?;
        if session.size() == 1 && launcher.ranks.is_some_and(|n| n > 1) {
            return Err(launcher.stranger());
        }
        Ok(Self::of(Ranks::Mpi(session), tell))
    }

    #[cfg(not(feature = "mpi"))]
    fn join_by(launcher: &Launcher, _: Box<dyn Fn(&Error) -> u8>) -> Result<Self> {
        Err(launcher.without_mpi())
    }

    /// This process's number, from 0.
    pub fn rank(&self) -> u32 {
        match &self.ranks {
            Ranks::Solo => 0,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.rank(),
        }
    }

    /// How many processes share the job.
    pub fn size(&self) -> u32 {
        match &self.ranks {
            Ranks::Solo => 1,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.size(),
        }
    }

    /// How many of the processes share this one's memory, itself included.
    pub fn size_of_node(&self) -> u32 {
        self.place_in_node().1
    }

    /// Whether this rank talks to people and keeps the manifest.
    pub fn is_root(&self) -> bool {
        self.rank() == 0
    }

    fn broadcast(&self, bytes: Vec<u8>) -> Vec<u8> {
        match &self.ranks {
            Ranks::Solo => bytes,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.broadcast(bytes),
        }
    }

    fn broadcast_in_node(&self, bytes: Vec<u8>) -> Vec<u8> {
        match &self.ranks {
            Ranks::Solo => bytes,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.broadcast_in_node(bytes),
        }
    }

    /// This rank's place among those of its node, from 0, and how many these are.
    fn place_in_node(&self) -> (u32, u32) {
        match &self.ranks {
            Ranks::Solo => (0, 1),
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.place_in_node(),
        }
    }

    /// Waits, asleep, for all ranks to get here; false where some do not within `patience`.
    fn assemble(&self, patience: Option<Duration>) -> bool {
        match &self.ranks {
            Ranks::Solo => {
                _ = patience;
                true
            }
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.assemble(patience, &|| self.heed_failures()),
        }
    }

    /// Waits, asleep, for all ranks to get to the end; MPI itself would have those that wait look without
    /// a pause. All ranks call it, last.
    pub fn part(&self) {
        self.assemble(None);
    }

    fn gather_bytes(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        match &self.ranks {
            Ranks::Solo => vec![bytes],
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.gather(&bytes),
        }
    }

    /// For each rank the number of its node: the lowest of the ranks that share memory with it. All
    /// ranks call it.
    fn nodes(&self) -> Result<Vec<u32>> {
        let own = match &self.ranks {
            Ranks::Solo => 0,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.node(),
        };
        self.all(own)
    }

    /// Waits until every rank got here, asleep between looks; `meanwhile` runs at every look.
    fn settle(&self, meanwhile: &mut dyn FnMut() -> Result<()>) -> Result<()> {
        match &self.ranks {
            Ranks::Solo => {}
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.settle(meanwhile)?,
        }
        meanwhile()
    }
}
