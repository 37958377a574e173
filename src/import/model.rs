//! Mesh files to world-space data: OBJ with MTL, the course's OBJ dialect, PLY.

use crate::error::{Diagnostic, Result};
use crate::scene::{NormalPolicy, World};
use std::path::{Path, PathBuf};

/// What one mesh file holds, in the file's own coordinates.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Meshes, spheres, materials (at least one where there is a mesh), textures and lights
    /// (emitting quads of the course's dialect). `sky` stays at its default.
    pub world: World,
    /// What the user should know: dropped faces, ignored material keys.
    pub warnings: Vec<Diagnostic>,
    /// Every file read.
    pub files: Vec<PathBuf>,
}

/// Reads a mesh file; the ending and, for `.obj`, the content choose the reader.
pub fn load_model(path: &Path, normals: NormalPolicy) -> Result<Model> {
    let _ = (path, normals);
    todo!()
}
