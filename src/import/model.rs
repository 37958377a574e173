//! The result of reading a mesh file.

use crate::error::Diagnostic;
use crate::math::{Rgb, Vec3};
use crate::scene::{Material, MaterialId, World};
use std::path::PathBuf;

/// Name of the material of faces that have none.
pub const DEFAULT_MATERIAL: &str = "default";
/// Name of the material of faces that have none but vertex colours.
pub const COLOURED_MATERIAL: &str = "vertex colours";
/// Diffuse reflectance of the default material: a light, slightly warm grey, linear RGB.
pub const DEFAULT_ALBEDO: Rgb = Vec3::new(0.72, 0.70, 0.66);

/// The content of a mesh file, in the file's own coordinates.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Meshes, spheres, materials (at least one if there is a mesh), textures and lights. Lights are
    /// made of emitting faces, which the meshes then lack. `sky` is the default.
    pub world: World,
    /// Warnings about dropped faces, ignored material keys and the like.
    pub warnings: Vec<Diagnostic>,
    /// Every file read.
    pub files: Vec<PathBuf>,
}

impl Model {
    /// The material of faces without one that have vertex colours: these alone.
    pub(super) fn coloured_material(&mut self) -> MaterialId {
        let materials = &mut self.world.materials;
        let at = materials.iter().position(|m| m.name == COLOURED_MATERIAL);
        at.unwrap_or_else(|| {
            let white = Material::diffuse(COLOURED_MATERIAL, Rgb::ONE);
            materials.push(Material { vertex_colours: true, ..white });
            materials.len() - 1
        }) as MaterialId
    }

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
