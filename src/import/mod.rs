//! Reading files into a [`World`], a [`Shot`] and [`Settings`]; every error has its place in the file.
//!
//! [`load`] takes a scene file (TOML) or a bare mesh. All input is validated here: in the results
//! indices are in range and numbers are finite.

mod alpha;
mod colours;
mod convert;
mod course;
mod emission;
mod framing;
mod generators;
mod gltf;
mod images;
mod lamps;
mod lines;
mod mesh_file;
mod model;
mod mtl;
mod normals;
mod obj;
mod ply;
mod polygon;
mod scene_file;
mod source;
mod texture;
mod tidy;
mod turntable;
mod untextured;

pub use alpha::load_mask;
pub use convert::{ConvertReport, PlyReport, convert, write_ply};
pub use generators::{MAX_TRIANGLES, bench_terrain, terrain_height, uv_sphere};
pub use mesh_file::{load_model, load_model_with};
pub use model::{
    COLOURED_MATERIAL, CameraChoice, DEFAULT_ALBEDO, DEFAULT_MATERIAL, FileCamera, Model,
    ModelOptions, Repeats,
};
pub use normals::apply as apply_normals;
pub use scene_file::schema;
pub use texture::{MAX_IMAGE_BYTES, load_texture};

use crate::error::{Diagnostic, Error, Result};
use crate::scene::{JobOptions, Settings, Shot, World, limits};
use std::path::{Path, PathBuf};

/// Edges sharper than this stay sharp unless a scene file says otherwise; degrees.
pub const DEFAULT_CREASE_DEGREES: f64 = 30.0;

/// Options of the command line for reading.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadOptions {
    /// Which axis of a bare mesh is up.
    pub up: UpAxis,
    /// Factor on a bare mesh's coordinates.
    pub scale: f64,
    /// Image width and height where the command line overrides them: an orbit that frames the
    /// scene by itself depends on their ratio.
    pub size: Option<(u32, u32)>,
    /// Name or number of the camera of a glTF file; `None`: the first with a perspective.
    pub camera: Option<String>,
    /// Time at which animated meshes and lights of a glTF file stand, seconds; `None`: 0.
    pub time: Option<f64>,
    /// Frames a second of a glTF file's camera move.
    pub fps: f64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        let fps = ModelOptions::default().fps;
        Self { up: UpAxis::Y, scale: 1.0, size: None, camera: None, time: None, fps }
    }
}

/// The axis that points up in a mesh's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// x is up.
    X,
    /// y is up.
    Y,
    /// z is up.
    Z,
}

/// A job as its scene file describes it; the command line may override `settings` and `options`
/// afterwards.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The scene's content.
    pub world: World,
    /// The camera move.
    pub shot: Shot,
    /// How to render it.
    pub settings: Settings,
    /// How the job runs.
    pub options: JobOptions,
    /// Place of the output pattern in the scene file, for an error about it.
    pub output_place: Option<Diagnostic>,
    /// Warnings for the user.
    pub warnings: Vec<Diagnostic>,
    /// Every file read, in order.
    pub files: Vec<PathBuf>,
    /// Floor and lamp that were added to a bare mesh.
    pub stage: Option<AddedStage>,
    /// Meshes that files place more than once, and files that a scene places more than once.
    pub repeats: Repeats,
}

/// Indices of the floor and the lamp that are added to a bare mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddedStage {
    /// Index of the floor among the world's meshes.
    pub floor: usize,
    /// Index of the lamp among the world's lights.
    pub lamp: usize,
}

impl Loaded {
    /// A job with default options.
    fn new(world: World, shot: Shot, settings: Settings) -> Self {
        Self {
            world,
            shot,
            settings,
            options: JobOptions::default(),
            output_place: None,
            warnings: Vec::new(),
            files: Vec::new(),
            stage: None,
            repeats: Repeats::default(),
        }
    }
}

/// Reads a scene file (`.toml`), or a bare mesh under a default camera orbit, sky and key light.
///
/// Errors: `Error::Input` with file, line and column; `Error::Io` for files that cannot be read;
/// `Error::Usage` for options that are for bare meshes only, or out of range.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let scale = options.scale;
    if !limits::FACTOR.contains(&scale) {
        return Err(Error::Usage(format!("the scale is {scale}; it lies between 1e-30 and 1e30")));
    }
    let is_of_gltf = options.camera.is_some() || options.time.is_some();
    if is_of_gltf && !gltf::is_named(path) {
        let message = "`--camera` and `--time` are for glTF files, .glb and .gltf";
        return Err(Error::Usage(message.into()));
    }
    let is_scene_file = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    if !is_scene_file {
        return turntable::load(path, options);
    }
    if options.up != UpAxis::Y || scale != 1.0 {
        let message = "`--up` and `--scale` are for bare meshes; in a scene file say `up` and \
                       `transform` in its [[mesh]]";
        return Err(Error::Usage(message.into()));
    }
    scene_file::load(path, options)
}
