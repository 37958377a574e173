//! What the readers of mesh files make.

use crate::error::Diagnostic;
use crate::math::{Rgb, Vec3};
use crate::scene::{Material, MaterialId, World};
use std::path::PathBuf;

/// Name of the material of faces that have none.
pub const DEFAULT_MATERIAL: &str = "default";
/// Diffuse reflectance of that material: a light, slightly warm grey, linear RGB.
pub const DEFAULT_ALBEDO: Rgb = Vec3::new(0.72, 0.70, 0.66);

/// What one mesh file holds, in the file's own coordinates.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Meshes, spheres, materials (at least one where there is a mesh), textures and lights:
    /// emitting faces, which are then not among the meshes. `sky` stays at its default.
    pub world: World,
    /// What the user should know: dropped faces, ignored material keys.
    pub warnings: Vec<Diagnostic>,
    /// Every file read.
    pub files: Vec<PathBuf>,
}

impl Model {
    /// The material of faces without one.
    pub(super) fn default_material(&mut self) -> MaterialId {
        let materials = &mut self.world.materials;
        let at = materials.iter().position(|m| m.name == DEFAULT_MATERIAL);
        at.unwrap_or_else(|| {
            materials.push(Material::diffuse(DEFAULT_MATERIAL, DEFAULT_ALBEDO));
            materials.len() - 1
        }) as MaterialId
    }
}
