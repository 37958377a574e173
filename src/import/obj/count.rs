//! Splits a text into chunks at line ends, and counts the statements of each.

use crate::error::{Error, Result};
use crate::import::lines::Lines;
use std::path::Path;

/// Chunks are about this long: small enough for even loads, large enough to cost nothing.
const CHUNK: usize = 1 << 21;

/// Statements and lines before a place in the file.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    /// Physical lines.
    pub lines: usize,
    /// `v`, `vt` and `vn` statements.
    pub positions: usize,
    pub uvs: usize,
    pub normals: usize,
}

impl Counts {
    pub fn plus(&self, more: &Self) -> Self {
        Self {
            lines: self.lines + more.lines,
            positions: self.positions + more.positions,
            uvs: self.uvs + more.uvs,
            normals: self.normals + more.normals,
        }
    }

    /// Errors: more values than a 32-bit index can name.
    pub fn check(&self, file: &Path) -> Result<()> {
        let most = self.positions.max(self.uvs).max(self.normals);
        if most >= u32::MAX as usize {
            return Err(Error::input(file, format!("{most} vertices; 4294967294 is the most")));
        }
        Ok(())
    }
}

/// Chunks of whole logical lines.
pub(super) fn split(text: &[u8]) -> Vec<&[u8]> {
    split_by(text, CHUNK)
}

fn split_by(mut text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut chunks = Vec::with_capacity(text.len() / size + 1);
    while text.len() > size {
        let Some(end) = memchr::memchr_iter(b'\n', &text[size..])
            .map(|at| size + at)
            .find(|end| !ends_in_backslash(&text[..*end]))
        else {
            break;
        };
        let (chunk, rest) = text.split_at(end + 1);
        chunks.push(chunk);
        text = rest;
    }
    chunks.push(text);
    chunks
}

fn ends_in_backslash(text: &[u8]) -> bool {
    text.strip_suffix(b"\r").unwrap_or(text).last() == Some(&b'\\')
}

/// Counts the statements and lines of a chunk.
pub(super) fn count(chunk: &[u8]) -> Counts {
    let mut lines = Lines::new(chunk, 0);
    let mut counts = Counts::default();
    while let Some(line) = lines.next_line() {
        match line.words().next() {
            Some(b"v") => counts.positions += 1,
            Some(b"vt") => counts.uvs += 1,
            Some(b"vn") => counts.normals += 1,
            _ => {}
        }
    }
    counts.lines = lines.line_number();
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_are_whole_logical_lines_and_lose_nothing() {
        let text = b"v 1 2 3\nf 1 \\\r\n2 3\n# C:\\\n\nvt 0 0\nvn 0 0 1";
        for size in 1..text.len() {
            let chunks = split_by(text, size);
            assert_eq!(chunks.concat(), text);
            let counts = chunks.iter().fold(Counts::default(), |sum, c| sum.plus(&count(c)));
            assert_eq!((counts.positions, counts.uvs, counts.normals), (1, 1, 1));
            assert_eq!(counts.lines, 7, "chunks of {size}");
        }
    }
}
