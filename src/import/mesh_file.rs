//! Mesh files to world-space data: OBJ with MTL, the course's OBJ dialect, PLY, glTF.

use super::{Model, ModelOptions, gltf, normals, obj, ply, source};
use crate::error::{Diagnostic, Error, Result};
use crate::scene::NormalPolicy;
use std::path::Path;

/// Reads a mesh file; the ending and, for `.obj`, the content choose the reader.
///
/// Triangles without area are dropped with one warning; so are vertices that no triangle uses.
///
/// Errors: `Error::Input` with the line (text) or byte offset (binary), for anything that is
/// not a finite number, an index out of range, or a file without faces; `Error::Io`.
pub fn load_model(path: &Path, normals: NormalPolicy) -> Result<Model> {
    load_model_with(path, normals, &ModelOptions::default())
}

/// As [`load_model`], with options for formats that hold cameras and animations.
pub fn load_model_with(
    path: &Path,
    normals: NormalPolicy,
    options: &ModelOptions,
) -> Result<Model> {
    let mut model = read_model(path, options)?;
    // In glTF a mesh without normals is flat.
    if gltf::is_named(path) && matches!(normals, NormalPolicy::Auto { .. }) {
        return Ok(model);
    }
    for mesh in &mut model.world.meshes {
        normals::apply(mesh, normals);
    }
    Ok(model)
}

/// As [`load_model_with`]; normals are the file's, or none.
pub(super) fn read_model(path: &Path, options: &ModelOptions) -> Result<Model> {
    let bytes = source::read(path)?;
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    match ending.as_str() {
        "obj" => obj::read(path, &bytes),
        "ply" => ply::read(path, bytes),
        "glb" | "gltf" => gltf::read(path, &bytes, options),
        _ => Err(Error::from(
            Diagnostic::new(path, format!("`.{ending}` is no mesh format that can be read"))
                .help("meshes are .obj, .ply, .glb and .gltf; scene files end in .toml"),
        )),
    }
}

#[cfg(test)]
mod tests;
