//! Keeping the image level where a path looks straight along its up direction.
//!
//! There `forward × up` has no direction, and on the far side its sign is reversed: a camera that
//! is carried over its target would turn by half a circle between two frames. A path in a plane
//! that holds `up` (the only one that meets the pole for more than an instant's chance) keeps the
//! plane's normal as its horizontal instead: it passes over, and is upside down afterwards, as a
//! camera on a crane is. Elsewhere a frame at the pole takes the limit of the frames around it.

use super::CameraPath;
use crate::math::DVec3;
use crate::scene::Pose;

/// Sines below this are rounding error: there the view runs along `up`.
const POLE: f64 = 1e-9;

/// The up direction for `pose`, which is the path's at `progress`.
pub fn steady_up(path: &CameraPath, progress: f64, pose: &Pose) -> DVec3 {
    let right = horizontal(pose);
    let forward = unit(pose.target - pose.eye);
    if let Some(normal) = plane_normal(path) {
        // Near the pole the plane knows the horizontal better than the product does.
        return match right {
            r if r.length() < 1e-3 => normal.cross(forward),
            r if r.dot(normal) < 0.0 => -pose.up,
            _ => pose.up,
        };
    }
    if right.length() > POLE {
        return pose.up;
    }
    // Earlier first: a move that ends at the pole ends as it came.
    for near in [progress - 1e-4, progress + 1e-4] {
        let right = horizontal(&path.pose(near.clamp(0.0, 1.0)));
        if right.length() > POLE {
            return right.cross(forward);
        }
    }
    pose.up
}

/// `forward × up` of unit vectors; zero where the eye is on the target.
fn horizontal(pose: &Pose) -> DVec3 {
    unit(pose.target - pose.eye).cross(unit(pose.up))
}

/// `v` at length 1, whatever its size; zero stays zero.
pub fn unit(v: DVec3) -> DVec3 {
    if v == DVec3::ZERO {
        return v;
    }
    (v / v.abs().max_element()).normalize()
}

/// The constant horizontal of a path whose views and whose one up direction lie in a plane,
/// pointing right at the start; `None` for other paths, and for views along one line.
fn plane_normal(path: &CameraPath) -> Option<DVec3> {
    let (ends, up) = eyes_and_targets(path)?;
    let largest = |of: fn(&(DVec3, DVec3)) -> DVec3| {
        ends.iter().map(|e| of(e).abs().max_element()).fold(0.0, f64::max)
    };
    let size = largest(|(eye, target)| *target - *eye);
    // Far from the origin the coordinates' own rounding is the limit.
    let far = largest(|(eye, target)| eye.abs().max(target.abs()));
    let tolerance = POLE.max(8.0 * f64::EPSILON * far / size);
    let up = unit(up);
    let views: Vec<DVec3> = ends.iter().map(|(eye, target)| (*target - *eye) / size).collect();
    let off_axis = views.iter().map(|v| v.cross(up)).find(|r| r.length() > tolerance)?;
    let normal = off_axis.normalize();
    // A tilt of the normal counts for little where the first view off the axis is a short one.
    let planar = views.iter().all(|v| v.dot(normal).abs() <= tolerance / off_axis.length());
    let turns = views.iter().any(|v| v.cross(views[0]).length() > tolerance);
    (planar && turns && tolerance < 1e-3).then_some(normal)
}

/// The eyes of a curved or straight path with their targets, and its up direction.
fn eyes_and_targets(path: &CameraPath) -> Option<(Vec<(DVec3, DVec3)>, DVec3)> {
    match path {
        CameraPath::Pan { from, to, target, up, .. } => {
            Some((vec![(*from, *target), (*to, *target)], *up))
        }
        CameraPath::BSpline { points, target, up, .. } => {
            Some((points.iter().map(|p| (*p, *target)).collect(), *up))
        }
        CameraPath::Keys(keys) => {
            let up = keys.first()?.pose.up;
            let same = keys.iter().all(|k| k.pose.up == up);
            same.then(|| (keys.iter().map(|k| (k.pose.eye, k.pose.target)).collect(), up))
        }
        CameraPath::Still(_) | CameraPath::Orbit { .. } | CameraPath::Frames(_) => None,
    }
}
