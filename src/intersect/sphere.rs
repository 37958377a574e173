//! The f64 ray–sphere test, the same in both intersectors (`ffi/shim.c` mirrors it for Embree).

use super::Ray;
use crate::math::DVec3;

/// The first root in `[tnear, tfar]` where the surface `is_there`, or `None`.
///
/// A ray that leaves this sphere (`leaving`) starts on it: the root nearer to zero is that start and does not count.
pub(super) fn first_root(
    ray: &Ray,
    centre: DVec3,
    radius: f64,
    leaving: bool,
    is_there: impl Fn(f64) -> bool,
) -> Option<f64> {
    let roots = roots(ray, centre, radius)?;
    let counts = |t: &f64| (ray.tnear..=ray.tfar).contains(t) && is_there(*t);
    if leaving {
        return end_of_leaving(roots).map(|end| roots[end]).filter(counts);
    }
    roots.into_iter().find(counts)
}

/// Which of its roots a ray that starts on the sphere can hit. The start is whichever root is nearer to zero, and only
/// the other one counts, if it lies ahead.
pub(super) fn end_of_leaving([near, far]: [f64; 2]) -> Option<usize> {
    let end = usize::from(near.abs() <= far.abs());
    ([near, far][end] > 0.0).then_some(end)
}

/// Both roots, ascending, whatever the ray's ends; `None` where the line passes the sphere by.
///
/// The distance from the centre to the line is taken from the point of the line nearest the
/// centre, not from `b² − ac`, which cancels for far spheres (Haines et al., 2019).
pub(super) fn roots(ray: &Ray, centre: DVec3, radius: f64) -> Option<[f64; 2]> {
    let a = ray.dir.length_squared();
    let to_centre = centre - ray.org;
    let middle = to_centre.dot(ray.dir) / a;
    let offset = to_centre - ray.dir * middle;
    let inside = radius * radius - offset.length_squared();
    if inside < 0.0 || !middle.is_finite() {
        return None;
    }
    let half_chord = (inside / a).sqrt();
    Some([middle - half_chord, middle + half_chord])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn first_root(ray: &Ray, centre: DVec3, radius: f64, leaving: bool) -> Option<f64> {
        super::first_root(ray, centre, radius, leaving, |_| true)
    }

    #[test]
    fn a_root_in_a_hole_does_not_count() {
        let ray = Ray::new(DVec3::new(-3.0, 0.0, 0.0), DVec3::X);
        let first =
            |is_there: fn(f64) -> bool| super::first_root(&ray, DVec3::ZERO, 1.0, false, is_there);
        assert_eq!(first(|t| t > 3.0), Some(4.0));
        assert_eq!(first(|_| false), None);
    }

    #[test]
    fn finds_entry_from_outside_and_exit_from_inside() {
        let at = |x: f64| Ray::new(DVec3::new(x, 0.0, 0.0), DVec3::X);
        assert_eq!(first_root(&at(-3.0), DVec3::ZERO, 1.0, false), Some(2.0));
        assert_eq!(first_root(&at(0.0), DVec3::ZERO, 1.0, false), Some(1.0));
        assert_eq!(first_root(&at(3.0), DVec3::ZERO, 1.0, false), None);
    }

    #[test]
    fn a_ray_that_leaves_sees_only_the_far_side() {
        let inward = Ray::new(DVec3::NEG_X, DVec3::X);
        assert_eq!(first_root(&inward, DVec3::ZERO, 1.0, true), Some(2.0));
        let outward = Ray::new(DVec3::X, DVec3::X);
        assert_eq!(first_root(&outward, DVec3::ZERO, 1.0, true), None);
    }

    #[test]
    fn a_far_sphere_keeps_its_silhouette() {
        // Distance 1e7 radii: b² − ac would lose the radius altogether.
        let far = DVec3::new(0.0, 0.0, 1e7);
        for (x, hit) in [(0.999_999, true), (1.000_001, false)] {
            let ray = Ray::new(DVec3::new(x, 0.0, 0.0), DVec3::Z);
            assert_eq!(first_root(&ray, far, 1.0, false).is_some(), hit);
        }
    }
}
