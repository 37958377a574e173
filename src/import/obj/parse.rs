//! Reads one chunk of an OBJ file: every field is checked here, with its line.

use super::count::Counts;
use super::face::Faces;
use super::{Fault, expected, name_of};
use crate::import::colours;
use crate::import::lines::{Lines, Words, number, show};
use crate::import::source::Notes;
use crate::math::{DVec3, Vec2, Vec3};

/// The content of a chunk, in order.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub positions: Vec<DVec3>,
    /// Colours of the positions, shares of the largest sRGB code, up to the last one that has any; [`UNCOLOURED`] of
    /// others.
    pub colours: Vec<[f32; 3]>,
    pub uvs: Vec<Vec2>,
    /// Normals: unit, or zero where the file's is zero or not finite.
    pub normals: Vec<Vec3>,
    pub faces: Faces,
    /// `usemtl` statements: the first face with the material, line and name.
    pub materials: Vec<(usize, usize, String)>,
    /// `mtllib` statements: line and name.
    pub libraries: Vec<(usize, String)>,
    pub notes: Notes,
}

/// The colour of a position that has none.
pub(super) const UNCOLOURED: [f32; 3] = [f32::NAN; 3];

/// Statements that are ignored without a warning, since they do not affect polygons.
const QUIET: [&[u8]; 8] = [b"o", b"g", b"s", b"mg", b"bevel", b"c_interp", b"d_interp", b"lod"];

/// Reads a chunk that starts at `start` in a file that holds `total`.
pub(super) fn parse(chunk: &[u8], start: Counts, total: Counts) -> Result<Part, Fault> {
    let mut part = Part::default();
    let mut lines = Lines::new(chunk, start.lines + 1);
    while let Some(line) = lines.next_line() {
        let mut words = line.words();
        let Some(keyword) = words.next() else { continue };
        let fault = |message: String| Fault::new(line.number, message);
        match keyword {
            b"v" => part.position(words, line.number).map_err(fault)?,
            b"vt" => part.uv(words).map_err(fault)?,
            b"vn" => part.normal(words, line.number).map_err(fault)?,
            b"f" | b"fo" => {
                let so_far = Counts {
                    lines: 0,
                    positions: start.positions + part.positions.len(),
                    uvs: start.uvs + part.uvs.len(),
                    normals: start.normals + part.normals.len(),
                };
                part.faces.push(words, line.number, &so_far, &total)?;
            }
            b"usemtl" => {
                part.materials.push((part.faces.ends.len(), line.number, name_of(&words)));
            }
            b"mtllib" if words.rest().is_empty() => {
                return Err(fault("`mtllib` without a file name".into()));
            }
            b"mtllib" => part.libraries.push((line.number, name_of(&words))),
            _ if keyword[0] == b'#' || QUIET.contains(&keyword) => {}
            b"l" | b"p" => part.notes.add("lines and points were left out", line.number),
            _ => part.other(keyword, line.number).map_err(fault)?,
        }
    }
    Ok(part)
}

impl Part {
    fn position(&mut self, mut words: Words<'_>, line: usize) -> Result<(), String> {
        let all = words;
        let mut fields = [0.0; 8];
        let mut count = 0;
        while let Some(word) = words.value() {
            *fields.get_mut(count).ok_or_else(|| expected("v", "at most 8 numbers", &all))? =
                number(word)?;
            count += 1;
        }
        let [x, y, z, w, ..] = fields;
        let mut p = DVec3::new(x, y, z);
        match count {
            3 => {}
            4 if w == 1.0 => {}
            4 => {
                p /= w;
                if !p.is_finite() {
                    return Err(format!("`v` with the weight {w:e} lies at infinity"));
                }
            }
            6 | 7 => {
                if count == 7 {
                    self.notes.add("the alpha of vertex colours was ignored", line);
                }
                self.colour([fields[3], fields[4], fields[5]].map(|c| c as f32), line)?;
            }
            8 => self.notes.add("vertex colours beside a weight were ignored", line),
            _ => return Err(expected("v", "x y z, x y z w or x y z r g b", &all)),
        }
        self.positions.push(p);
        Ok(())
    }

    /// Notes the colour of the position that is about to be added.
    fn colour(&mut self, colour: [f32; 3], line: usize) -> Result<(), String> {
        if !colour.iter().all(|c| c.is_finite()) {
            return Err("a vertex colour is too large a number".into());
        }
        if colours::strays(&colour) {
            self.notes.add(colours::STRAYED, line);
        }
        self.colours.resize(self.positions.len(), UNCOLOURED);
        self.colours.push(colour);
        Ok(())
    }

    fn uv(&mut self, mut words: Words<'_>) -> Result<(), String> {
        let all = words;
        let u = words.value().ok_or_else(|| expected("vt", "u v", &all)).and_then(number_f32)?;
        let v = words.value().map_or(Ok(0.0), number_f32)?;
        words.value().map_or(Ok(0.0), number_f32)?;
        if words.value().is_some() {
            return Err(expected("vt", "one to three numbers", &all));
        }
        self.uvs.push(Vec2::new(u, v));
        Ok(())
    }

    fn normal(&mut self, mut words: Words<'_>, line: usize) -> Result<(), String> {
        let all = words;
        let mut n = [0.0; 3];
        for c in &mut n {
            let word = words.value().ok_or_else(|| expected("vn", "x y z", &all))?;
            *c = std::str::from_utf8(word)
                .ok()
                .and_then(|s| s.parse().ok())
                .ok_or_else(|| format!("`{}` is not a number", show(word)))?;
        }
        if words.value().is_some() {
            return Err(expected("vn", "three numbers", &all));
        }
        let unit = crate::import::normals::unit_or_zero(DVec3::from_array(n));
        if unit == Vec3::ZERO {
            self.notes.add(crate::import::normals::UNUSABLE, line);
        }
        self.normals.push(unit);
        Ok(())
    }

    fn other(&mut self, keyword: &[u8], line: usize) -> Result<(), String> {
        let word = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
        if keyword.len() > 16 || !keyword.iter().all(word) || keyword[0].is_ascii_digit() {
            return Err(format!("`{}` is not a statement of an OBJ file", show(keyword)));
        }
        self.notes.add(&format!("statements `{}` were left out", show(keyword)), line);
        Ok(())
    }
}

/// A number that is finite as f32 too.
fn number_f32(word: &[u8]) -> Result<f32, String> {
    let value = number(word)? as f32;
    if value.is_finite() { Ok(value) } else { Err(format!("`{}` is too large", show(word))) }
}
