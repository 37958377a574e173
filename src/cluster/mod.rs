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
mod frames;
mod launcher;
#[cfg(feature = "mpi")]
mod mpi;
mod nodes;
mod note;
pub mod simulation;
mod traffic;
mod worker;

pub use frames::{Duty, Outcome, render};
pub use launcher::default_threads;
pub use nodes::rank_order;
pub use traffic::{Sent, Traffic};

use crate::error::{Error, Result};
use launcher::Launcher;
use note::{Cargo, Kind};
use serde::{Deserialize, Serialize};
use std::cell::Cell;

/// This process's place in the job.
pub struct World {
    ranks: Ranks,
    /// What this rank sent while rendering, so far.
    sent: Cell<Traffic>,
}

enum Ranks {
    Solo,
    #[cfg(feature = "mpi")]
    Mpi(mpi::Session),
}

impl World {
    /// A world of one process.
    pub fn solo() -> Self {
        Self::of(Ranks::Solo)
    }

    fn of(ranks: Ranks) -> Self {
        Self { ranks, sent: Cell::default() }
    }

    /// Joins the ranks that a launcher started with this one; alone without a launcher.
    ///
    /// Errors: several processes were started, but they cannot know of each other, so each would
    /// render everything.
    pub fn join() -> Result<Self> {
        match launcher::detect(|name| std::env::var(name).ok()) {
            Some(launcher) if launcher.ranks != Some(1) => Self::join_by(&launcher),
            _ => Ok(Self::solo()),
        }
    }

    #[cfg(feature = "mpi")]
    fn join_by(launcher: &Launcher) -> Result<Self> {
        let session = mpi::Session::start()?;
        if session.size() == 1 && launcher.ranks.is_some_and(|n| n > 1) {
            return Err(launcher.stranger());
        }
        Ok(Self::of(Ranks::Mpi(session)))
    }

