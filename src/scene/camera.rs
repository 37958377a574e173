//! The camera: its pose in the world, and rays through its pixels.

#[cfg(test)]
mod tests;

use super::{Lens, Projection, Recentring, limits};
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::ray::Ray;
use serde::{Deserialize, Serialize};

/// Where a camera stands and looks, world space, f64.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Eye point.
    pub eye: DVec3,
    /// Point of interest; it projects to the image's centre, unless the picture is shifted.
    pub target: DVec3,
    /// Direction that is up in the image; need not be perpendicular to the view.
    pub up: DVec3,
    /// Turn about the view axis, degrees; positive tilts the camera clockwise.
    pub roll_degrees: f64,
}

impl Pose {
    /// A camera at `eye` that looks at `target`, with y up and without roll.
    pub fn look_at(eye: DVec3, target: DVec3) -> Self {
        Self { eye, target, up: DVec3::Y, roll_degrees: 0.0 }
    }
}

/// A camera at a pose, for one image size.
///
/// ```
/// use tweenray::math::DVec3;
/// use tweenray::scene::{Camera, Pose};
///
/// let pose = Pose::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO);
/// let camera = Camera::new(&pose, 40.0, 640, 360)?;
/// // The target projects to the middle of the image; its depth is along the view axis.
/// assert_eq!(camera.project(DVec3::ZERO), Some((320.0, 180.0, 5.0)));
/// assert_eq!(camera.direction(320.0, 180.0), -DVec3::Z);
/// # Ok::<(), tweenray::error::Error>(())
/// ```
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
    /// Where the middle of the image lies on the image plane, seen from the view axis: in half widths to the right,
    /// and in half heights upwards.
    pub middle: [f64; 2],
    /// Image columns.
    pub width: u32,
    /// Image rows.
    pub height: u32,
    /// The lens that its rays pass.
    pub lens: Lens,
}

/// Sines of the angle between view and up below this are mostly rounding error.
const POLE: f64 = 1e-9;

impl Camera {
    /// Bytes of its [`encode`](Self::encode).
    pub const BYTES: usize = 8 * (14 + Lens::NUMBERS) + 2 * 4;

    /// A pinhole camera at `pose` with the vertical field of view `vfov_degrees` (1e-6 to 180 − 1e-6).
    ///
    /// Looking along `up`, or an `up` of zero, is allowed: the image's up direction is then the
    /// world axis least aligned with the view, of equal ones the first in the order z, y, x.
    ///
    /// Errors ([`Error::Usage`]): eye equal to target or so near that rounding decides the view,
    /// numbers that are not finite, a field of view out of range, an image without pixels.
    pub fn new(pose: &Pose, vfov_degrees: f64, width: u32, height: u32) -> Result<Self> {
        Self::with_projection(pose, &Projection::centred(vfov_degrees), width, height)
    }

    /// As [`new`](Self::new), with another projection than the centred one.
    ///
    /// Errors ([`Error::Usage`]): those of `new`; a shift or a shape of pixels out of range.
    pub fn with_projection(
        pose: &Pose,
        projection: &Projection,
        width: u32,
        height: u32,
    ) -> Result<Self> {
        projection.check()?;
        if width == 0 || height == 0 {
            return Err(Error::Usage(format!("the image size {width}x{height} has no pixels")));
        }
        let forward = view_direction(pose)?;
        let right = right_of(forward, pose.up);
        let up = right.cross(forward);
        let roll = (pose.roll_degrees % 360.0).to_radians();
        let (sin, cos) = (libm::sin(roll), libm::cos(roll));
        let (right, up) = (right * cos - up * sin, up * cos + right * sin);
        let half_height = libm::tan(0.5 * projection.vfov_degrees.to_radians());
        let half_width =
            half_height * f64::from(width) / f64::from(height) * projection.pixel_aspect;
        Ok(Self {
            eye: pose.eye,
            forward,
            half_right: right * half_width,
            half_up: up * half_height,
            middle: projection.shift.map(|shift| 2.0 * shift),
            width,
            height,
            lens: Lens::Pinhole,
        })
    }

