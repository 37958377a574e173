//! Bytes of an input file, and warnings gathered while reading it.

use crate::error::{Diagnostic, Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reads a whole file at once.
///
/// No memory map: mapping is `unsafe` in Rust, since another process may truncate the file
/// under the reader, and costs more than it saves here (`docs/decisions`).
///
/// Errors: `Error::Io` with the path; a folder or a device is an `Error::Input`.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let about = std::fs::metadata(path).map_err(|e| Error::io("read", path, e))?;
    if !about.is_file() {
        return Err(Error::input(path, "this is not a regular file"));
    }
    std::fs::read(path).map_err(|e| Error::io("read", path, e))
}

/// Things worth one warning each, however often they occur: how often, and where first.
#[derive(Debug, Default)]
pub(super) struct Notes {
    seen: BTreeMap<String, Note>,
}

#[derive(Debug, Clone, Copy)]
struct Note {
    count: usize,
    line: Option<usize>,
}

impl Notes {
    /// Counts one more `what`, seen at `line`.
    pub fn add(&mut self, what: &str, line: impl Into<Option<usize>>) {
        self.add_many(what, 1, line);
    }

    /// Counts `count` more of `what`; none is no note.
    pub fn add_many(&mut self, what: &str, count: usize, line: impl Into<Option<usize>>) {
        let line = line.into();
        if count == 0 {
        } else if let Some(note) = self.seen.get_mut(what) {
            note.count += count;
            note.line = match (note.line, line) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            };
        } else {
            self.seen.insert(what.to_owned(), Note { count, line });
        }
    }

    /// Takes over all of `other`.
    pub fn merge(&mut self, other: Self) {
        for (what, note) in other.seen {
            self.add_many(&what, note.count, note.line);
        }
    }

    /// One warning per kind, at the place of its first occurrence.
    pub fn into_warnings(self, file: &Path) -> Vec<Diagnostic> {
        let warning = |(what, note): (String, Note)| {
            let times =
                if note.count > 1 { format!(" ({} times)", note.count) } else { String::new() };
            Diagnostic { line: note.line, ..Diagnostic::new(file, what + &times) }
        };
        self.seen.into_iter().map(warning).collect()
    }
}

/// A fault with its place, before the file's name is known.
#[derive(Debug)]
pub(super) struct Fault {
    line: Option<usize>,
    message: String,
}

impl Fault {
    /// A fault on a line of a text.
    pub fn new(line: usize, message: impl Into<String>) -> Self {
        Self { line: Some(line), message: message.into() }
    }

    /// A fault in binary data.
    pub fn at_byte(offset: usize, message: impl Into<String>) -> Self {
        Self { line: None, message: format!("at byte {offset}: {}", message.into()) }
    }

    /// The error for `file`.
    pub fn at(self, file: &Path) -> Error {
        Diagnostic { line: self.line, ..Diagnostic::new(file, self.message) }.into()
    }
}

/// The path of `name` as a file at `beside` names it: relative to that file's folder, with
/// backslashes as on Windows where no file has that very name.
pub(super) fn beside(beside: &Path, name: &str) -> PathBuf {
    let folder = beside.parent().unwrap_or(Path::new(""));
    let exact = folder.join(name);
    if name.contains('\\') && !exact.exists() {
        folder.join(name.replace('\\', "/"))
    } else {
        exact
    }
}
