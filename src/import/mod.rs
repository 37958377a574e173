//! Files in, a [`World`], a [`Shot`] and [`Settings`] out; every fault with its place.
//!
//! [`load`] takes a scene file (TOML) or a bare mesh. Input is hostile until it was validated
//! here: what leaves this room has indices in range and finite numbers only.

mod convert;
mod course;
mod emission;
mod framing;
mod generators;
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

pub use convert::{ConvertReport, PlyReport, convert, write_ply};
pub use generators::{MAX_TRIANGLES, bench_terrain, terrain_height, uv_sphere};
pub use mesh_file::load_model;
pub use model::{DEFAULT_ALBEDO, DEFAULT_MATERIAL, Model};
pub use normals::apply as apply_normals;
pub use scene_file::schema;
pub use texture::{MAX_IMAGE_BYTES, load_texture};

use crate::error::{Diagnostic, Error, Result};
use crate::scene::{FrameRange, SaveInterval, Settings, Shot, World, limits};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Edges sharper than this stay sharp unless a scene file says otherwise; degrees.
pub const DEFAULT_CREASE_DEGREES: f64 = 30.0;

/// What the command line says about reading, beside the scene file itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadOptions {
    /// Which axis of a bare mesh is up.
    pub up: UpAxis,
    /// Factor on a bare mesh's coordinates.
    pub scale: f64,
    /// Image width and height where the command line overrides them: an orbit that frames the
    /// scene by itself depends on their ratio.
    pub size: Option<(u32, u32)>,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { up: UpAxis::Y, scale: 1.0, size: None }
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

/// A job as its scene file describes it; the command line may override `settings`, `frames` and
/// `output` afterwards.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// What is in the scene.
    pub world: World,
    /// The camera move.
    pub shot: Shot,
    /// How to render it.
    pub settings: Settings,
    /// Frames to render, where the file says.
    pub frames: Option<FrameRange>,
    /// Where frames go, where the file says.
    pub output: Option<OutputName>,
    /// Frames per second of the preview video.
    pub fps: f64,
    /// Whether a preview video is made.
    pub video: bool,
    /// Whether existing frames are replaced.
    pub overwrite: bool,
    /// Whether an invalid sample makes the job fail.
    pub strict: bool,
    /// Rendering threads, where the file says.
    pub threads: Option<u32>,
    /// File for statistics, where the file says, relative to the current folder.
    pub stats: Option<PathBuf>,
    /// How long the program may run, where the file says.
    pub time_limit: Option<Duration>,
    /// How often what frames to come need is put on disk, where the file says.
    pub checkpoint: Option<SaveInterval>,
    /// How many discoveries a message between ranks carries at most, where the file says.
    pub exchange: Option<u32>,
    /// What the user should know though it is no error.
    pub warnings: Vec<Diagnostic>,
    /// Every file read, in order.
    pub files: Vec<PathBuf>,
    /// What was added around a bare mesh.
    pub stage: Option<AddedStage>,
}

/// Floor and lamp that a bare mesh gets: they are in the world, but not in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddedStage {
    /// Which of the world's meshes is the floor.
    pub floor: usize,
    /// Which of the world's lights is the lamp.
    pub lamp: usize,
}

/// Where frames go, as a scene file says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputName {
    /// The pattern, relative to the current folder.
    pub pattern: String,
    /// Where it stands, for what is wrong with it; the message is still to be said.
    pub place: Diagnostic,
}

impl Loaded {
    /// A job that says nothing beyond what to render.
    fn new(world: World, shot: Shot, settings: Settings) -> Self {
        Self {
            world,
            shot,
            settings,
            frames: None,
            output: None,
            fps: 24.0,
            video: true,
            overwrite: false,
            strict: false,
            threads: None,
            stats: None,
            time_limit: None,
            checkpoint: None,
            exchange: None,
            warnings: Vec::new(),
            files: Vec::new(),
            stage: None,
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
