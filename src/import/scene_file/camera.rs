//! `[camera]`: lens, timing and path.

use super::at::{At, Span};
use super::number::{Degrees, FieldOfView, Int, Share};
use super::report::Source;
use super::vector::{Direction, Point};
use crate::error::{Error, Result};
use crate::import::framing::{self, Lens};
use crate::math::DVec3;
use crate::scene::{CameraPath, Easing, KeyPose, Pose, Shot, World};
use schemars::JsonSchema;
use serde::Deserialize;

/// The camera and its move: at most one of `still`, `pan`, `orbit`, `keys` and `bspline`. With
/// none of them the camera orbits the scene once.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("not" = {"anyOf": [
    {"required": ["still", "pan"]}, {"required": ["still", "orbit"]},
    {"required": ["still", "keys"]}, {"required": ["still", "bspline"]},
    {"required": ["pan", "orbit"]}, {"required": ["pan", "keys"]},
    {"required": ["pan", "bspline"]}, {"required": ["orbit", "keys"]},
    {"required": ["orbit", "bspline"]}, {"required": ["keys", "bspline"]}
]}))]
pub(super) struct Camera {
    /// Vertical field of view, degrees.
    #[serde(default = "default_fov")]
    fov: FieldOfView,
    /// Frames of the whole move. Absent: 1 for `still`, else 48.
    frames: Option<Int<1, 1_000_000>>,
    /// How the frames are spread along the path: evenly ("linear"), or with a slow start ("in"),
    /// a slow end ("out") or both ("in-out").
    #[serde(default = "linear")]
    easing: Easing,
    /// Direction that is up in the image; also the axis of `orbit`.
    #[serde(default = "y_up")]
    up: Direction,
    /// Turn about the view axis, degrees; positive tilts the camera clockwise.
    #[serde(default = "no_roll")]
    roll: Degrees,
    /// A camera that does not move.
    still: Option<At<Still>>,
    /// A straight move with a fixed point of interest.
    pan: Option<At<Pan>>,
    /// A circle about the axis `up` through the target.
    orbit: Option<At<Orbit>>,
    /// Key poses, joined by a smooth curve through each of them (Catmull-Rom).
    keys: Option<At<Vec<At<Key>>>>,
    /// A uniform cubic B-spline: from the first to the last of its points, close to the others.
    bspline: Option<At<BSpline>>,
}

/// A camera that does not move.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Still {
    /// Where the camera stands, world units.
    eye: Point,
    /// What it looks at, world units.
    target: Point,
}

/// A straight move with a fixed point of interest.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Pan {
    /// Where the camera stands in the first frame, world units.
    from: Point,
    /// Where it stands in the last frame, world units.
    to: Point,
    /// What it looks at in every frame, world units.
    target: Point,
}

/// A circle about the axis `up` through the target.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Orbit {
    /// What the camera looks at, world units. Absent: the middle of the scene.
    target: Option<Point>,
    /// Where it stands in the first frame, world units. Absent: in front of the scene (towards
    /// +z) and slightly above, so far away that all of it is in every frame.
    eye: Option<Point>,
    /// The whole turn, degrees, counter-clockwise seen from above; 360 closes the circle, and the
    /// last frame stops one step before the first.
    #[serde(default = "full_turn")]
    degrees: Degrees,
}

/// A pose at a moment of the move.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Key {
    /// When, as a share of the move from 0 to 1; later from key to key. Give it for every key or
    /// for none; without it the keys are evenly spread.
    at: Option<At<Share>>,
    /// Where the camera stands, world units.
    eye: Point,
    /// What it looks at, world units.
    target: Point,
    /// Direction that is up in the image. Absent: the camera's `up`.
    up: Option<Direction>,
    /// Turn about the view axis, degrees. Absent: the camera's `roll`.
    roll: Option<Degrees>,
}

/// A uniform cubic B-spline with a fixed point of interest.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct BSpline {
    /// Four or more control points of the eye, world units.
    #[schemars(extend("minItems" = 4))]
    points: Vec<Point>,
    /// What the camera looks at in every frame, world units.
    target: Point,
}

fn default_fov() -> FieldOfView {
    FieldOfView(40.0)
}

fn linear() -> Easing {
    Easing::Linear
}

fn y_up() -> Direction {
    Direction(DVec3::Y)
}

fn no_roll() -> Degrees {
    Degrees(0.0)
}

fn full_turn() -> Degrees {
    Degrees(360.0)
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            fov: default_fov(),
            frames: None,
            easing: linear(),
            up: y_up(),
            roll: no_roll(),
            still: None,
            pan: None,
            orbit: None,
            keys: None,
            bspline: None,
        }
    }
}

/// The pose that all keys of a camera table agree on.
struct Common {
    up: DVec3,
    roll_degrees: f64,
}

impl Camera {
    /// The shot; `world` and `aspect` (width / height) decide where an orbit without `eye` runs.
    ///
    /// Errors: more than one path, or one that some frame cannot be rendered on; at the path.
    pub fn build(&self, source: &Source, world: &World, aspect: f64) -> Result<Shot> {
        let span = self.only_path(source)?;
        let path = self.path(source, world, aspect)?;
        let moves = !matches!(path, CameraPath::Still(_));
        let shot = Shot {
            frames: self.frames.map_or(if moves { 48 } else { 1 }, Int::u32),
            path,
            easing: self.easing,
            vfov_degrees: self.fov.0,
        };
        shot.validate().map_err(|error| match error {
            Error::Usage(what) => source.fault(&span, what).into(),
            other => other,
        })?;
        Ok(shot)
    }

