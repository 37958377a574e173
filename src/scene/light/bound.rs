//! Upper bounds of irradiance in a box, for the shapes that kinds of lights share.

use crate::math::{Bounds3, DVec3};
use std::f64::consts::PI;

/// Per unit of radiance, from a flat light of this `area` in the box `around`, whose `height`s above its plane are
/// those of the box of points, on the side that emits; 0 where that is the other side.
///
/// Irradiance is at most the solid angle, which is at most `area · cos / d²`, and at most that of a half-space.
pub(super) fn of_flat(area: f64, around: &Bounds3, height: f64, cell: &Bounds3) -> f64 {
    if height <= 0.0 {
        return 0.0;
    }
    let distance = around.distance_to(cell);
    let cos = (height / distance).min(1.0);
    (area * cos / (distance * distance)).min(PI)
}

/// The largest height of a point of `cell` above the plane through `point` with unit normal `normal`; of both sides'
/// heights the larger one where the light is `two_sided`.
pub(super) fn most_height(point: DVec3, normal: DVec3, two_sided: bool, cell: &Bounds3) -> f64 {
    let middle = normal.dot(cell.centre() - point);
    let reach = 0.5 * normal.abs().dot(cell.extent());
    if two_sided { middle.abs() + reach } else { middle + reach }
}

/// Per unit of radiance, from a sphere: `π (r/d)²` where it is whole above the horizon.
pub(super) fn of_sphere(centre: DVec3, radius: f64, cell: &Bounds3) -> f64 {
    let share = radius / cell.distance_to_point(centre);
    (PI * share * share).min(PI)
}

/// Per unit of intensity, from a point.
pub(super) fn of_point(position: DVec3, cell: &Bounds3) -> f64 {
    let distance = cell.distance_to_point(position);
    1.0 / (distance * distance)
}

/// The largest cosine of the angle at `apex` between the unit vector `axis` and the direction to a point of `cell`.
pub(super) fn most_cos(apex: DVec3, axis: DVec3, cell: &Bounds3) -> f64 {
    let to_middle = cell.centre() - apex;
    let distance = to_middle.length();
    let sin = cell.radius() / distance;
    if sin.is_nan() || sin >= 1.0 {
        return 1.0;
    }
    let cos = (to_middle.dot(axis) / distance).clamp(-1.0, 1.0);
    let apart = (1.0 - cos * cos).max(0.0).sqrt();
    let most = (1.0 - sin * sin).sqrt();
    // Of the angle to the middle less that of the sphere around the box.
    if cos >= most { 1.0 } else { cos * most + apart * sin }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Bounds3 {
        Bounds3 { min: DVec3::NEG_ONE, max: DVec3::ONE }
    }

    #[test]
    fn a_cone_that_misses_the_box_has_a_small_cosine() {
        let apex = DVec3::new(0.0, 10.0, 0.0);
        assert_eq!(most_cos(apex, DVec3::NEG_Y, &unit_box()), 1.0);
        assert!(most_cos(apex, DVec3::X, &unit_box()) < 0.2);
        assert!(most_cos(apex, DVec3::Y, &unit_box()) < -0.9);
        assert_eq!(most_cos(DVec3::X, DVec3::Y, &unit_box()), 1.0);
    }

    #[test]
    fn a_flat_light_sends_nothing_behind_itself() {
        let height =
            |y: f64, two_sided| most_height(DVec3::Y * y, DVec3::NEG_Y, two_sided, &unit_box());
        assert_eq!(height(3.0, false), 4.0);
        assert_eq!(height(-1.0, false), 0.0);
        assert_eq!(height(-3.0, true), 4.0);
    }
}
