//! Errors in the scene file's text as a [`Diagnostic`] with line, column and advice.

use super::SceneFile;
use super::at::Span;
use crate::error::{Diagnostic, Error, Result};
use crate::scene::Light;
use std::path::{Path, PathBuf};

/// Larger scene files are refused: geometry belongs in mesh files.
const MAX_BYTES: u64 = 16 << 20;

/// The kinds of what comes in kinds.
fn kinds() -> String {
    let lights =
        Light::written_kinds().map(|kind| format!("`{kind}`")).collect::<Vec<_>>().join(", ");
    format!(
        "a light has one of {lights}; a step of `transform` one of `translate`, `rotate`, `scale` and \
         `matrix`"
    )
}

/// A scene file's text and name.
pub(super) struct Source {
    pub path: PathBuf,
    pub text: String,
}

impl Source {
    /// Reads the file.
    ///
    /// Errors: `Error::Io`; `Error::Input` for a file over 16 MB or one that is not UTF-8.
    pub fn read(path: &Path) -> Result<Self> {
        let about = std::fs::metadata(path).map_err(|e| Error::io("read", path, e))?;
        if !about.is_file() {
            return Err(Error::input(path, "this is not a regular file"));
        }
        if about.len() > MAX_BYTES {
            let message = format!("a scene file has at most {} MB", MAX_BYTES >> 20);
            let help = "put geometry into a mesh file and name it: file = \"mesh.ply\"";
            return Err(Diagnostic::new(path, message).help(help).into());
        }
        let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
        Self::from_bytes(path, bytes)
    }

    fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self> {
        let path = path.to_path_buf();
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self { path, text }),
            Err(e) => {
                let good = e.utf8_error().valid_up_to();
                let text = String::from_utf8_lossy(&e.as_bytes()[..good]).into_owned();
                let source = Self { path, text };
                Err(source.fault(&(good..good), "the file is not UTF-8 text from here on").into())
            }
        }
    }

    /// A diagnostic at the start of `span`.
    pub fn fault(&self, span: &Span, message: impl Into<String>) -> Diagnostic {
        let before = self.text.get(..span.start).unwrap_or(&self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        Diagnostic::new(&self.path, message).at(line, column)
    }

    /// A diagnostic about `name`, which is none of `known`.
    pub fn unknown(&self, span: &Span, what: &str, name: &str, known: &[&str]) -> Diagnostic {
        let fault = self.fault(span, format!("unknown {what} `{name}`"));
        match help_on_names(name, known) {
            Some(help) => fault.help(help),
            None => fault,
        }
    }

    /// The TOML reader's message, reworded.
    pub fn toml_fault(&self, error: &toml::de::Error) -> Diagnostic {
        let span = error.span().unwrap_or(0..0);
        let message = error.message();
        if let Some((number, whole)) = self.bare_point_at(&span) {
            let text =
                format!("TOML wants a digit on both sides of a number's point, not `{number}`");
            return self.fault(&span, text).help(format!("write {whole}"));
        }
        let unknown = message
            .strip_prefix("unknown field ")
            .map(|rest| ("key", rest))
            .or_else(|| message.strip_prefix("unknown variant ").map(|r| (self.kind_at(&span), r)));
        if let Some((what, rest)) = unknown {
            let names = quoted(rest);
            let (name, known) = names.split_first().unwrap_or((&"", &[]));
            return self.unknown(&span, what, name, known);
        }
        if let Some(name) = message.strip_prefix("missing field ") {
            return self.fault(&span, format!("the key {name} is missing"));
        }
        let is_no_kind = message.starts_with("wanted exactly 1 element");
        if is_no_kind || message == "wanted string or table" {
            if let Some(names) = self.names_at(&span) {
                return self.fault(&span, format!("expected {names}"));
            }
        }
        if is_no_kind {
            let text = "exactly one key that says the kind must stand here";
            return self.fault(&span, text).help(kinds());
        }
        self.fault(&span, in_plain_words(message))
    }

    /// The names of which one may stand in quotes in place of the value at `span`, where that is all that may. The TOML reader
    /// lists names only beside a name that is none of them, so it reads the text again with one there.
    fn names_at(&self, span: &Span) -> Option<String> {
        let (before, after) = (self.text.get(..span.start)?, self.text.get(span.end..)?);
        let with = |name: &str| {
            let error = toml::from_str::<SceneFile>(&format!("{before}\"{name}\"{after}")).err()?;
            error
                .span()
                .is_some_and(|at| at.start == span.start)
                .then(|| error.message().to_owned())
        };
        let told = with("")?;
        let names = quoted(told.strip_prefix("unknown variant ``, expected ")?);
        // A kind of light and the like is the key of a table, and no value.
        if with(names.first()?).is_some() {
            return None;
        }
        let names: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        let (last, others) = names.split_last()?;
        Some(if others.is_empty() {
            last.clone()
        } else {
            format!("{} or {last}", others.join(", "))
        })
    }

    /// A number like `.7` or `7.` at the start of `span` or around it, and how it is written in full.
    fn bare_point_at(&self, span: &Span) -> Option<(&str, String)> {
        let is_part = |c: char| c.is_ascii_digit() || "+-._eE".contains(c);
        let (before, after) = self.text.split_at_checked(span.start)?;
        let start = before.trim_end_matches(is_part).len();
        let number =
            &self.text[start..span.start + after.len() - after.trim_start_matches(is_part).len()];
        // A dotted key, a word or a text is none.
        let follows = before[..start].chars().next_back();
        if follows.is_some_and(|c| !c.is_whitespace() && !"=[,{".contains(c)) {
            return None;
        }
        let digits = number.trim_start_matches(['+', '-']);
        let (left, right) = digits.split_once('.')?;
        let starts_so = |text: &str| text.starts_with(|c: char| c.is_ascii_digit());
        let ends_so = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
        let sign = &number[..number.len() - digits.len()];
        let fits = !right.contains('.') && left.is_empty() == starts_so(right);
        let is_bare = fits && (left.is_empty() || ends_so(left)) && sign.len() <= 1;
        let zero = |text: &str| if starts_so(text) { String::new() } else { "0".into() };
        is_bare.then(|| (number, format!("{sign}{}{left}.{}{right}", zero(left), zero(right))))
    }

    /// An unknown name in quotes is a value, and so is one in an array; any other is a key.
    fn kind_at(&self, span: &Span) -> &'static str {
        let at = self.text.as_bytes().get(span.start);
        if matches!(at, Some(b'"' | b'\'' | b'[')) { "value" } else { "key" }
    }
}