    /// The same camera with another lens.
    pub fn with_lens(self, lens: Lens) -> Self {
        Self { lens, ..self }
    }

    /// Direction (unit), from the eye, of the image point `(x, y)` in pixels; `(0, 0)` is the upper left
    /// corner of the image and `(0.5, 0.5)` the middle of its first pixel.
    #[inline(always)]
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        self.toward(x, y).normalize()
    }

    /// The same direction, 1 long along the view axis.
    #[inline(always)] // Once for each camera ray, as what calls it: a call costs a thirtieth of tracing the ray.
    fn toward(&self, x: f64, y: f64) -> DVec3 {
        let sx = 2.0 * x / f64::from(self.width) - 1.0 + self.middle[0];
        let sy = 1.0 - 2.0 * y / f64::from(self.height) + self.middle[1];
        self.forward + self.half_right * sx + self.half_up * sy
    }

    /// The ray through image point `(x, y)`, pixels, that passes the lens at `u` in the unit square, whose
    /// middle is the lens's. Its direction is unit.
    #[inline(always)]
    pub fn generate_ray(&self, x: f64, y: f64, u: [f64; 2]) -> Ray {
        if !self.lens.is_sampled() {
            return Ray::new(self.eye, self.direction(x, y));
        }
        let (offset, dir) = self.through_lens(x, y, u);
        Ray::new(self.eye + offset, dir.normalize())
    }

    /// Where [`generate_ray`](Self::generate_ray)'s ray starts, seen from the eye, and its direction, 1 long
    /// along the view axis.
    pub fn through_lens(&self, x: f64, y: f64, u: [f64; 2]) -> (DVec3, DVec3) {
        let toward = self.toward(x, y);
        if !self.lens.is_sampled() {
            return (DVec3::ZERO, toward);
        }
        let axes = [self.half_right.normalize(), self.half_up.normalize()];
        self.lens.bend(toward, axes, u)
    }

    /// Whether the rays of one image point meet within a pixel at `depth` along the view axis.
    pub fn is_in_focus(&self, depth: f64) -> bool {
        let blur = self.lens.blur(depth);
        blur == 0.0 || blur <= self.pixel_size() * depth
    }

    /// Image point in pixels and depth along `forward` of `p`; `None` behind the eye, and where
    /// the image point is not a finite number.
    pub fn project(&self, p: DVec3) -> Option<(f64, f64, f64)> {
        self.project_from_eye(p - self.eye)
    }

    /// As [`project`](Self::project), of what lies at `to` from the eye; also of a direction.
    pub fn project_from_eye(&self, to: DVec3) -> Option<(f64, f64, f64)> {
        let depth = to.dot(self.forward);
        let sx = to.dot(self.half_right) / (depth * self.half_right.length_squared());
        let sy = to.dot(self.half_up) / (depth * self.half_up.length_squared());
        let x = 0.5 * (sx - self.middle[0] + 1.0) * f64::from(self.width);
        let y = 0.5 * (1.0 - (sy - self.middle[1])) * f64::from(self.height);
        (depth > 0.0 && x.is_finite() && y.is_finite()).then_some((x, y, depth))
    }

    /// Edge of a pixel (its height) at distance 1 along the view axis.
    pub fn pixel_size(&self) -> f64 {
        2.0 * self.half_up.length() / f64::from(self.height)
    }

    /// The same camera in scene space.
    pub fn to_scene(&self, recentring: &Recentring) -> Self {
        let lens = self.lens.to_scene(recentring);
        Self { eye: recentring.point_to_scene(self.eye), lens, ..*self }
    }

    /// The camera as bytes, little endian: equal for equal cameras, bit for bit, and for no others.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let Self { eye, forward, half_right, half_up, middle, width, height, lens } = self;
        let vectors = [eye, forward, half_right, half_up].into_iter().flat_map(|v| v.to_array());
        let numbers = vectors.chain(*middle).chain(lens.numbers()).flat_map(f64::to_le_bytes);
        let mut bytes = [0; Self::BYTES];
        let edges = [width, height].into_iter().flat_map(|n| n.to_le_bytes());
        bytes.iter_mut().zip(numbers.chain(edges)).for_each(|(to, byte)| *to = byte);
        bytes
    }

    /// The camera that [`encode`](Self::encode) gave these bytes; `None` where no camera has them.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; Self::BYTES] = bytes.try_into().ok()?;
        let (numbers, edges) = bytes.split_at(Self::BYTES - 8);
        let number = |i: usize| numbers[8 * i..][..8].try_into().map(f64::from_le_bytes).ok();
        let edge = |i: usize| edges[4 * i..][..4].try_into().map(u32::from_le_bytes).ok();
        let vector =
            |i: usize| Some(DVec3::new(number(3 * i)?, number(3 * i + 1)?, number(3 * i + 2)?));
        let mut lens = [0.0; Lens::NUMBERS];
        for (i, of_lens) in lens.iter_mut().enumerate() {
            *of_lens = number(14 + i)?;
        }
        let camera = Self {
            eye: vector(0)?,
            forward: vector(1)?,
            half_right: vector(2)?,
            half_up: vector(3)?,
            middle: [number(12)?, number(13)?],
            width: edge(0)?,
            height: edge(1)?,
            lens: Lens::from_numbers(lens)?,
        };
        camera.is_sound().then_some(camera)
    }

    /// Whether [`Camera::new`] could have made it.
    fn is_sound(&self) -> bool {
        let is_edge = |n: u32| (1..=limits::MAX_EDGE).contains(&n);
        let is_length = |v: DVec3| v.is_finite() && v.length_squared().is_normal();
        is_edge(self.width)
            && is_edge(self.height)
            && self.eye.is_finite()
            && (self.forward.length() - 1.0).abs() < 1e-6
            && is_length(self.half_right)
            && is_length(self.half_up)
            && self.middle.iter().all(|x| x.is_finite())
    }
}

