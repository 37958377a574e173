//! `[camera]`: lens, timing and path.

mod colmap;
mod lens;
mod nerf;
mod path;
mod posed;
mod poses;
#[cfg(test)]
mod tests;

use super::at::At;
use super::number::{Degrees, FieldOfView, Int, PixelAspect, Share, Shift};
use super::vector::{Direction, List, Point};
use crate::math::DVec3;
use crate::scene::Easing;
use lens::{KeyLens, Lens};
use poses::Poses;
use schemars::JsonSchema;
use serde::Deserialize;

/// The camera and its move: at most one of `still`, `pan`, `orbit`, `keys`, `bspline` and `poses`. With
/// none of them the camera orbits the scene once.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("not" = {"anyOf": [
    {"required": ["still", "pan"]}, {"required": ["still", "orbit"]},
    {"required": ["still", "keys"]}, {"required": ["still", "bspline"]},
    {"required": ["pan", "orbit"]}, {"required": ["pan", "keys"]},
    {"required": ["pan", "bspline"]}, {"required": ["orbit", "keys"]},
    {"required": ["orbit", "bspline"]}, {"required": ["keys", "bspline"]},
    {"required": ["still", "poses"]}, {"required": ["pan", "poses"]}, {"required": ["orbit", "poses"]},
    {"required": ["keys", "poses"]}, {"required": ["bspline", "poses"]}
]}))]
pub(super) struct Camera {
    /// Vertical field of view, degrees.
    #[schemars(extend("default" = 40.0))]
    fov: Option<FieldOfView>,
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
    /// By how much of its width to the right, and of its height upwards, the picture lies off the view axis.
    #[serde(default = "no_shift")]
    shift: List<Shift, 2>,
    /// Width of a pixel over its height.
    #[serde(default = "square")]
    pixel_aspect: PixelAspect,
    /// A thin lens, with depth of field. Absent: everything is sharp.
    lens: Option<At<Lens>>,
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
    /// One pose a frame from a file, relative to the scene file: `transforms.json` of a NeRF data set, or COLMAP's
    /// `images.txt` with its `cameras.txt`. Or a table of the file and the axis that points up in it.
    poses: Option<At<Poses>>,
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
    /// Time of the key, as a share of the move from 0 to 1; increasing from key to key. Give it for every key or
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
    /// Vertical field of view here, degrees. Absent: the camera's `fov`.
    fov: Option<FieldOfView>,
    /// Shift of the picture here. Absent: the camera's `shift`.
    shift: Option<List<Shift, 2>>,
    /// The lens here. Absent: the camera's `lens`.
    lens: Option<At<KeyLens>>,
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

/// Field of view of a camera that says none.
const USUAL_FOV: FieldOfView = FieldOfView(40.0);

fn linear() -> Easing {
    Easing::Linear
}

fn y_up() -> Direction {
    Direction(DVec3::Y)
}

fn no_roll() -> Degrees {
    Degrees(0.0)
}

fn no_shift() -> List<Shift, 2> {
    List([Shift(0.0); 2])
}

fn square() -> PixelAspect {
    PixelAspect(1.0)
}

fn full_turn() -> Degrees {
    Degrees(360.0)
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            fov: None,
            frames: None,
            easing: linear(),
            up: y_up(),
            roll: no_roll(),
            shift: no_shift(),
            pixel_aspect: square(),
            lens: None,
            still: None,
            pan: None,
            orbit: None,
            keys: None,
            bspline: None,
            poses: None,
        }
    }
}

impl Camera {
    /// Vertical field of view.
    fn vfov(&self) -> FieldOfView {
        self.fov.unwrap_or(USUAL_FOV)
    }
}
