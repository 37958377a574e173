//! The library's one error type: what went wrong, where, and what to do about it.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Shorthand for a result with [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Everything that can stop a job. The message says what, where and what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An input file is wrong at a known place.
    #[error("{0}")]
    Input(Box<Diagnostic>),
    /// The request makes no sense, whatever the files hold (an option out of range, say).
    #[error("{0}")]
    Usage(String),
    /// The operating system refused a file operation.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The failed action: "read", "write", "rename".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's own word.
        #[source]
        source: io::Error,
    },
    /// Embree refused something; the text is its own with our context.
    #[error("Embree: {0}")]
    Embree(String),
    /// The job cannot go on for a reason that is neither bad input nor an I/O error.
    #[error("{0}")]
    Failed(String),
    /// The job was asked to stop; what is finished is on disk and the job can be resumed.
    #[error("stopped; the same command goes on from here")]
    Stopped,
}

impl Error {
    /// An I/O error with the path it happened at.
    pub fn io(action: &'static str, path: impl AsRef<Path>, source: io::Error) -> Self {
        Self::Io { action, path: path.as_ref().to_path_buf(), source }
    }

    /// An input error at `file`, without a line.
    pub fn input(file: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Input(Box::new(Diagnostic::new(file, message)))
    }
}

impl From<Diagnostic> for Error {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Input(Box::new(diagnostic))
    }
}

/// A fault in an input file, with as exact a place as is known.
///
/// `Display` gives `file:line:column: message`, then `help` on a line of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The file as the user named it.
    pub file: PathBuf,
    /// Line, counted from 1.
    pub line: Option<usize>,
    /// Column in characters, counted from 1.
    pub column: Option<usize>,
    /// What is wrong.
    pub message: String,
    /// What to do about it ("did you mean `radius`?").
    pub help: Option<String>,
}

impl Diagnostic {
    /// A diagnostic for the whole file.
    pub fn new(file: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self {
            file: file.as_ref().to_path_buf(),
            line: None,
            column: None,
            message: message.into(),
            help: None,
        }
    }

    /// Adds the line (from 1).
    pub fn line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Adds line and column (both from 1).
    pub fn at(mut self, line: usize, column: usize) -> Self {
        self.line = Some(line);
        self.column = Some(column);
        self
    }

    /// Adds advice.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ":{column}")?;
        }
        write!(f, ": {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

/// `1 frame`, `2 frames`: a count in a message.
pub fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
