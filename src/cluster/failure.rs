//! A rank that fails while other ranks are busy ends the job, and rank 0 prints the error if it is
//! reached in time.

use super::{Backend, Communicator};
use crate::error::Error;
use serde::{Deserialize, Serialize};

/// The words before a panic's own message.
pub const PANIC_MESSAGE: &str = "this is a fault in tweenray, please report it";

impl Communicator {
    /// Ends all ranks because of this rank's `error`, which rank 0 prints. A single process does
    /// nothing. Finished frames stay on disk.
    pub fn abort(&self, error: &Error) {
        match &self.backend {
            Backend::Single => _ = error,
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => {
                let is_reported = session.report_failure(RemoteError::of(error).encode());
                session.abort(if is_reported { 1 } else { (self.on_failure)(error) });
            }
        }
    }

    /// On rank 0: if another rank failed, prints its error and ends all ranks. On other ranks: sends the
    /// report of a thread that panicked.
    pub(super) fn poll_failures(&self) {
        match &self.backend {
            Backend::Single => {}
            #[cfg(feature = "mpi")]
            Backend::Mpi(session) => {
                if let Some((rank, report)) = session.receive_failure() {
                    let error = RemoteError::decode(&report).into_error(rank as usize);
                    session.abort((self.on_failure)(&error));
                }
            }
        }
    }
}

/// The failure report of a panic.
#[cfg(feature = "mpi")]
pub(super) fn encode_panic(panic: &dyn std::fmt::Display) -> Vec<u8> {
    RemoteError::Failed(format!("{PANIC_MESSAGE}: {panic}")).encode()
}

/// An error in the form in which ranks send it.
#[derive(Serialize, Deserialize)]
pub(super) enum RemoteError {
    Input(String),
    Usage(String),
    Stopped,
    Failed(String),
}

impl RemoteError {
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
            // `Usage` gives the exit code of wrong input; the text already names the file and line.
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
    fn decode(report: &[u8]) -> Self {
        let unclear = |_| Self::Failed("failed, and its report cannot be decoded".into());
        postcard::from_bytes(report).unwrap_or_else(unclear)
    }
}
