//! Which process renders which frames: one process alone, or the ranks of an MPI job, by the same code.
//!
//! [`Communicator`] stands for all ranks of the job; [`render`] makes the frames of a sequence. MPI is
//! initialised only when a launcher started the process and the feature `mpi` is compiled in. The
//! bytes of a frame do not depend on the rank that renders it.
//!
//! Each rank has a `render_thread`, and its main thread is the `comm_thread`, which exchanges messages
//! with other ranks. Rank 0 also runs the `scheduler`, which assigns frames to ranks and has references
//! sent to the ranks that need them (`docs/decisions/019-ranks.md`). Not done: recovery from a rank that
//! fails. The job ends, and a restart resumes it.

mod chunks;
mod collective;
mod comm_thread;
mod failure;
mod frames;
mod launcher;
mod message;
#[cfg(feature = "mpi")]
mod mpi;
mod nodes;
mod point_to_point;
mod render_thread;
pub mod scheduler;
mod traffic;

pub use failure::PANIC_MESSAGE;
pub use frames::{Outcome, RankJob, RankWork, lock, prepare, render};
pub use launcher::{
    Binding, LauncherProcess, default_threads, is_nonzero_rank, launcher_process, require_single,
};
pub use nodes::{check_rank_map, rank_order};
pub use traffic::{Sent, Traffic};

use crate::error::{Error, Result};
use crate::scene::JobOptions;
use launcher::Launcher;
use std::cell::Cell;
use std::time::Duration;

/// All ranks of the job, as one of them sees them.
pub struct Communicator {
    backend: Backend,
    /// Messages and bytes that this rank sent so far.
    sent: Cell<Traffic>,
    /// Most discoveries in one message.
    exchange: Cell<u64>,
    /// Whether this rank failed and could not report the error.
    has_unreported_failure: Cell<bool>,
    /// Prints the error that ends the job, and returns the exit code.
    #[cfg_attr(not(feature = "mpi"), allow(dead_code))]
    on_failure: Box<dyn Fn(&Error) -> u8>,
}

enum Backend {
    Single,
    #[cfg(feature = "mpi")]
    Mpi(mpi::Session),
}

impl Communicator {
    /// A communicator of one process, without MPI.
    pub fn single() -> Self {
        Self::new(Backend::Single, Box::new(|_| 1))
    }

    fn new(backend: Backend, on_failure: Box<dyn Fn(&Error) -> u8>) -> Self {
        Self {
            backend,
            sent: Cell::default(),
            exchange: Cell::new(JobOptions::default().exchange.into()),
            has_unreported_failure: Cell::default(),
            on_failure,
        }
    }

    /// Sets the most discoveries in one message. The number affects when bytes arrive, never which.
    pub fn set_exchange(&self, discoveries: u32) {
        self.exchange.set(discoveries.into());
    }

    /// Initialises MPI if a launcher started several processes; otherwise the communicator has one
    /// process. `on_failure` prints the error that ends the job and returns the exit code. Rank 0 calls
    /// it if the failed rank can reach rank 0 in time, else the failed rank does.
    ///
    /// # Errors
    /// A launcher started several processes, but MPI does not connect them: each would render
    /// every frame.
    pub fn init(on_failure: impl Fn(&Error) -> u8 + 'static) -> Result<Self> {
        match launcher::multi_process_launcher() {
            Some(launcher) => Self::init_mpi(&launcher, Box::new(on_failure)),
            None => Ok(Self::single()),
        }
    }

    #[cfg(feature = "mpi")]
    fn init_mpi(launcher: &Launcher, on_failure: Box<dyn Fn(&Error) -> u8>) -> Result<Self> {
        let session = mpi::Session::start(failure::encode_panic)?;
        if session.size() == 1 && launcher.ranks.is_some_and(|n| n > 1) {
            return Err(launcher.not_connected());
        }
        Ok(Self::new(Backend::Mpi(session), on_failure))
    }

    #[cfg(not(feature = "mpi"))]
    fn init_mpi(launcher: &Launcher, _: Box<dyn Fn(&Error) -> u8>) -> Result<Self> {
        Err(launcher.without_mpi())
    }

    /// Number of this process, from 0.
    pub fn rank(&self) -> u32 {
        match &self.backend {
            Backend::Single => 0,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.rank(),
        }
    }

    /// Number of processes in the job.
    pub fn size(&self) -> u32 {
        match &self.backend {
            Backend::Single => 1,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.size(),
        }
    }

    /// Number of ranks that share this rank's memory, itself included.
    pub fn node_size(&self) -> u32 {
        self.node_rank_and_size().1
    }

    /// Whether this is rank 0, which prints and keeps the manifest.
    pub fn is_root(&self) -> bool {
        self.rank() == 0
    }

    /// Rank 0's `bytes`, on every rank.
    fn broadcast(&self, bytes: Vec<u8>) -> Vec<u8> {
        match &self.backend {
            Backend::Single => bytes,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.broadcast(bytes),
        }
    }

    /// The `bytes` of the node's first rank, on every rank of the node.
    fn broadcast_in_node(&self, bytes: Vec<u8>) -> Vec<u8> {
        match &self.backend {
            Backend::Single => bytes,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.broadcast_in_node(bytes),
        }
    }

    /// This rank's number within its node, from 0, and the number of ranks on the node.
    fn node_rank_and_size(&self) -> (u32, u32) {
        match &self.backend {
            Backend::Single => (0, 1),
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.node_rank_and_size(),
        }
    }

    /// A barrier that sleeps between polls; false if a rank does not reach it within `timeout`.
    fn timed_barrier(&self, timeout: Option<Duration>) -> bool {
        match &self.backend {
            Backend::Single => {
                _ = timeout;
                true
            }
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.timed_barrier(timeout, &|| self.poll_failures()),
        }
    }

    /// The barrier before `MPI_Finalize`. All ranks call it, last. It sleeps between polls, where
    /// MPI's own wait would spin on a core.
    pub fn final_barrier(&self) {
        self.timed_barrier(None);
    }

    /// The `bytes` of all ranks, in rank order, on rank 0; empty on the others.
    fn gather_bytes(&self, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        match &self.backend {
            Backend::Single => vec![bytes],
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.gather(&bytes),
        }
    }

    /// For each rank the id of its node: the lowest of the ranks that share memory with it. All
    /// ranks call it.
    fn node_ids(&self) -> Result<Vec<u32>> {
        let own = match &self.backend {
            Backend::Single => 0,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.node_id(),
        };
        self.all_gather(own)
    }

    /// Completes this rank's sends, then waits in a barrier; runs `meanwhile` at every poll, and once at
    /// the end. All ranks call it.
    fn flush_and_barrier(&self, meanwhile: &mut dyn FnMut() -> Result<()>) -> Result<()> {
        match &self.backend {
            Backend::Single => {}
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => session.flush_and_barrier(meanwhile)?,
        }
        meanwhile()
    }
}
