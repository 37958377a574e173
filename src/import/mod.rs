//! Files in, a [`World`], a [`Shot`] and [`Settings`] out; every fault with its place.
//!
//! [`load`] takes a scene file (TOML) or a bare mesh. Input is hostile until it was validated
//! here: what leaves this room has indices in range and finite numbers only.

mod convert;
mod course;
mod generators;
mod lamps;
mod lines;
mod model;
mod mtl;
mod normals;
mod obj;
mod ply;
mod polygon;
mod source;
mod texture;
mod tidy;

pub use convert::{ConvertReport, PlyReport, convert, write_ply};
pub use generators::{MAX_TRIANGLES, bench_terrain, terrain_height, uv_sphere};
pub use model::{DEFAULT_ALBEDO, DEFAULT_MATERIAL, Model, load_model};
pub use normals::apply as apply_normals;
pub use texture::{MAX_IMAGE_BYTES, load_texture};

use crate::error::{Diagnostic, Result};
use crate::scene::{FrameRange, Settings, Shot, World};
use std::path::{Path, PathBuf};

/// What the command line says about reading, beside the scene file itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadOptions {
    /// Which axis of a bare mesh is up.
    pub up: UpAxis,
    /// Factor on a bare mesh's coordinates.
    pub scale: f64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { up: UpAxis::Y, scale: 1.0 }
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
    /// Output pattern, where the file says, relative to the current folder.
    pub output: Option<String>,
    /// What the user should know though it is no error.
    pub warnings: Vec<Diagnostic>,
    /// Every file read, in order: the scene's content hash is taken over them.
    pub files: Vec<PathBuf>,
}

/// Reads a scene file, or a bare mesh under a default camera orbit, sky and key light.
///
/// Errors: `Error::Input` with file, line and column; `Error::Io` for files that cannot be read.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let _ = (path, options);
    todo!()
}
