//! Words to people: results on stdout, the rest on stderr. A reader that went away is no fault.

use crate::error::Error;
use std::fmt::Display;
use std::io::Write;

/// A line on stdout.
pub fn result(line: impl Display) {
    // A broken pipe means that nobody reads on (`tweenray inspect scene.toml | head -1`).
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Text on stdout as it is.
pub fn text(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
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
