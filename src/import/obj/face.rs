//! Faces as corners: indices into positions, texture coordinates and normals.

use super::count::Counts;
use super::{Fault, Words};
use crate::import::lines::show;
use crate::import::polygon::MAX_CONCAVE_CORNERS;

/// Index of an attribute that a corner does not have.
pub(super) const MISSING: u32 = u32::MAX;

/// Faces of any number of corners, flat.
#[derive(Debug, Default)]
pub(super) struct Faces {
    /// Position index of each corner.
    pub v: Vec<u32>,
    /// Texture coordinate of each corner, or [`MISSING`]; empty while no corner has one.
    pub vt: Vec<u32>,
    /// Normal of each corner, or [`MISSING`]; empty while no corner has one.
    pub vn: Vec<u32>,
    /// One past the last corner of each face.
    pub ends: Vec<u32>,
    /// Number and line of the faces so large that triangulation may refuse them.
    pub large: Vec<(usize, usize)>,
}

impl Faces {
    /// Reads the corners after `f`. `so_far` counts the values before this line (negative
    /// indices count back from there), `total` those of the file.
    pub fn push(
        &mut self,
        words: Words<'_>,
        line: usize,
        so_far: &Counts,
        total: &Counts,
    ) -> Result<(), Fault> {
        let mut rest = words;
        let start = self.v.len();
        while let Some(word) = rest.value() {
            self.corner(word, so_far, total).map_err(|message| Fault::new(line, message))?;
        }
        let corners = self.v.len() - start;
        if corners < 3 {
            return Err(Fault::new(line, format!("a face with {corners} corners; 3 is the least")));
        }
        if self.v.len() >= MISSING as usize {
            return Err(Fault::new(line, "too many faces before this line"));
        }
        for list in [&mut self.vt, &mut self.vn] {
            if !list.is_empty() {
                list.resize(self.v.len(), MISSING);
            }
        }
        if corners > MAX_CONCAVE_CORNERS {
            self.large.push((self.ends.len(), line));
        }
        self.ends.push(self.v.len() as u32);
        Ok(())
    }

    fn corner(&mut self, word: &[u8], so_far: &Counts, total: &Counts) -> Result<(), String> {
        let mut fields = word.split(|b| *b == b'/');
        let at = self.v.len();
        let v = fields.next().unwrap_or(b"");
        self.v.push(resolve(v, "vertex", so_far.positions, total.positions)?);
        if let Some(vt) = fields.next().filter(|f| !f.is_empty()) {
            let index = resolve(vt, "texture coordinate", so_far.uvs, total.uvs)?;
            self.vt.resize(at, MISSING);
            self.vt.push(index);
        }
        if let Some(vn) = fields.next().filter(|f| !f.is_empty()) {
            let index = resolve(vn, "normal", so_far.normals, total.normals)?;
            self.vn.resize(at, MISSING);
            self.vn.push(index);
        }
        if fields.next().is_some() {
            return Err(format!("`{}` has more than vertex/texture/normal", show(word)));
        }
        Ok(())
    }
}

/// An index of the file (from 1, or negative: back from `so_far`) as ours, from 0.
#[inline]
fn resolve(field: &[u8], what: &str, so_far: usize, total: usize) -> Result<u32, String> {
    let index = integer(field)
        .ok_or_else(|| format!("`{}` is no {what} index: a whole number is needed", show(field)))?;
    let at = if index < 0 { so_far as i64 + index } else { index - 1 };
    if index != 0 && at >= 0 && at < total as i64 {
        return Ok(at as u32);
    }
    Err(match index {
        0 => format!("{what} index 0: indices count from 1"),
        i if i < 0 => format!("{what} index {i}, but only {so_far} come before this line"),
        i => format!("{what} index {i}, but the file has only {total}"),
    })
}

#[inline]
fn integer(field: &[u8]) -> Option<i64> {
    let (negative, digits) = match field {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut value = 0i64;
    for digit in digits {
        let digit = digit.wrapping_sub(b'0');
        if digit > 9 {
            return None;
        }
        value = 10 * value + i64::from(digit);
    }
    Some(if negative { -value } else { value })
}
