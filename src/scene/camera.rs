//! The pinhole camera: its pose in the world, and rays through its pixels.

use super::Recentring;
use crate::error::{Error, Result};
use crate::math::DVec3;

/// Where a camera stands and looks, world space, f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Eye point.
    pub eye: DVec3,
    /// Point of interest; it projects to the image's centre.
    pub target: DVec3,
    /// Direction that is up in the image; need not be perpendicular to the view.
    pub up: DVec3,
    /// Turn about the view axis, degrees; positive tilts the camera clockwise.
    pub roll_degrees: f64,
}

/// A pinhole camera at a pose, for one image size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Eye point.
    pub eye: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Image-plane vector of half the image's width at distance 1, to the right.
    pub half_right: DVec3,
    /// Image-plane vector of half the image's height at distance 1, upwards.
    pub half_up: DVec3,
    /// Image columns.
    pub width: u32,
    /// Image rows.
    pub height: u32,
}

impl Camera {
    /// A camera at `pose` with the vertical field of view `vfov_degrees` (0 to 180, exclusive).
    ///
    /// Looking along `up` is allowed: the image's up direction is then the world axis least
    /// aligned with the view, taken in the order z, y, x. Eye equal to target is an error.
    pub fn new(pose: &Pose, vfov_degrees: f64, width: u32, height: u32) -> Result<Self> {
        if !(vfov_degrees > 0.0 && vfov_degrees < 180.0) {
            return Err(Error::Usage(format!(
                "the vertical field of view is {vfov_degrees} degrees; it must lie between 0 and 180"
            )));
        }
        if width == 0 || height == 0 {
            return Err(Error::Usage(format!("the image size {width}x{height} has no pixels")));
        }
        let view = pose.target - pose.eye;
        if !(pose.eye.is_finite() && pose.target.is_finite() && pose.up.is_finite()) {
            return Err(Error::Usage("a camera position is not a finite number".into()));
        }
        let scale = pose.eye.abs().max(pose.target.abs()).max_element();
        if view.length() <= 4.0 * f64::EPSILON * scale || view == DVec3::ZERO {
            return Err(Error::Usage(format!(
                "the camera stands on its own target {}; it looks nowhere",
                pose.target
            )));
        }
        // Scaling by the largest component first keeps the length from under- and overflow.
        let forward = unit(view);
        let right = right_of(forward, pose.up);
        let up = right.cross(forward);
        let (sin, cos) =
            (libm::sin(pose.roll_degrees.to_radians()), libm::cos(pose.roll_degrees.to_radians()));
        let (right, up) = (right * cos - up * sin, up * cos + right * sin);
        let half_height = libm::tan(0.5 * vfov_degrees.to_radians());
        let half_width = half_height * f64::from(width) / f64::from(height);
        Ok(Self {
            eye: pose.eye,
            forward,
            half_right: right * half_width,
            half_up: up * half_height,
            width,
            height,
        })
    }

    /// Direction (unit) through image point `(x, y)` in pixels; `(0, 0)` is the upper left corner
    /// of the image and `(0.5, 0.5)` the middle of its first pixel.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let sx = 2.0 * x / f64::from(self.width) - 1.0;
        let sy = 1.0 - 2.0 * y / f64::from(self.height);
        (self.forward + self.half_right * sx + self.half_up * sy).normalize()
    }

    /// Image point in pixels and depth along `forward` of `p`; `None` behind the eye.
    pub fn project(&self, p: DVec3) -> Option<(f64, f64, f64)> {
        let to = p - self.eye;
        let depth = to.dot(self.forward);
        if depth <= 0.0 {
            return None;
        }
        let sx = to.dot(self.half_right) / (depth * self.half_right.length_squared());
        let sy = to.dot(self.half_up) / (depth * self.half_up.length_squared());
        let x = 0.5 * (sx + 1.0) * f64::from(self.width);
        let y = 0.5 * (1.0 - sy) * f64::from(self.height);
        Some((x, y, depth))
    }

    /// The same camera in scene space.
    pub fn to_scene(&self, recentring: &Recentring) -> Self {
        Self { eye: recentring.point_to_scene(self.eye), ..*self }
    }
}

fn unit(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}

fn right_of(forward: DVec3, up: DVec3) -> DVec3 {
    let candidate = if up == DVec3::ZERO { DVec3::ZERO } else { forward.cross(unit(up)) };
    // Below 1e-9 the direction of the cross product is mostly rounding error.
    if candidate.length() > 1e-9 {
        return candidate.normalize();
    }
    let least = [DVec3::Z, DVec3::Y, DVec3::X]
        .into_iter()
        .min_by(|a, b| forward.dot(*a).abs().total_cmp(&forward.dot(*b).abs()))
        .unwrap_or(DVec3::Z);
    forward.cross(least).normalize()
}
