//! Checks an MTL file line by line and hands tobj a clean copy of it.

use super::image::{MapImage, MapKind};
use crate::error::{Diagnostic, Result};
use crate::import::lines::{Line, Lines, Words, check_text, number, show};
use crate::import::source::Fault;
use crate::import::source::Notes;
use std::fmt::Write;
use std::path::Path;

/// Data of a material that tobj does not return.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Source {
    /// Name, trimmed.
    pub name: String,
    /// Line of its `newmtl`.
    pub line: usize,
    /// `Tf`: share of light that passes, linear RGB.
    pub filter: Option<[f64; 3]>,
    /// `map_Kd`.
    pub texture: Option<MapImage>,
    /// `map_d`.
    pub mask: Option<MapImage>,
    /// `norm`, or `map_Bump` and `bump`, which may hold heights instead.
    pub normal_map: Option<BumpImage>,
    /// `Pr`: roughness.
    pub roughness: Option<f64>,
    /// `map_Pr`.
    pub roughness_map: Option<MapImage>,
    /// `Pm`: share that is metal.
    pub metallic: Option<f64>,
    /// `map_Ke`.
    pub emission_map: Option<MapImage>,
    /// `map_Pm`.
    pub metallic_map: Option<MapImage>,
    /// `Pc`: share under a clear coat.
    pub clearcoat: Option<f64>,
    /// `Pcr`: the coat's roughness.
    pub clearcoat_roughness: Option<f64>,
}

/// An image of normals or, perhaps, of heights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BumpImage {
    pub image: MapImage,
    /// Whether the statement is for normals alone.
    pub is_normal: bool,
    pub line: usize,
}

/// Reads the materials of a library: the data of this front, and tobj's.
pub(super) fn read(
    file: &Path,
    bytes: &[u8],
    warnings: &mut Vec<Diagnostic>,
) -> Result<Vec<(Source, tobj::Material)>> {
    let mut front = Front::default();
    let mut lines = Lines::new(check_text(file, bytes)?, 1);
    while let Some(line) = lines.next_line() {
        front.line(line).map_err(|message| Fault::new(line.number, message).at(file))?;
    }
    warnings.extend(std::mem::take(&mut front.notes).into_warnings(file));
    let (materials, _) = tobj::load_mtl_buf(&mut front.clean.as_bytes())
        .map_err(|e| crate::error::Error::input(file, format!("tobj: {e}")))?;
    Ok(front.sources.into_iter().zip(materials).collect())
}

#[derive(Default)]
struct Front {
    sources: Vec<Source>,
    /// The text for tobj: one statement per line, only those that [`super::meaning`] uses, with names replaced by
    /// numbers, since tobj trims names differently.
    clean: String,
    /// Whether the current material has a `d`.
    has_dissolve: bool,
    notes: Notes,
}

impl Front {
    fn line(&mut self, line: Line<'_>) -> std::result::Result<(), String> {
        let mut words = line.words();
        let Some(keyword) = words.next() else { return Ok(()) };
        if keyword[0] == b'#' {
            return Ok(());
        }
        if keyword == b"newmtl" {
            return self.open(words, line.number);
        }
        let text = String::from_utf8_lossy(keyword).into_owned();
        if self.sources.is_empty() {
            return Err(format!("`{}` before the first `newmtl`", show(keyword)));
        }
        match text.as_str() {
            "Kd" | "Ks" | "Ke" => self.colour(&text, words, f64::MAX),
            "Ka" => colour(&text, words, f64::MAX).map(|_| ()),
            "Tf" => self.filter(words),
            "Ni" => self.number("Ni", words, 1e-3, 1e3),
            "Ns" => number_in("Ns", words, f64::MIN, f64::MAX).map(|_| ()),
            "d" => self.dissolve(words),
            "Tr" => self.transparency(words),
            "illum" => self.illum(words),
            "Pr" | "Pm" | "Pc" | "Pcr" => self.share(&text, words),
            // Sheen and anisotropy, which exporters write beside these.
            "Ps" | "aniso" | "anisor" => number_in(&text, words, f64::MIN, f64::MAX).map(|_| ()),
            "map_Kd" | "map_Ke" | "map_d" => self.map(&text, MapKind::Image, words, line.number),
            "map_Pr" | "map_Pm" => self.map(&text, MapKind::Data, words, line.number),
            "norm" | "map_Bump" | "map_bump" | "bump" => {
                self.map(&text, MapKind::Normals, words, line.number)
            }
            "map_Ka" | "map_Ks" | "map_Ns" | "disp" | "decal" | "refl" | "map_Tr" | "map_refl"
            | "map_Kn" => {
                self.notes.add(&format!("textures by `{text}` are ignored"), line.number);
                Ok(())
            }
            _ => self.other(keyword, line.number),
        }
    }

    fn open(&mut self, words: Words<'_>, line: usize) -> std::result::Result<(), String> {
        let name = String::from_utf8_lossy(words.rest()).into_owned();
        if name.is_empty() {
            return Err("`newmtl` without a name".into());
        }
        self.put(format_args!("newmtl {}", self.sources.len()));
        self.has_dissolve = false;
        self.sources.push(Source { name, line, ..Source::default() });
        Ok(())
    }

    fn put(&mut self, statement: std::fmt::Arguments<'_>) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.clean, "{statement}");
    }

