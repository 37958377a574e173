//! `poses` of the camera: poses from a file of another program, one a frame.
//!
//! Takes the `transforms.json` of NeRF data sets ([`nerf`](super::nerf)) or COLMAP's `images.txt` with the `cameras.txt` beside it
//! ([`colmap`](super::colmap)); gives a [`CameraPath`] and a projection for each of its poses.
//!
//! Not done: distorted lenses, rolling shutters.

use super::posed::Posed;
use super::{Camera, colmap, nerf};
use crate::error::{Diagnostic, Error, Result};
use crate::import::UpAxis;
use crate::import::scene_file::at::At;
use crate::import::scene_file::file_name;
use crate::import::scene_file::report::Source;
use crate::import::scene_file::schema::inline_schema;
use crate::import::scene_file::to_y_up;
use crate::import::source::beside;
use crate::scene::{CameraPath, Easing, KeyPose, Pose, ProjectionKey};
use schemars::{JsonSchema, json_schema};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use std::fmt;
use std::path::{Path, PathBuf};

/// Most poses, as many as a shot has frames.
const MAX_POSES: usize = 1_000_000;
/// A file of poses: its name, or a table.
#[derive(Debug)]
pub(super) struct Poses(PosesTable);

/// A file of poses, and which axis of its world points up.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a file name or a table")]
pub(super) struct PosesTable {
    /// `transforms.json` of a NeRF data set, or COLMAP's `images.txt`; relative to the scene file.
    #[serde(deserialize_with = "file_name::required")]
    file: String,
    /// Axis of the file's world that points up; it is turned to y. Absent: y.
    #[serde(default = "y")]
    up: UpAxis,
}

fn y() -> UpAxis {
    UpAxis::Y
}

/// A path with its projections.
pub(super) type PosedPath = (CameraPath, Vec<ProjectionKey>);

impl Camera {
    /// The files that `poses` names.
    pub(in crate::import::scene_file) fn pose_files(&self, source: &Source) -> Vec<PathBuf> {
        let Some(poses) = &self.poses else { return Vec::new() };
        let file = beside(&source.path, &poses.0.file);
        let cameras = colmap::is_images(&file).then(|| colmap::cameras_of(&file));
        [Some(file), cameras].into_iter().flatten().collect()
    }

    /// The path of the poses of a file; `aspect` is width / height of the pictures to render.
    ///
    /// Errors: keys of the camera that would do nothing, at `poses`; what is wrong in the file, there.
    pub(super) fn posed(
        &self,
        poses: &At<Poses>,
        source: &Source,
        aspect: f64,
    ) -> Result<PosedPath> {
        self.refuse_idle_keys(poses, source)?;
        let file = beside(&source.path, &poses.0.file);
        let posed = match colmap::is_images(&file) {
            true => colmap::poses(&file),
            false => nerf::poses(&file, aspect),
        };
        let posed = posed.map_err(|error| match error {
            Error::Io { .. } => source.fault(&poses.span, error.to_string()).into(),
            other => other,
        })?;
        if posed.is_empty() || posed.len() > MAX_POSES {
            let count = posed.len();
            let message = format!("the file has {count} poses; 1 to {MAX_POSES} can be");
            return Err(Error::input(&file, message));
        }
        check_shape(&file, &posed, aspect)?;
        Ok(path_of(&posed, poses.0.up))
    }

    /// Refuses what `poses` makes useless: `fov` and `frames` at all, the others where they are not at their defaults.
    fn refuse_idle_keys(&self, poses: &At<Poses>, source: &Source) -> Result<()> {
        let usual = Self::default();
        let lens = self.lens.as_ref();
        let idle = [
            ("frames", self.frames.is_some()),
            ("fov", self.fov.is_some()),
            ("up", self.up.unit() != usual.up.unit()),
            ("roll", self.roll.0 != 0.0),
            ("shift", self.shift != usual.shift),
            ("pixel_aspect", self.pixel_aspect != usual.pixel_aspect),
            ("easing", self.easing != Easing::Linear),
        ];
        if let Some((key, _)) = idle.iter().find(|(_, is_given)| *is_given) {
            let message = format!(
                "`{key}` has no effect beside `poses`: each pose is a frame, with a lens of its own"
            );
            return Err(source.fault(&poses.span, message).into());
        }
        if lens.is_some_and(|lens| !lens.stands_alone()) {
            let message = "a lens beside `poses` has a `radius` and a `focus` in world units: poses have no target";
            return Err(source.fault(&poses.span, message).into());
        }
        Ok(())
    }
}

/// Refuses pictures of another shape than those to render, which would be stretched or cut.
fn check_shape(file: &Path, posed: &[Posed], aspect: f64) -> Result<()> {
    for (number, pose) in (1..).zip(posed) {
        let [width, height] = pose.intrinsics.size;
        // Rounding of a smaller picture's size to whole pixels may change the shape by a hundredth.
        if ((width / height) / aspect - 1.0).abs() > 0.01 {
            let message = format!(
                "the pictures of pose {number} are {width} x {height}, {:.4} times as wide as high; those to render \
                 are {aspect:.4} times as wide",
                width / height
            );
            let help =
                format!("render pictures of that shape: size = [{width}, {height}] in [settings]");
            return Err(Diagnostic::new(file, message).help(help).into());
        }
    }
    Ok(())
}

/// One key a pose, each exactly at its frame.
fn path_of(posed: &[Posed], up: UpAxis) -> PosedPath {
    let turn = to_y_up(up);
    let steps = posed.len().saturating_sub(1).max(1) as f64;
    let at = |i: usize| i as f64 / steps;
    let key = |(i, p): (usize, &Posed)| {
        let eye = turn.transform_point3(p.eye);
        let forward = turn.transform_vector3(p.axes.z_axis);
        // Far from the origin a target at distance 1 would round the view.
        let target = eye + forward * eye.abs().max_element().max(1.0);
        let up = turn.transform_vector3(p.axes.y_axis);
        KeyPose { at: at(i), pose: Pose { eye, target, up, roll_degrees: 0.0 } }
    };
    let keys = posed.iter().enumerate().map(key).collect();
    let projection = |(i, p): (usize, &Posed)| ProjectionKey {
        at: at(i),
        projection: p.intrinsics.projection(),
    };
    (CameraPath::Keys(keys), posed.iter().enumerate().map(projection).collect())
}

struct PosesVisitor;

impl<'de> Visitor<'de> for PosesVisitor {
    type Value = Poses;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a file name or a table")
    }

    fn visit_str<E: serde::de::Error>(self, file: &str) -> std::result::Result<Poses, E> {
        let file = file_name::checked(file)?;
        Ok(Poses(PosesTable { file, up: UpAxis::Y }))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> std::result::Result<Poses, A::Error> {
        PosesTable::deserialize(MapAccessDeserializer::new(map)).map(Poses)
    }
}

impl<'de> Deserialize<'de> for Poses {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        deserializer.deserialize_any(PosesVisitor)
    }
}

inline_schema!(Poses, |generator| {
    let table = generator.subschema_for::<PosesTable>();
    json_schema!({ "anyOf": [{ "type": "string" }, table] })
});
