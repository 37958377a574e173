//! Camera paths: from a frame number to a pose.

use super::Pose;
use crate::math::DVec3;

/// A camera move: path, timing and lens.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// The curve the camera follows.
    pub path: CameraPath,
    /// How the frames are spread along it.
    pub easing: Easing,
    /// Frames of the whole move, at least 1.
    pub frames: u32,
    /// Vertical field of view, degrees.
    pub vfov_degrees: f64,
}

/// The curve that a camera follows, as a function of progress in `[0, 1]`.
#[derive(Debug, Clone, PartialEq)]
pub enum CameraPath {
    /// A camera that does not move.
    Still(Pose),
    /// A straight pan of the eye with a fixed point of interest.
    Pan {
        /// Eye at the start.
        from: DVec3,
        /// Eye at the end.
        to: DVec3,
        /// Fixed point of interest.
        target: DVec3,
        /// Up direction.
        up: DVec3,
        /// Roll, degrees.
        roll_degrees: f64,
    },
    /// A circle about an axis through `target`.
    Orbit {
        /// Centre of interest and of the circle.
        target: DVec3,
        /// Eye at the start.
        eye: DVec3,
        /// Axis of rotation, also the up direction.
        axis: DVec3,
        /// Total turn, degrees; 360 closes the circle, and the last frame then stops one step
        /// before the first so that the video loops.
        degrees: f64,
        /// Roll, degrees.
        roll_degrees: f64,
    },
    /// Key poses joined by Catmull–Rom splines (Catmull and Rom, 1974); passes through each.
    Keys(Vec<KeyPose>),
    /// A uniform cubic B-spline through four or more control points (de Boor, 1972), with a
    /// fixed point of interest; approximates, and stays in their convex hull.
    BSpline {
        /// Control points of the eye.
        points: Vec<DVec3>,
        /// Fixed point of interest.
        target: DVec3,
        /// Up direction.
        up: DVec3,
        /// Roll, degrees.
        roll_degrees: f64,
    },
}

/// A pose at a moment of the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyPose {
    /// When, in `[0, 1]` of the path; strictly increasing from key to key.
    pub at: f64,
    /// The pose there.
    pub pose: Pose,
}

/// How progress along the path depends on time.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Easing {
    /// Constant speed of progress.
    Linear,
    /// Slow start.
    In,
    /// Slow end.
    Out,
    /// Slow start and end.
    InOut,
}
