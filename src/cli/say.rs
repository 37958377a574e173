//! Printing: results on stdout, messages on stderr. A closed pipe is not an error; any other failure
//! to write a result (a full disk) is.

use crate::error::{Error, Result};
use serde::Serialize;
use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// A line on stdout.
pub fn result(line: impl Display) -> Result<()> {
    text(&format!("{line}\n"))
}

/// Text on stdout as it is.
pub fn text(text: &str) -> Result<()> {
    let mut out = std::io::stdout();
    told(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// `value` as JSON on stdout.
pub fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(value);
    result(text.map_err(|e| Error::Failed(format!("cannot write JSON: {e}")))?)
}

/// The result of writing to stdout; a closed pipe is not an error.
pub fn told(written: std::io::Result<()>) -> Result<()> {
    match written {
        // Nobody reads on (`tweenray inspect scene.toml | head -1`).
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|e| Error::io("write to", "stdout", e)),
    }
}

/// A line on stderr as it is.
pub fn aside(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// `warning: …`
pub fn warning(what: impl Display) {
    aside(format_args!("warning: {what}"));
}

/// `note: …`
pub fn note(what: impl Display) {
    aside(format_args!("note: {what}"));
}

/// `error: …`, with the help lines that the error carries.
pub fn error(error: &Error) {
    aside(format_args!("error: {error}"));
}

/// Calls `say` with each of `lines`, unless `quiet`.
pub fn unless<T>(quiet: bool, lines: &[T], say: fn(&T)) {
    if !quiet {
        lines.iter().for_each(say);
    }
}
