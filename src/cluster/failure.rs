//! A rank that fails while the others are busy: the job ends, and rank 0 says why, if it hears in time.

use super::{Ranks, World};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// What a panic is called.
pub const FAULT: &str = "this is a fault in tweenray, please report it";

impl World {
    /// Ends all ranks for this rank's `error`, which rank 0 says; alone it does nothing. What was finished
    /// stays: it is on disk.
    pub fn fail(&self, error: &Error) {
        match &self.ranks {
            Ranks::Solo => _ = error,
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => {
                let is_told = session.confess(Verdict::of(error).encode());
                session.abort(if is_told { 1 } else { (self.tell)(error) });
            }
        }
    }

    /// On rank 0: says why another rank failed, if one did, and ends all. Elsewhere it helps a thread that
    /// panicked to be heard.
    pub(super) fn heed_failures(&self) {
        match &self.ranks {
            Ranks::Solo => {}
            #[cfg(feature = "mpi")]
            Ranks::Mpi(session) => {
                if let Some((rank, words)) = session.failure() {
                    session.abort((self.tell)(&Verdict::decode(&words).into_error(rank as usize)));
                }
            }
        }
    }
}

/// A panic's words, for rank 0.
#[cfg(feature = "mpi")]
pub(super) fn of_panic(panic: &dyn std::fmt::Display) -> Vec<u8> {
    Verdict::Failed(format!("{FAULT}: {panic}")).encode()
}

/// An error as other ranks hear of it.
#[derive(Serialize, Deserialize)]
pub(super) enum Verdict {
    Input(String),
    Usage(String),
    Stopped,
    Failed(String),
}

impl Verdict {
    pub(super) fn of(error: &Error) -> Self {
        match error {
            Error::Input(fault) => Self::Input(fault.to_string()),
            Error::Usage(text) => Self::Usage(text.clone()),
            Error::Stopped => Self::Stopped,
            other => Self::Failed(other.to_string()),
        }
    }

    pub(super) fn into_error(self, rank: usize) -> Error {
        match self {
            // Kept apart from `Failed` for the exit code; the text already holds the place.
            Self::Input(text) | Self::Usage(text) => Error::Usage(text),
            Self::Stopped => Error::Stopped,
            Self::Failed(text) => Error::Failed(format!("rank {rank}: {text}")),
        }
    }

    #[cfg(feature = "mpi")]
    fn encode(&self) -> Vec<u8> {
        postcard::to_stdvec(self).unwrap_or_default()
    }

    #[cfg(feature = "mpi")]
    fn decode(words: &[u8]) -> Self {
        let unclear = |_| Self::Failed("failed, in words that cannot be understood".into());
        postcard::from_bytes(words).unwrap_or_else(unclear)
    }
}
