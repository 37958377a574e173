//! Camera paths: from a frame number to a pose.
//!
//! Takes a [`Shot`] and a frame number (from 1); gives the [`Pose`] or [`Camera`] of that frame,
//! which depends on nothing else, or an error that names the frame. The curves and their ends are
//! described in `docs/camera-paths.md`.

mod check;
mod level;
#[cfg(test)]
mod tests;

use super::spline::{self, Timed, catmull_rom};
use super::{Camera, Pose, Projection, ProjectionKey, ShotLens};
use crate::error::{Error, Result};
use crate::math::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

/// A camera move: path, timing and lens.
///
/// ```
/// use tweenray::math::DVec3;
/// use tweenray::scene::{CameraPath, Shot};
///
/// let (target, eye, axis) = (DVec3::ZERO, DVec3::new(0.0, 1.0, 4.0), DVec3::Y);
/// let path = CameraPath::Orbit { target, eye, axis, degrees: 90.0, roll_degrees: 0.0 };
/// let shot = Shot::new(path, 24, 40.0);
/// assert_eq!(shot.pose(1)?.eye, eye);
/// assert!(shot.pose(24)?.eye.distance(DVec3::new(4.0, 1.0, 0.0)) < 1e-12);
/// assert!(shot.pose(25).is_err());
/// # Ok::<(), tweenray::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// The curve the camera follows.
    pub path: CameraPath,
    /// How the frames are spread along it.
    pub easing: Easing,
    /// Frames of the whole move, at least 1.
    pub frames: u32,
    /// Vertical field of view, degrees.
    pub vfov_degrees: f64,
    /// The projection at moments of the path, joined as key poses are, but never beyond the values of the two keys
    /// around a moment. Empty: `vfov_degrees` in every frame, centred, with square pixels.
    pub projections: Vec<ProjectionKey>,
    /// The lens and its focus.
    pub lens: ShotLens,
}

/// The curve that a camera follows, as a function of progress in `[0, 1]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
        /// Point of interest, on the axis.
        target: DVec3,
        /// Eye at the start, off the axis.
        eye: DVec3,
        /// Axis of rotation, also the up direction.
        axis: DVec3,
        /// Total turn, degrees, counter-clockwise seen from the axis's tip. A multiple of 360
        /// closes the circle, and the last frame then stops one step before the first so that
        /// the video loops.
        degrees: f64,
        /// Roll, degrees.
        roll_degrees: f64,
    },
    /// Key poses joined by Catmull–Rom splines (Catmull and Rom, 1974) whose knots are the keys'
    /// times; passes through each, and rests before the first key and after the last.
    Keys(Vec<KeyPose>),
    /// A uniform cubic B-spline through four or more control points (de Boor, 1972), with a
    /// fixed point of interest; starts and ends at the first and last of them, approximates the
    /// others, and stays in their convex hull.
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
    /// A pose and a field of view for each frame of the shot, as another program's animation gives them. Frames are taken
    /// as they stand: nothing is smoothed, `easing` does nothing, and images may turn as the poses do.
    Frames(Vec<FramePose>),
}

/// A pose at a moment of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct KeyPose {
    /// When, in `[0, 1]` of the path; strictly increasing from key to key.
    pub at: f64,
    /// The pose there.
    pub pose: Pose,
}

/// The camera of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FramePose {
    /// The pose.
    pub pose: Pose,
    /// Vertical field of view, degrees; in place of the shot's.
    pub vfov_degrees: f64,
}

/// How progress along the path depends on time.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Easing {
    /// Constant speed of progress.
    Linear,
    /// From rest with constant acceleration: `t²`.
    In,
    /// To rest with constant deceleration: `1 − (1 − t)²`.
    Out,
    /// `In` for the first half, `Out` for the second: `2t²`, then `1 − 2(1 − t)²`.
    InOut,
}

