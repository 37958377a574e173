//! Wavefront OBJ to world-space meshes, one per material.
//!
//! The text is read in chunks on all threads, twice: [`count`] finds out how many vertices come
//! before each chunk, [`parse`] then checks and reads every field, [`assemble`] makes meshes.
//! `tobj` reads the material libraries ([`super::mtl`]); its geometry reader is the oracle of
//! our tests, not used here: see `docs/decisions`.
//!
//! Not done: curves and surfaces, `l` and `p` elements, alpha of vertex colours, smoothing groups. Each
//! is named in a warning, smoothing groups excepted ([`crate::scene::NormalPolicy`] has a
//! crease angle instead).

mod assemble;
mod count;
mod face;
mod parse;

use super::lines::{Lines, Words, check_text, show};
use super::model::Model;
use super::source::{Fault, Notes};
use super::{course, mtl};
use crate::error::{Error, Result};
use rayon::prelude::*;
use std::path::Path;

/// Reads an OBJ file, or one in the course's dialect. Normals are the file's, or none.
///
/// Errors: `Error::Input` with the line.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Model> {
    let text = check_text(path, bytes)?;
    if is_course_dialect(text) {
        return course::read(path, text);
    }
    let chunks = count::split(text);
    let mut at = count::Counts::default();
    let mut starts = Vec::with_capacity(chunks.len());
    for counts in chunks.par_iter().map(|c| count::count(c)).collect::<Vec<_>>() {
        starts.push(at);
        at = at.plus(&counts);
    }
    let total = at;
    total.check(path)?;
    let parts: Vec<parse::Part> = chunks
        .par_iter()
        .zip(&starts)
        .map(|(chunk, start)| parse::parse(chunk, *start, total))
        .collect::<std::result::Result<_, _>>()
        .map_err(|fault: Fault| fault.at(path))?;
    drop(chunks);
    finish(path, parts)
}

fn finish(path: &Path, mut parts: Vec<parse::Part>) -> Result<Model> {
    if parts.iter().all(|p| p.faces.ends.is_empty()) {
        let points: usize = parts.iter().map(|p| p.positions.len()).sum();
        let message =
            format!("no faces: the file holds {points} vertices and no surface to render");
        return Err(Error::input(path, message));
    }
    let mut notes = Notes::default();
    let mut model = Model { files: vec![path.to_path_buf()], ..Model::default() };
    let mut libraries = mtl::Libraries::default();
    for part in &mut parts {
        notes.merge(std::mem::take(&mut part.notes));
        for (line, name) in &part.libraries {
            libraries.load(path, *line, name, &mut model)?;
        }
    }
    model.warnings.extend(notes.into_warnings(path));
    assemble::assemble(path, parts, &mut libraries, &mut model)?;
    Ok(model)
}

/// Whether a line opens a material as the course's files do, selects one by number or places a
/// sphere: none of these is OBJ. Such a statement must come within the first 20,000 lines.
fn is_course_dialect(text: &[u8]) -> bool {
    let mut lines = Lines::new(text, 1);
    while let Some(line) = lines.next_line().filter(|line| line.number <= 20_000) {
        let mut words = line.words();
        let found = match words.next() {
            Some(b"material") => words.value().is_none(),
            Some(b"m") => words.value().is_some_and(|w| w.iter().all(u8::is_ascii_digit)),
            Some(b"s") => words.take_while(|w| w[0] != b'#').count() == 4,
            _ => false,
        };
        if found {
            return true;
        }
    }
    false
}

/// The name that follows a keyword, as text.
fn name_of(words: &Words<'_>) -> String {
    String::from_utf8_lossy(words.rest()).into_owned()
}

/// A message about a statement that has the wrong fields.
fn expected(statement: &str, fields: &str, words: &Words<'_>) -> String {
    format!("`{statement}` takes {fields}, not `{}`", show(words.rest()))
}

#[cfg(test)]
mod tests;
