//! Exit codes.

use crate::error::Error;
use std::process::ExitCode;

/// How the program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Everything requested is done.
    Done,
    /// The job failed.
    Failed,
    /// The request or its input is wrong.
    Usage,
    /// Frames of the sequence are missing.
    Incomplete,
    /// Stopped cleanly; the same command goes on. (`EX_TEMPFAIL` of sysexits.h.)
    Stopped,
    /// Stopped because its launcher was killed; the same command goes on.
    Orphaned,
}

impl Exit {
    /// How an error ends the program.
    pub fn of(error: &Error) -> Self {
        match error {
            Error::Usage(_) | Error::Input(_) => Self::Usage,
            Error::Stopped => Self::Stopped,
            Error::Io { .. } | Error::Embree(_) | Error::Failed(_) => Self::Failed,
        }
    }

    /// The number.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Usage => 2,
            Self::Incomplete => 3,
            Self::Stopped => 75,
            Self::Orphaned => 76,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

/// An input file that cannot be read is bad input, not a failed job.
pub fn as_input(error: Error) -> Error {
    match error {
        Error::Io { action, path, source } => {
            // ("read", but "read the folder")
            let it = if action.contains(' ') { "" } else { " it" };
            Error::input(path, format!("cannot {action}{it}: {source}"))
        }
        other => other,
    }
}