    #[cfg(not(feature = "mpi"))]
    fn join_by(launcher: &Launcher) -> Result<Self> {
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

    /// Whether this rank talks to people and keeps the manifest.
    pub fn is_root(&self) -> bool {
        self.rank() == 0
    }

    /// `outcome`, if no rank failed; else the error of the lowest rank that did, on every rank.
    /// All ranks call it.
    pub fn agree<T>(&self, outcome: Result<T>) -> Result<T> {
        if self.size() == 1 {
            return outcome;
        }
        let mine = outcome.as_ref().err().map(Verdict::of);
        let verdicts: Vec<Option<Verdict>> = self.exchange(&mine)?;
        match (verdicts.into_iter().enumerate().find_map(|(r, v)| Some((r, v?))), outcome) {
            (None, outcome) => outcome,
            (Some((rank, _)), Err(own)) if rank as u32 == self.rank() => Err(own),
            (Some((rank, verdict)), _) => Err(verdict.into_error(rank)),
        }
    }

    /// What rank 0 makes of `make`, on every rank; its error too. All ranks call it.
    pub fn from_root<T>(&self, make: impl FnOnce() -> Result<T>) -> Result<T>
    where
        T: Serialize + for<'de> Deserialize<'de>,
    {
        if self.size() == 1 {
            return make();
        }
        let made = if self.is_root() { make().map(Some) } else { Ok(None) };
        let bytes = encode(&self.agree(made)?)?;
        match decode(&self.broadcast(bytes))? {
            Some(value) => Ok(value),
            None => Err(Error::Failed("rank 0 sent nothing".into())),
        }
    }

    /// Every rank's `value`, in rank order, on rank 0; nothing on the others. All ranks call it.
    pub fn gather<T: Serialize + for<'de> Deserialize<'de>>(&self, value: &T) -> Result<Vec<T>> {
        let all = self.gather_bytes(encode(value)?);
        all.iter().map(|bytes| decode(bytes)).collect()
    }

    /// Every rank's `value`, in rank order, on every rank. All ranks call it.
    pub fn all<T: Serialize + for<'de> Deserialize<'de>>(&self, value: T) -> Result<Vec<T>> {
        if self.size() == 1 { Ok(vec![value]) } else { self.exchange(&value) }
    }

    /// `value` if all ranks have the same, else an error that says what differs. All ranks call it.
    pub fn same_everywhere(&self, what: &str, value: String) -> Result<String> {
        if self.size() == 1 {
            return Ok(value);
        }
        let all: Vec<String> = self.exchange(&value)?;
        match all.iter().enumerate().find(|(_, other)| **other != all[0]) {
            None => Ok(value),
            Some((rank, other)) => Err(Error::Usage(format!(
                "rank 0 {what} {}, but rank {rank} {what} {other}\n  help: frames would differ in \
                 their last bits; --isa avx2 makes mixed machines agree",
                all[0]
            ))),
        }
    }

    fn exchange<T: Serialize + for<'de> Deserialize<'de>>(&self, value: &T) -> Result<Vec<T>> {
        let gathered = self.gather(value)?;
        decode(&self.broadcast(encode(&gathered)?))
    }

    fn broadcast(&self, bytes: Vec<u8>) -> Vec<u8> {
        match &self.ranks {
            Ranks::Solo => bytes,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.broadcast(bytes),
        }
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

    /// Sends a note to rank `to` without waiting for it to be read.
    fn post<T: Serialize>(&self, to: u32, note: &T) -> Result<()> {
        let bytes = encode(note)?;
        self.count(|sent| sent.note(bytes.len()));
        self.send(to, false, bytes)
    }

    /// Sends a cargo to rank `to` without waiting for it to be taken in.
    fn ship(&self, to: u32, kind: Kind, original: u32, number: u32, bytes: &[u8]) -> Result<()> {
        let bytes = Cargo::encode(kind, original, number, bytes);
        self.count(|sent| sent.cargo(kind, bytes.len()));
        self.send(to, true, bytes)
    }

    fn count(&self, count: impl FnOnce(&mut Traffic)) {
        let mut sent = self.sent.get();
        count(&mut sent);
        self.sent.set(sent);
    }

    /// What this rank sent while rendering, so far.
    fn sent(&self) -> Traffic {
        self.sent.get()
    }

    fn send(&self, to: u32, is_cargo: bool, bytes: Vec<u8>) -> Result<()> {
        match &self.ranks {
            // There is nobody to send to.
            Ranks::Solo => {
                _ = (to, is_cargo, bytes);
                Ok(())
            }
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.post(to, is_cargo, bytes),
        }
    }

    /// The notes that have arrived for this rank since it last asked, with their senders.
    fn notes<T: for<'de> Deserialize<'de>>(&self) -> Result<Vec<(u32, T)>> {
        let notes: Vec<(u32, Vec<u8>)> = match &self.ranks {
            Ranks::Solo => Vec::new(),
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.arrived(false),
        };
        notes.iter().map(|(from, bytes)| Ok((*from, decode(bytes)?))).collect()
    }

    /// The cargo that has arrived for this rank since it last asked.
    fn cargo(&self) -> Vec<Vec<u8>> {
        match &self.ranks {
            Ranks::Solo => Vec::new(),
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => {
                session.arrived(true).into_iter().map(|(_, bytes)| bytes).collect()
            }
        }
    }

    /// Whether something is still on its way to others.
    fn is_sending(&self) -> bool {
        match &self.ranks {
            Ranks::Solo => false,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.is_sending(),
        }
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

    /// Ends every rank of the job at once; alone it does nothing. For a failure on one rank while
    /// the others are busy: what they finished is on disk.
    pub fn abort(&self, code: u8) {
        match &self.ranks {
            Ranks::Solo => _ = code,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => session.abort(code),
        }
    }
}

/// An error as other ranks hear of it.
#[derive(Serialize, Deserialize)]
enum Verdict {
    Input(String),
    Usage(String),
    Stopped,
    Failed(String),
}

impl Verdict {
    fn of(error: &Error) -> Self {
        match error {
            Error::Input(fault) => Self::Input(fault.to_string()),
            Error::Usage(text) => Self::Usage(text.clone()),
            Error::Stopped => Self::Stopped,
            other => Self::Failed(other.to_string()),
        }
    }

    fn into_error(self, rank: usize) -> Error {
        match self {
            // Kept apart from `Failed` for the exit code; the text already holds the place.
            Self::Input(text) | Self::Usage(text) => Error::Usage(text),
            Self::Stopped => Error::Stopped,
            Self::Failed(text) => Error::Failed(format!("rank {rank}: {text}")),
        }
    }
}

fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    serde_json::to_vec(value).map_err(|e| Error::Failed(format!("cannot tell other ranks: {e}")))
}

fn decode<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T> {
    serde_json::from_slice(bytes)
        .map_err(|e| Error::Failed(format!("cannot understand another rank: {e}")))
}
