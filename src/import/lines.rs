//! Statements of a line-based text format (OBJ, MTL, the course's dialect), with line numbers.
//!
//! Reads bytes, since files are not always UTF-8, and returns one logical line at a time: `\` at a
//! line's end joins the next line (not in comments, which may hold Windows paths), and CR before LF
//! is dropped.

use crate::error::{Diagnostic, Error, Result};
use std::path::Path;

/// Walks over the logical lines of a text.
pub(super) struct Lines<'a> {
    text: &'a [u8],
    line: usize,
    joined: Vec<u8>,
}

/// One logical line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line<'a> {
    /// Number of its first physical line.
    pub number: usize,
    /// Its text without the line end.
    pub text: &'a [u8],
}

impl<'a> Lines<'a> {
    /// Walks over `text`, whose first line has the number `first_line`.
    pub fn new(text: &'a [u8], first_line: usize) -> Self {
        Self { text, line: first_line, joined: Vec::new() }
    }

    /// The next logical line.
    pub fn next_line(&mut self) -> Option<Line<'_>> {
        let number = self.line;
        let text = self.physical()?;
        if text.last() != Some(&b'\\') || Words(text).next().is_some_and(|w| w[0] == b'#') {
            return Some(Line { number, text });
        }
        self.joined.clear();
        let mut part = text;
        while let Some((b'\\', before)) = part.split_last() {
            self.joined.extend_from_slice(before);
            self.joined.push(b' ');
            part = self.physical().unwrap_or(b"");
        }
        self.joined.extend_from_slice(part);
        Some(Line { number, text: &self.joined })
    }

    /// Number of the line that comes next.
    pub fn line_number(&self) -> usize {
        self.line
    }

    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.text.is_empty() {
            return None;
        }
        let end = memchr::memchr(b'\n', self.text).unwrap_or(self.text.len());
        let (line, rest) = self.text.split_at(end);
        self.text = rest.get(1..).unwrap_or(b"");
        self.line += 1;
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

impl<'a> Line<'a> {
    /// Its words up to a `#` that starts a word.
    pub fn words(&self) -> Words<'a> {
        Words(self.text)
    }
}

/// The words of a line: separated by blanks, ended by a word that starts with `#`, which
/// [`Words::next`] still gives when it is the first it is asked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Words<'a>(&'a [u8]);

impl<'a> Words<'a> {
    /// The words of `text`.
    pub fn new(text: &'a [u8]) -> Self {
        Self(text)
    }

    /// The rest of the line, trimmed; in names `#` starts no comment ("Material #25").
    pub fn rest(&self) -> &'a [u8] {
        self.0.trim_ascii()
    }

    /// The next word that is not part of a trailing comment.
    #[inline]
    pub fn value(&mut self) -> Option<&'a [u8]> {
        let word = self.next()?;
        if word[0] == b'#' {
            self.0 = b"";
            return None;
        }
        Some(word)
    }
}

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let is_blank = |b: &u8| b.is_ascii_whitespace() || *b == 0x0b;
        let start = self.0.iter().position(|b| !is_blank(b))?;
        let text = &self.0[start..];
        let end = text.iter().position(is_blank).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        self.0 = rest;
        Some(word)
    }
}

/// Checks that `bytes` are not UTF-16 or binary, and drops a UTF-8 byte order mark.
pub(super) fn check_text<'a>(file: &Path, bytes: &'a [u8]) -> Result<&'a [u8]> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err(Error::from(
            Diagnostic::new(file, "the text is UTF-16").line(1).help("save it as UTF-8"),
        ));
    }
    if let Some(at) = memchr::memchr(0, bytes) {
        let line = 1 + memchr::memchr_iter(b'\n', &bytes[..at]).count();
        return Err(Error::from(
            Diagnostic::new(file, "a zero byte: this is not a text file").line(line),
        ));
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// A finite number.
///
/// Errors: the word as it stands, and what is wrong with it.
#[inline]
pub(super) fn number(word: &[u8]) -> std::result::Result<f64, String> {
    match std::str::from_utf8(word).ok().and_then(|s| s.parse::<f64>().ok()) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(format!("`{}` is not a finite number", show(word))),
        None => Err(format!("`{}` is not a number", show(word))),
    }
}

/// A word for a message: lossy UTF-8, control characters escaped, cut after 40 characters.
pub(super) fn show(word: &[u8]) -> String {
    let text = String::from_utf8_lossy(word);
    let mut short: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(usize, String)> {
        let mut lines = Lines::new(text.as_bytes(), 1);
        let mut out = Vec::new();
        while let Some(line) = lines.next_line() {
            out.push((line.number, String::from_utf8_lossy(line.text).into_owned()));
        }
        out
    }

    #[test]
    fn joins_continued_lines_and_keeps_line_numbers() {
        let text = "v 1 \\\r\n2 \\\n3\r\n# C:\\meshes\\\nf 1";
        let expected = [(1, "v 1  2  3"), (4, "# C:\\meshes\\"), (5, "f 1")];
        assert_eq!(all(text), expected.map(|(n, s)| (n, s.to_owned())));
    }

    #[test]
    fn a_continuation_at_the_end_of_the_file_ends_there() {
        assert_eq!(all("f 1 2 \\"), [(1, "f 1 2  ".to_owned())]);
    }

    #[test]
    fn numbers_are_finite() {
        assert_eq!(number(b"-1.5e3"), Ok(-1500.0));
        for bad in [&b"nan"[..], b"inf", b"1e999", b"1,5", b"", b"\xff", b"0x10"] {
            assert!(number(bad).is_err(), "{}", show(bad));
        }
    }
}
