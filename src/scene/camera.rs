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

/// Narrowest field of view, degrees, and distance of the widest from 180: below it the directions
/// of neighbouring pixels would be the same numbers.
const LEAST_VFOV: f64 = 1e-6;

/// Sines of the angle between view and up below this are mostly rounding error.
const POLE: f64 = 1e-9;

impl Camera {
    /// A camera at `pose` with the vertical field of view `vfov_degrees` (1e-6 to 180 − 1e-6).
    ///
    /// Looking along `up`, or an `up` of zero, is allowed: the image's up direction is then the
    /// world axis least aligned with the view, of equal ones the first in the order z, y, x.
    ///
    /// Errors ([`Error::Usage`]): eye equal to target or so near that rounding decides the view,
    /// numbers that are not finite, a field of view out of range, an image without pixels.
    pub fn new(pose: &Pose, vfov_degrees: f64, width: u32, height: u32) -> Result<Self> {
        Self::check_vfov(vfov_degrees)?;
        if width == 0 || height == 0 {
            return Err(Error::Usage(format!("the image size {width}x{height} has no pixels")));
        }
        let forward = view_direction(pose)?;
        let right = right_of(forward, pose.up);
        let up = right.cross(forward);
        let roll = (pose.roll_degrees % 360.0).to_radians();
        let (sin, cos) = (libm::sin(roll), libm::cos(roll));
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

    /// Whether a vertical field of view, degrees, is one that [`Camera::new`] takes.
    pub(super) fn check_vfov(vfov_degrees: f64) -> Result<()> {
        if (LEAST_VFOV..=180.0 - LEAST_VFOV).contains(&vfov_degrees) {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "the vertical field of view is {vfov_degrees} degrees; it must lie between 0 and 180, \
             and at least {LEAST_VFOV} from either"
        )))
    }

    /// Direction (unit) through image point `(x, y)` in pixels; `(0, 0)` is the upper left corner
    /// of the image and `(0.5, 0.5)` the middle of its first pixel.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let sx = 2.0 * x / f64::from(self.width) - 1.0;
        let sy = 1.0 - 2.0 * y / f64::from(self.height);
        (self.forward + self.half_right * sx + self.half_up * sy).normalize()
    }

    /// Image point in pixels and depth along `forward` of `p`; `None` behind the eye, and where
    /// the image point is not a finite number.
    pub fn project(&self, p: DVec3) -> Option<(f64, f64, f64)> {
        let to = p - self.eye;
        let depth = to.dot(self.forward);
        let sx = to.dot(self.half_right) / (depth * self.half_right.length_squared());
        let sy = to.dot(self.half_up) / (depth * self.half_up.length_squared());
        let x = 0.5 * (sx + 1.0) * f64::from(self.width);
        let y = 0.5 * (1.0 - sy) * f64::from(self.height);
        (depth > 0.0 && x.is_finite() && y.is_finite()).then_some((x, y, depth))
    }

    /// The same camera in scene space.
    pub fn to_scene(&self, recentring: &Recentring) -> Self {
        Self { eye: recentring.point_to_scene(self.eye), ..*self }
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pose(eye: DVec3, target: DVec3, up: DVec3) -> Pose {
        Pose { eye, target, up, roll_degrees: 0.0 }
    }

    /// Right, up and backward: unit, perpendicular, right-handed, to rounding.
    fn assert_orthonormal(c: &Camera) {
        let (r, u) = (unit(c.half_right), unit(c.half_up));
        assert!(r.is_finite() && u.is_finite() && c.forward.is_finite());
        for (a, b) in [(r, u), (u, c.forward), (c.forward, r)] {
            assert!(a.dot(b).abs() < 4e-16, "{a} · {b} = {:e}", a.dot(b));
        }
        assert!((r.cross(u) + c.forward).length() < 1e-15);
    }

    #[test]
    fn a_plain_camera_looks_where_it_should() {
        let pose = pose(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y);
        let c = Camera::new(&pose, 90.0, 200, 100).expect("plain");
        assert_eq!(c.direction(100.0, 50.0), DVec3::NEG_Z);
        assert!(
            (c.direction(100.0, 0.0) - DVec3::new(0.0, 1.0, -1.0).normalize()).length() < 1e-15
        );
        assert!(
            (c.direction(200.0, 50.0) - DVec3::new(2.0, 0.0, -1.0).normalize()).length() < 1e-15
        );
        assert!(c.project(DVec3::Z * 5.0).is_none() && c.project(DVec3::Z * 6.0).is_none());
        assert!(c.project(DVec3::splat(f64::NAN)).is_none());
    }

    #[test]
    fn positive_roll_tilts_the_camera_clockwise() {
        let pose = Pose { roll_degrees: 90.0, ..pose(DVec3::Z, DVec3::ZERO, DVec3::Y) };
        let c = Camera::new(&pose, 90.0, 10, 10).expect("rolled");
        // The camera's top points right, so the world's top appears on the left.
        assert!((c.half_up - DVec3::X).length() < 1e-15);
        let (x, _, _) = c.project(DVec3::Y * 0.5).expect("in front");
        assert!(x < 5.0);
        let turns = Pose { roll_degrees: 360.0 * 1e6 + 90.0, ..pose };
        let same = Camera::new(&turns, 90.0, 10, 10).expect("rolled");
        assert!((same.half_up - c.half_up).length() < 1e-15);
    }

    #[test]
    fn views_along_up_and_nearly_along_it_have_a_frame() {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for sign in [1.0, -1.0] {
                for off in [0.0, 1e-16, 1e-12, 0.9e-9, 1.1e-9, 1e-8, 1e-6, 1e-3] {
                    for side in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::ONE] {
                        let target = axis * sign + side * off;
                        let pose = pose(DVec3::ZERO, target, axis);
                        assert_orthonormal(&Camera::new(&pose, 40.0, 64, 36).expect("allowed"));
                    }
                }
            }
        }
        let down = pose(DVec3::Y, DVec3::ZERO, DVec3::Y);
        let c = Camera::new(&down, 40.0, 64, 36).expect("allowed");
        assert!((unit(c.half_up) - DVec3::Z).length() < 1e-15, "z is up where up has no meaning");
        let none = pose_with_up_zero();
        assert_orthonormal(&Camera::new(&none, 40.0, 64, 36).expect("allowed"));
    }

    fn pose_with_up_zero() -> Pose {
        pose(DVec3::ONE, DVec3::ZERO, DVec3::ZERO)
    }

    #[test]
    fn extreme_sizes_and_lenses_stay_finite() {
        for scale in [1e-300, 1e-30, 1.0, 1e30, 1e150, 1e300] {
            let pose = pose(DVec3::new(1.0, 2.0, 3.0) * scale, DVec3::ZERO, DVec3::Y * scale);
            for vfov in [1e-6, 1e-3, 90.0, 179.0, 180.0 - 1e-6] {
                for (w, h) in [(1, 1), (1, u32::MAX), (u32::MAX, 1)] {
                    let c = Camera::new(&pose, vfov, w, h).expect("allowed");
                    assert_orthonormal(&c);
                    for (x, y) in [(0.0, 0.0), (f64::from(w), 0.0), (0.5, f64::from(h))] {
                        assert!((c.direction(x, y).length() - 1.0).abs() < 1e-15);
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_no_camera_is_an_error() {
        let good = pose(DVec3::Z, DVec3::ZERO, DVec3::Y);
        let bad = |p: Pose| Camera::new(&p, 40.0, 4, 4).is_err();
        assert!(!bad(good));
        assert!(bad(Pose { eye: DVec3::ZERO, ..good }));
        let far = DVec3::splat(1e6);
        assert!(bad(Pose { eye: far, target: far + DVec3::X * 2e-10, ..good }));
        assert!(!bad(Pose { eye: far, target: far + DVec3::X * 1e-8, ..good }));
        assert!(bad(Pose { eye: DVec3::X * 1e308, target: DVec3::X * -1e308, ..good }));
        assert!(bad(Pose { roll_degrees: f64::NAN, ..good }));
        for v in [f64::NAN, f64::INFINITY] {
            assert!(bad(Pose { eye: DVec3::splat(v), ..good }));
            assert!(bad(Pose { target: DVec3::splat(v), ..good }));
            assert!(bad(Pose { up: DVec3::splat(v), ..good }));
        }
        for vfov in [0.0, -1.0, 1e-7, 180.0, 200.0, f64::NAN] {
            assert!(Camera::new(&good, vfov, 4, 4).is_err());
        }
        assert!(Camera::new(&good, 40.0, 0, 4).is_err() && Camera::new(&good, 40.0, 4, 0).is_err());
    }

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-10.0f64..10.0).prop_map(DVec3::from_array)
    }

    proptest! {
        #[test]
        fn projecting_a_direction_gives_its_pixel_back(
            (eye, target, up) in (point(), point(), point()),
            (roll, vfov) in (-400.0f64..400.0, 0.1f64..170.0),
            (w, h) in (1u32..5000, 1u32..5000),
            (u, v, distance) in (0.0f64..1.0, 0.0f64..1.0, 1e-3f64..1e3),
        ) {
            prop_assume!(eye.distance(target) > 1e-3);
            let pose = Pose { eye, target, up, roll_degrees: roll };
            let c = Camera::new(&pose, vfov, w, h).expect("an ordinary camera");
            let (x, y) = (u * f64::from(w), v * f64::from(h));
            let direction = c.direction(x, y);
            prop_assert!((direction.length() - 1.0).abs() < 1e-15);
            let p = eye + direction * distance;
            let (px, py, depth) = c.project(p).expect("in front");
            // Rounding of p against the size of a pixel at its distance.
            let pixel = 2.0 * c.half_up.length() / f64::from(h) * depth;
            let bound = 1e-13 * (1.0 + (eye.length() + distance) / pixel) + 1e-12 * f64::from(w + h);
            prop_assert!((px - x).abs() < bound && (py - y).abs() < bound, "{px} {py} for {x} {y}");
            prop_assert!((depth - distance * direction.dot(c.forward)).abs() < 1e-12 * (10.0 + distance));
        }

        #[test]
        fn the_target_is_in_the_middle(eye in point(), target in point(), up in point()) {
            prop_assume!(eye.distance(target) > 1e-3);
            let c = Camera::new(&pose(eye, target, up), 50.0, 640, 360).expect("ordinary");
            let (x, y, _) = c.project(target).expect("in front");
            prop_assert!((x - 320.0).abs() < 1e-8 && (y - 180.0).abs() < 1e-8);
        }
    }
}
