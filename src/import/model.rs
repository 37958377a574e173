//! The result of reading a mesh file.

use crate::error::Diagnostic;
use crate::math::{Rgb, Vec3};
use crate::scene::{Material, MaterialId, Shot, World, WorldMesh};
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
    /// Warnings about its camera and its lights, which hold where nothing else is in the scene.
    pub warnings_alone: Vec<Diagnostic>,
    /// Every file read.
    pub files: Vec<PathBuf>,
    /// The file's own camera, of formats that have one.
    pub camera: Option<FileCamera>,
    /// Whether it holds surfaces that emit and are meant as lamps: those of OBJ files are.
    pub has_lamps: bool,
    /// Meshes that the file places more than once.
    pub repeats: Repeats,
}

/// A camera that a mesh file has.
#[derive(Debug, Clone, PartialEq)]
pub struct FileCamera {
    /// Its move.
    pub shot: Shot,
    /// Width of its image over the height, where the file says so.
    pub aspect: Option<f64>,
}

/// What copies of meshes take that instances would share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Repeats {
    /// Copies beyond the first of each mesh.
    pub copies: usize,
    /// Bytes of these copies, ready to be traced.
    pub bytes: u64,
}

/// Bytes of a mesh once it is ready to be traced.
pub(super) fn traced_bytes(mesh: &WorldMesh) -> u64 {
    let vertices = mesh.positions.len() as u64;
    let normals = mesh.normals.as_ref().map_or(0, |n| 12 * n.values.len() as u64);
    let uvs = mesh.uvs.iter().chain(mesh.more_uvs.iter().flatten());
    let uvs: u64 = uvs.map(|uv| 8 * uv.values.len() as u64).sum();
    let colours = mesh.colours.as_ref().map_or(0, |c| c.bytes().len() as u64);
    12 * vertices + 12 * mesh.triangles.len() as u64 + normals + uvs + colours
}

/// Which camera of a mesh file is wanted.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum CameraChoice {
    /// The first that can be rendered.
    #[default]
    First,
    /// The one of this name or number.
    Named(String),
    /// None: what is wrong with cameras does not matter.
    Unwanted,
}

/// What of a mesh file is wanted that holds more than one camera or moment.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelOptions {
    /// Which camera is wanted.
    pub camera: CameraChoice,
    /// Time at which animated meshes and lights stand, seconds.
    pub time: f64,
    /// Frames a second of the camera's move.
    pub fps: f64,
}

impl Default for ModelOptions {
    fn default() -> Self {
        Self { camera: CameraChoice::First, time: 0.0, fps: 24.0 }
    }
}

impl ModelOptions {
    /// Of a file that gives its meshes alone.
    pub(super) fn without_camera() -> Self {
        Self { camera: CameraChoice::Unwanted, ..Self::default() }
    }
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