impl Easing {
    /// Progress in `[0, 1]` at time `t` in `[0, 1]`; non-decreasing, exactly 0 at 0 and 1 at 1.
    pub fn apply(self, t: f64) -> f64 {
        let rest = 1.0 - t;
        match self {
            Self::Linear => t,
            Self::In => t * t,
            Self::Out => 1.0 - rest * rest,
            Self::InOut if t < 0.5 => 2.0 * t * t,
            Self::InOut => 1.0 - 2.0 * rest * rest,
        }
    }
}

impl Shot {
    /// A move of `frames` frames along `path`, evenly spread, through a pinhole.
    pub fn new(path: CameraPath, frames: u32, vfov_degrees: f64) -> Self {
        let (easing, projections, lens) = (Easing::Linear, Vec::new(), ShotLens::Pinhole);
        Self { path, easing, frames, vfov_degrees, projections, lens }
    }

    /// Checks the whole shot: path, lens, and a camera for every frame.
    ///
    /// Errors: [`Error::Usage`] with what is wrong and, where one frame is at fault, its number.
    pub fn validate(&self) -> Result<()> {
        // The lens first: a wrong one is no single frame's fault.
        check::shot(self)?;
        (1..=self.frames).try_for_each(|frame| self.camera_of_checked(frame, 1, 1).map(drop))
    }

    /// The pose at `frame`, from 1 to `frames`.
    ///
    /// `up` is the path's own unless the view runs along it in this frame or has passed over it
    /// before: then it is chosen so that the image moves without a jump.
    pub fn pose(&self, frame: u32) -> Result<Pose> {
        check::shot(self)?;
        self.pose_of_checked(frame)
    }

    /// The pose at `frame` of a shot whose path was checked: that takes a while for each of many key poses.
    fn pose_of_checked(&self, frame: u32) -> Result<Pose> {
        if !(1..=self.frames).contains(&frame) {
            let last = self.frames;
            return Err(Error::Usage(format!(
                "frame {frame} is not one of the shot's 1 to {last}"
            )));
        }
        if let CameraPath::Frames(frames) = &self.path {
            let pose = frames[frame as usize - 1].pose;
            return check::frame_pose(&pose, frame).map(|()| pose);
        }
        let progress = self.progress(frame);
        let mut pose = self.path.pose(progress);
        if pose.up.abs().max_element() < 1e-6 && matches!(self.path, CameraPath::Keys(_)) {
            return Err(Error::Usage(format!(
                "frame {frame} of {}: the up directions of the keys around it are opposite and \
                 cancel; add a key between them",
                self.frames
            )));
        }
        pose.up = level::steady_up(&self.path, progress, &pose);
        Ok(pose)
    }

    /// The camera at `frame`, world space, for an image of `width` by `height` pixels.
    pub fn camera(&self, frame: u32, width: u32, height: u32) -> Result<Camera> {
        check::shot(self)?;
        self.camera_of_checked(frame, width, height)
    }

    /// The projection at `frame`, one of the shot's.
    fn projection(&self, frame: u32) -> Projection {
        match self.projections.as_slice() {
            [] => Projection::centred(self.vfov_degrees_at(frame)),
            keys => Projection::at(keys, self.progress(frame)),
        }
    }

    fn camera_of_checked(&self, frame: u32, width: u32, height: u32) -> Result<Camera> {
        let pose = self.pose_of_checked(frame)?;
        let projection = self.projection(frame);
        let camera = Camera::with_projection(&pose, &projection, width, height);
        let camera = camera.map_err(|error| match error {
            Error::Usage(what) => Error::Usage(format!("frame {frame} of {}: {what}", self.frames)),
            other => other,
        })?;
        let target = pose.eye.distance(pose.target);
        let lens = self.lens.at(self.progress(frame), target);
        if !lens.is_in_range() {
            return Err(Error::Usage(format!(
                "frame {frame} of {}: the lens is too wide, or its focus too near, for rays",
                self.frames
            )));
        }
        Ok(camera.with_lens(lens))
    }