    /// Where the path stands.
    fn only_path(&self, source: &Source) -> Result<Span> {
        let mut given: Vec<(Span, &str)> = [
            self.still.as_ref().map(|p| (p.span.clone(), "still")),
            self.pan.as_ref().map(|p| (p.span.clone(), "pan")),
            self.orbit.as_ref().map(|p| (p.span.clone(), "orbit")),
            self.keys.as_ref().map(|p| (p.span.clone(), "keys")),
            self.bspline.as_ref().map(|p| (p.span.clone(), "bspline")),
        ]
        .into_iter()
        .flatten()
        .collect();
        given.sort_by_key(|(span, _)| span.start);
        match given.as_slice() {
            [] => Ok(0..0),
            [(span, _)] => Ok(span.clone()),
            [(_, first), (span, second), ..] => Err(source
                .fault(span, format!("the camera has a path already: `{first}`"))
                .help(format!("a camera has one path; remove `{first}` or `{second}`"))
                .into()),
        }
    }

    fn path(&self, source: &Source, world: &World, aspect: f64) -> Result<CameraPath> {
        let common = Common { up: self.up.unit(), roll_degrees: self.roll.0 };
        if let Some(still) = &self.still {
            return Ok(CameraPath::Still(common.pose(&still.eye, &still.target)));
        }
        if let Some(pan) = &self.pan {
            return Ok(pan.path(&common));
        }
        if let Some(keys) = &self.keys {
            return key_poses(keys, &common, source).map(CameraPath::Keys);
        }
        if let Some(spline) = &self.bspline {
            return Ok(spline.path(&common));
        }
        let around = self.orbit.as_ref().map_or(&Orbit::WHOLE, |o| &o.value);
        let lens = Lens { vfov_degrees: self.fov.0, aspect };
        Ok(around.path(&common, world, &lens))
    }
}

impl Common {
    fn pose(&self, eye: &Point, target: &Point) -> Pose {
        Pose {
            eye: eye.vec(),
            target: target.vec(),
            up: self.up,
            roll_degrees: self.roll_degrees,
        }
    }
}

impl Pan {
    fn path(&self, common: &Common) -> CameraPath {
        CameraPath::Pan {
            from: self.from.vec(),
            to: self.to.vec(),
            target: self.target.vec(),
            up: common.up,
            roll_degrees: common.roll_degrees,
        }
    }
}

impl Orbit {
    /// Once round the whole scene.
    const WHOLE: Self = Self { target: None, eye: None, degrees: Degrees(360.0) };

    fn path(&self, common: &Common, world: &World, lens: &Lens) -> CameraPath {
        let target = self.target.map(|t| t.vec());
        let (target, eye) = match self.eye {
            Some(eye) => (target.unwrap_or_else(|| framing::bounds(world).centre()), eye.vec()),
            None => framing::orbit(world, target, common.up, framing::ELEVATION_DEGREES, lens),
        };
        CameraPath::Orbit {
            target,
            eye,
            axis: common.up,
            degrees: self.degrees.0,
            roll_degrees: common.roll_degrees,
        }
    }
}

impl BSpline {
    fn path(&self, common: &Common) -> CameraPath {
        CameraPath::BSpline {
            points: self.points.iter().map(|p| p.vec()).collect(),
            target: self.target.vec(),
            up: common.up,
            roll_degrees: common.roll_degrees,
        }
    }
}

/// Key poses with their times.
fn key_poses(keys: &At<Vec<At<Key>>>, common: &Common, source: &Source) -> Result<Vec<KeyPose>> {
    let timed = keys.iter().filter(|k| k.at.is_some()).count();
    if timed != 0 && timed != keys.len() {
        let untimed = keys.iter().find(|k| k.at.is_none());
        let span = untimed.map_or(&keys.span, |k| &k.span);
        let message = "this key has no `at` although others have";
        let help = "give `at` for every key, or for none to spread them evenly";
        return Err(source.fault(span, message).help(help).into());
    }
    let steps = keys.len().saturating_sub(1).max(1) as f64;
    let mut before = None;
    let mut poses = Vec::with_capacity(keys.len());
    for (index, key) in keys.iter().enumerate() {
        let at = key.at.as_ref().map_or(index as f64 / steps, |at| at.0);
        if let (Some(at_key), Some(before)) = (&key.at, before) {
            if at <= before {
                let message = format!("`at` is {at}, not later than the key before it ({before})");
                return Err(source.fault(&at_key.span, message).into());
            }
        }
        before = Some(at);
        if key.eye == key.target {
            let message = "the camera of this key stands on its own target; it looks nowhere";
            return Err(source.fault(&key.span, message).into());
        }
        let mut pose = common.pose(&key.eye, &key.target);
        pose.up = key.up.map_or(pose.up, |up| up.unit());
        pose.roll_degrees = key.roll.map_or(pose.roll_degrees, |r| r.0);
        poses.push(KeyPose { at, pose });
    }
    Ok(poses)
}
