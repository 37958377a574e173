//! The scene file: TOML to a [`Loaded`] job.
//!
//! The tables are plain serde types whose numbers are in range by construction (`number`,
//! `vector`), so an error points at the number itself. Values that are checked together with others
//! keep their place in the file ([`at::At`]) and are checked when the tables become scene data. The JSON schema
//! comes from the same types. `docs/scene-format.md` is the user's page.

mod at;
mod build;
mod camera;
mod file_name;
mod fog;
mod generated;
mod light;
mod mapping;
mod material;
mod material_images;
mod mesh;
mod number;
mod piece;
mod principled;
mod quad;
mod region;
mod report;
mod reuse;
mod schema;
mod settings;
mod shapes;
mod sky;
#[cfg(test)]
mod tests;
mod texture;
mod time;
mod transform;
mod vector;

pub use schema::schema;
pub(super) use transform::to_y_up;

use super::{LoadOptions, Loaded};
use crate::error::Result;
use at::At;
use build::Builder;
use camera::Camera;
use fog::Fog;
use light::Light;
use material::Material;
use mesh::{Mesh, Sphere};
use report::Source;
use reuse::Reuse;
use schemars::JsonSchema;
use serde::Deserialize;
use settings::Settings;
use sky::Sky;
use std::collections::BTreeMap;
use std::path::Path;

/// A scene for tweenray: what is in it, how the camera moves, how it is rendered. Lengths are in
/// world units of your choice, y is up, angles are in degrees, colours are linear RGB (Rec. 709).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a scene")]
#[schemars(title = "tweenray scene file")]
struct SceneFile {
    /// The camera and its move. Absent: the camera orbits the scene once.
    camera: Option<At<Camera>>,
    /// Lights.
    light: Vec<At<Light>>,
    /// The light of rays that hit nothing. Absent: black.
    sky: Option<At<Sky>>,
    /// What fills the space between the surfaces. Absent: nothing.
    fog: Option<At<Fog>>,
    /// Materials by name.
    material: BTreeMap<String, At<Material>>,
    /// Meshes, from files or generated.
    mesh: Vec<At<Mesh>>,
    /// Exact spheres.
    sphere: Vec<At<Sphere>>,
    /// How to render. Absent: all defaults.
    settings: Settings,
    /// What frames reuse of one another. Absent: all defaults.
    reuse: Reuse,
}

impl SceneFile {
    /// Reads the tables alone; no other file is opened.
    ///
    /// Errors: `Error::Input` with line and column.
    fn parse(source: &Source) -> Result<Self> {
        toml::from_str(&source.text).map_err(|e| source.toml_fault(&e).into())
    }
}

/// Reads a scene file and every file that it names.
///
/// Errors: `Error::Input` with file, line and column; `Error::Io` where the scene file itself
/// cannot be read.
pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Loaded> {
    let source = Source::read(path)?;
    let file = SceneFile::parse(&source)?;
    let mut settings = file.settings.build(&source, file.reuse.build())?;
    if let Some((width, height)) = options.size {
        (settings.width, settings.height) = (width, height);
    }
    let Builder { world, warnings, mut files, repeats, .. } = Builder::build(&source, &file)?;
    let aspect = f64::from(settings.width.max(1)) / f64::from(settings.height.max(1));
    let shot = match &file.camera {
        Some(camera) => camera.build(&source, &world, aspect)?,
        None => Camera::default().build(&source, &world, aspect)?,
    };
    files.extend(file.camera.iter().flat_map(|camera| camera.pose_files(&source)));
    let options = file.settings.job(&source, shot.frames)?;
    let output_place = file.settings.output_place(&source);
    Ok(Loaded {
        options,
        output_place,
        warnings,
        files,
        repeats,
        ..Loaded::new(world, shot, settings)
    })
}