/// "invalid type: X, expected Y" reads better the other way round.
fn in_plain_words(message: &str) -> String {
    if message == "wanted string or table" {
        return "expected a table".to_owned();
    }
    let swapped = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|prefix| message.strip_prefix(prefix)?.rsplit_once(", expected "));
    match swapped {
        Some((found, expected)) => {
            let found = match found {
                "map" => "a table or a date",
                "sequence" => "an array",
                other => other.trim_end_matches(" as i128").trim_end_matches(" as u128"),
            };
            let expected = if expected == "a sequence" { "an array" } else { expected };
            format!("expected {expected}, found {found}")
        }
        None => message.to_owned(),
    }
}

/// The parts of `text` between backquotes.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

fn help_on_names(name: &str, known: &[&str]) -> Option<String> {
    let list = || known.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
    match nearest(name, known) {
        Some(near) => Some(format!("did you mean `{near}`?")),
        None if known.is_empty() => None,
        None => Some(format!("valid here: {}", list())),
    }
}

/// Keys for how bright something is, each by its quantity. One light has another than the next.
const BRIGHTNESS: [&str; 3] = ["radiance", "irradiance", "intensity"];

/// The name of `known` that `name` most likely stands for; `None` where none is near.
pub(super) fn nearest<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    let lower = name.to_lowercase();
    let means_same = |k: &&&str| BRIGHTNESS.contains(&lower.as_str()) && BRIGHTNESS.contains(k);
    if let Some(same) = known.iter().find(means_same) {
        return Some(same);
    }
    known
        .iter()
        .map(|k| (strsim::normalized_damerau_levenshtein(&lower, &k.to_lowercase()), *k))
        .filter(|(likeness, _)| *likeness >= 0.5)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
}