/// Unit vector from eye to target.
fn view_direction(pose: &Pose) -> Result<DVec3> {
    let Pose { eye, target, up, roll_degrees } = *pose;
    if !(eye.is_finite() && target.is_finite() && up.is_finite() && roll_degrees.is_finite()) {
        return Err(Error::Usage(format!(
            "the camera at {eye} looking at {target}, up {up}, roll {roll_degrees} degrees: \
             not all of these are finite numbers"
        )));
    }
    let view = target - eye;
    if !view.is_finite() {
        return Err(Error::Usage("the camera is too far from its target for f64".into()));
    }
    let scale = eye.abs().max(target.abs()).max_element();
    if view.abs().max_element() <= 4.0 * f64::EPSILON * scale {
        return Err(Error::Usage(format!(
            "the camera stands on its own target {target}; it looks nowhere"
        )));
    }
    Ok(unit(view))
}

/// Scaling by the largest component first keeps the length from under- and overflow.
fn unit(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}

/// The image's right: perpendicular to `forward` to rounding, however close `up` is to it.
fn right_of(forward: DVec3, up: DVec3) -> DVec3 {
    let candidate = if up == DVec3::ZERO { DVec3::ZERO } else { forward.cross(unit(up)) };
    if candidate.length() > POLE {
        // A short product has a large share of rounding error along `forward`: take it out.
        let right = candidate.normalize();
        return (right - forward * right.dot(forward)).normalize();
    }
    let least = [DVec3::Z, DVec3::Y, DVec3::X]
        .into_iter()
        .min_by(|a, b| forward.dot(*a).abs().total_cmp(&forward.dot(*b).abs()))
        .unwrap_or(DVec3::Z);
    forward.cross(least).normalize()
}
