//! Conversion of any mesh file to the fast format: binary little-endian PLY.
//!
//! The file is written under a temporary name, synced and renamed, so an existing file is replaced by a
//! whole one or not at all.

mod flatten;
mod write_ply;

pub use write_ply::{PlyReport, write_ply};

use super::mesh_file::read_model;
use super::{ModelOptions, gltf};
use crate::error::{Diagnostic, Error, Result};
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// The result of [`convert`].
#[derive(Debug, Clone, PartialEq)]
pub struct ConvertReport {
    /// Content of the written file.
    pub written: PlyReport,
    /// Warnings about data that was left out.
    pub warnings: Vec<Diagnostic>,
}

/// Reads the mesh file `input` and writes `output`, whose ending must be `.ply`. Animated meshes of a glTF file stand as at
/// `time`, seconds; `None`: 0.
///
/// Normals and vertex colours are the input's, or none: none are computed. Materials, textures and lights have no
/// place in a PLY file and are left out with a warning.
///
/// Errors: those of [`super::load_model`], `Error::Usage` for another ending and for a time of another format, `Error::Io`.
pub fn convert(input: &Path, output: &Path, time: Option<f64>) -> Result<ConvertReport> {
    if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
        let name = output.display();
        return Err(Error::Usage(format!("cannot write {name}: meshes are written as .ply only")));
    }
    if time.is_some() && !gltf::is_named(input) {
        return Err(Error::Usage("`--time` is for glTF files, .glb and .gltf".into()));
    }
    let usual = ModelOptions::without_camera();
    let model = read_model(input, &ModelOptions { time: time.unwrap_or(usual.time), ..usual })?;
    let mut warnings = model.warnings;
    let world = model.world;
    let mut lost = Vec::new();
    let plain = [super::DEFAULT_MATERIAL, super::COLOURED_MATERIAL];
    if world.materials.iter().any(|m| !plain.contains(&m.name.as_str())) {
        lost.push("materials");
    }
    if !world.textures.is_empty() {
        lost.push("textures");
    }
    if !world.masks.is_empty() {
        lost.push("cut-outs");
    }
    if !world.lights.is_empty() {
        lost.push("lights");
    }
    if !lost.is_empty() {
        let message = format!("a PLY file holds no {}: left out", lost.join(", "));
        warnings.push(Diagnostic::new(input, message));
    }
    if world.lights.iter().any(|light| light.is_area()) {
        warnings.push(Diagnostic::new(input, "the surfaces of area lights were left out too"));
    }
    if !world.spheres.is_empty() {
        let message = "exact spheres became 80,000 triangles each";
        warnings.push(Diagnostic::new(input, message));
    }
    let written = write_atomically(output, |file| write_ply(&world, file, output))?;
    Ok(ConvertReport { written, warnings })
}

/// Runs `write` on a temporary file beside `path`, then gives it that name.
fn write_atomically<T>(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<T>) -> Result<T> {
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    // The system's own word, without the temporary file's name; `path` is what the user knows.
    let failed = |action, e: io::Error| Error::io(action, path, e.kind().into());
    if fs::metadata(path).is_ok_and(|m| !m.is_file()) {
        // A rename would put a file in a device's place.
        return Err(failed(
            "write, since it is no regular file,",
            io::ErrorKind::InvalidInput.into(),
        ));
    }
    fs::create_dir_all(folder).map_err(|e| failed("make the folder of", e))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tweenray-").suffix(".part");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(|e| failed("write", e))?;
    let result = write(file.as_file_mut())?;
    file.as_file().sync_all().map_err(|e| Error::io("write", path, e))?;
    file.persist(path).map_err(|e| Error::io("rename", path, e.error))?;
    Ok(result)
}

#[cfg(test)]
mod tests;