    fn colour(
        &mut self,
        keyword: &str,
        words: Words<'_>,
        max: f64,
    ) -> std::result::Result<(), String> {
        let [r, g, b] = colour(keyword, words, max)?;
        self.put(format_args!("{keyword} {r:e} {g:e} {b:e}"));
        Ok(())
    }

    fn filter(&mut self, words: Words<'_>) -> std::result::Result<(), String> {
        let filter = colour("Tf", words, 1.0)?;
        if let Some(source) = self.sources.last_mut() {
            source.filter = Some(filter);
        }
        Ok(())
    }

    /// A share of the extension for physically based materials.
    fn share(&mut self, keyword: &str, words: Words<'_>) -> std::result::Result<(), String> {
        // Some programs write more than 1 for matte.
        let share = Some(number_in(keyword, words, 0.0, f64::MAX)?.min(1.0));
        let Some(source) = self.sources.last_mut() else { return Ok(()) };
        match keyword {
            "Pr" => source.roughness = share,
            "Pm" => source.metallic = share,
            "Pc" => source.clearcoat = share,
            _ => source.clearcoat_roughness = share,
        }
        Ok(())
    }

    /// `map_Kd [options] file`, or another map.
    fn map(
        &mut self,
        keyword: &str,
        kind: MapKind,
        words: Words<'_>,
        line: usize,
    ) -> std::result::Result<(), String> {
        let image = MapImage::read(keyword, kind, words, line, &mut self.notes)?;
        let Some(source) = self.sources.last_mut() else { return Ok(()) };
        match kind {
            MapKind::Data if keyword == "map_Pm" => source.metallic_map = Some(image),
            MapKind::Data => source.roughness_map = Some(image),
            MapKind::Normals => {
                let is_normal = keyword == "norm";
                // `norm` wins.
                if is_normal || !source.normal_map.as_ref().is_some_and(|map| map.is_normal) {
                    source.normal_map = Some(BumpImage { image, is_normal, line });
                }
            }
            MapKind::Image if keyword == "map_Ke" => source.emission_map = Some(image),
            MapKind::Image if keyword == "map_d" => source.mask = Some(image),
            MapKind::Image => source.texture = Some(image),
        }
        Ok(())
    }

    fn number(
        &mut self,
        keyword: &str,
        words: Words<'_>,
        min: f64,
        max: f64,
    ) -> std::result::Result<(), String> {
        let value = number_in(keyword, words, min, max)?;
        self.put(format_args!("{keyword} {value:e}"));
        Ok(())
    }

    fn dissolve(&mut self, words: Words<'_>) -> std::result::Result<(), String> {
        let mut after = words;
        let halo = after.next() == Some(b"-halo");
        self.has_dissolve = true;
        self.number("d", if halo { after } else { words }, 0.0, 1.0)
    }

    /// `Tr` is 1 − d. If a material has both, `d` counts, since some programs write `Tr 1` for opaque.
    fn transparency(&mut self, words: Words<'_>) -> std::result::Result<(), String> {
        let value = number_in("Tr", words, 0.0, 1.0)?;
        if !self.has_dissolve {
            self.put(format_args!("d {:e}", 1.0 - value));
        }
        Ok(())
    }

    fn illum(&mut self, words: Words<'_>) -> std::result::Result<(), String> {
        let value = number_in("illum", words, 0.0, 10.0)?;
        if value.fract() != 0.0 {
            return Err(format!("`illum {value}`: a whole number from 0 to 10 is needed"));
        }
        self.put(format_args!("illum {value}"));
        Ok(())
    }

    fn other(&mut self, keyword: &[u8], line: usize) -> std::result::Result<(), String> {
        let word = |b: &u8| b.is_ascii_alphanumeric() || b"_-.".contains(b);
        if keyword.len() > 32 || !keyword.iter().all(word) || !keyword[0].is_ascii_alphabetic() {
            return Err(format!("`{}` is not a statement of an MTL file", show(keyword)));
        }
        self.notes.add(&format!("`{}` is ignored", show(keyword)), line);
        Ok(())
    }
}

/// One number (a grey) or three, not negative, at most `max`.
fn colour(keyword: &str, mut words: Words<'_>, max: f64) -> std::result::Result<[f64; 3], String> {
    let all = words;
    let mut values = Vec::with_capacity(3);
    while let Some(word) = words.value() {
        if matches!(word, b"spectral" | b"xyz") {
            return Err(format!("`{keyword} {}`: only RGB can be read", show(word)));
        }
        let value = number(word)?;
        if !(0.0..=max.min(f64::from(f32::MAX))).contains(&value) {
            return Err(format!("`{keyword}` holds {value}, which is no share of light"));
        }
        values.push(value);
    }
    match values[..] {
        [grey] => Ok([grey; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err(format!("`{keyword}` takes three numbers, not `{}`", show(all.rest()))),
    }
}

fn number_in(
    keyword: &str,
    mut words: Words<'_>,
    min: f64,
    max: f64,
) -> std::result::Result<f64, String> {
    let all = words;
    let word = words.value().ok_or_else(|| format!("`{keyword}` without a number"))?;
    if words.value().is_some() {
        return Err(format!("`{keyword}` takes one number, not `{}`", show(all.rest())));
    }
    let value = number(word)?;
    if !(min..=max).contains(&value) {
        return Err(match max {
            f64::MAX => format!("`{keyword} {value}`: at least {min} is possible"),
            _ => format!("`{keyword} {value}`: from {min} to {max} is possible"),
        });
    }
    Ok(value)
}