    /// Moves every pose of a still camera, or of a path that has one for each frame, by `transform`, a similarity. Other
    /// paths stay.
    pub fn apply_transform(&mut self, transform: &DAffine3) {
        let moved = |pose: &mut Pose| {
            pose.eye = transform.transform_point3(pose.eye);
            pose.target = transform.transform_point3(pose.target);
            pose.up = transform.transform_vector3(pose.up).normalize_or(pose.up);
        };
        match &mut self.path {
            CameraPath::Still(pose) => moved(pose),
            CameraPath::Frames(frames) => {
                frames.iter_mut().for_each(|frame| moved(&mut frame.pose))
            }
            _ => {}
        }
    }

    /// The vertical field of view at `frame`, one of the shot's; degrees.
    pub fn vfov_degrees_at(&self, frame: u32) -> f64 {
        match &self.path {
            CameraPath::Frames(frames) => frames[frame as usize - 1].vfov_degrees,
            _ => self.vfov_degrees,
        }
    }

    /// Eased progress along the path at `frame`.
    fn progress(&self, frame: u32) -> f64 {
        let closed = matches!(self.path, CameraPath::Orbit { degrees, .. }
            if degrees != 0.0 && degrees % 360.0 == 0.0);
        let steps = if closed { self.frames } else { (self.frames - 1).max(1) };
        self.easing.apply(f64::from(frame - 1) / f64::from(steps))
    }
}

impl CameraPath {
    /// The pose at `progress` in `[0, 1]` of a path that was checked.
    fn pose(&self, progress: f64) -> Pose {
        match self {
            Self::Still(pose) => *pose,
            Self::Pan { from, to, target, up, roll_degrees } => {
                // The ends exactly, and no rounding where they are the same point.
                let eye = if progress == 1.0 { *to } else { *from + (*to - *from) * progress };
                Pose { eye, target: *target, up: *up, roll_degrees: *roll_degrees }
            }
            Self::Orbit { target, eye, axis, degrees, roll_degrees } => {
                let eye = turn(*eye, *target, *axis, degrees * progress);
                Pose { eye, target: *target, up: *axis, roll_degrees: *roll_degrees }
            }
            Self::Keys(keys) => key_pose(keys, progress),
            Self::Frames(frames) => {
                frames[(progress * (frames.len() - 1) as f64).round() as usize].pose
            }
            Self::BSpline { points, target, up, roll_degrees } => {
                let eye = spline::b_spline(points, progress);
                Pose { eye, target: *target, up: *up, roll_degrees: *roll_degrees }
            }
        }
    }
}

impl Timed for KeyPose {
    fn at(&self) -> f64 {
        self.at
    }
}

/// The pose at `progress` in `[0, 1]`: eye, target, up and roll each on a spline through the keys.
///
/// `up` has length 1 at the keys and vanishes midway between keys with opposite ones.
fn key_pose(keys: &[KeyPose], progress: f64) -> Pose {
    Pose {
        eye: catmull_rom(keys, progress, |key| key.pose.eye),
        target: catmull_rom(keys, progress, |key| key.pose.target),
        up: catmull_rom(keys, progress, |key| level::unit(key.pose.up)),
        roll_degrees: catmull_rom(keys, progress, |key| key.pose.roll_degrees),
    }
}

/// `point` turned about the axis through `centre` (Rodrigues, 1840).
fn turn(point: DVec3, centre: DVec3, axis: DVec3, degrees: f64) -> DVec3 {
    let angle = (degrees % 360.0).to_radians();
    if angle == 0.0 {
        return point;
    }
    let axis = level::unit(axis);
    let arm = point - centre;
    let along = axis * arm.dot(axis);
    let across = arm - along;
    centre + along + across * libm::cos(angle) + axis.cross(across) * libm::sin(angle)
}
