//! Parallelograms, as lights and as meshes have them: two ways to say one.

use super::at::Span;
use super::report::Source;
use super::vector::{Direction, List, Point, Size2};
use crate::error::Result;
use crate::math::DVec3;

/// The keys of a quad, as far as they were given.
pub(super) struct QuadShape<'a> {
    pub corner: Option<&'a Point>,
    pub edges: Option<&'a List<Point, 2>>,
    pub centre: Option<&'a Point>,
    pub normal: Option<&'a Direction>,
    pub size: Option<&'a Size2>,
}

/// Corners, counter-clockwise seen from the side that the normal points to.
///
/// Errors: keys of both forms or of neither, and edges that are parallel; at `span`.
pub(super) fn corners(shape: &QuadShape<'_>, source: &Source, span: &Span) -> Result<[DVec3; 4]> {
    match (shape.corner, shape.edges, shape.centre, shape.normal, shape.size) {
        (Some(corner), Some(edges), None, None, None) => {
            let [a, b] = [edges.0[0].vec(), edges.0[1].vec()];
            if !spans_area(a, b) {
                let message = "the quad's edges are parallel or zero: it has no area";
                return Err(source.fault(span, message).into());
            }
            Ok(parallelogram(corner.vec(), a, b))
        }
        (None, None, Some(centre), Some(normal), Some(size)) => {
            let (right, up) = level_axes(normal.unit());
            let (a, b) = (right * size.0[0].0, up * size.0[1].0);
            Ok(parallelogram(centre.vec() - 0.5 * a - 0.5 * b, a, b))
        }
        _ => Err(source
            .fault(
                span,
                "a quad is given by `corner` and `edges`, or by `centre`, `normal` and `size`",
            )
            .help("give all keys of one form and none of the other")
            .into()),
    }
}

fn parallelogram(corner: DVec3, a: DVec3, b: DVec3) -> [DVec3; 4] {
    [corner, corner + a, corner + a + b, corner + b]
}

/// Directions first, so that neither tiny nor huge edges under- or overflow.
fn spans_area(a: DVec3, b: DVec3) -> bool {
    let unit = |v: DVec3| (v / v.abs().max_element()).normalize();
    a != DVec3::ZERO && b != DVec3::ZERO && unit(a).cross(unit(b)).length() > 1e-9
}

/// A level axis and one that completes it to a right-handed frame with the unit vector `normal`.
fn level_axes(normal: DVec3) -> (DVec3, DVec3) {
    let across = DVec3::Y.cross(normal);
    // Straight up or down there is no level axis of its own: x it is.
    let right = if across.length() > 1e-9 { across.normalize() } else { DVec3::X };
    (right, normal.cross(right))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed_with_the_normal() {
        for n in [DVec3::X, DVec3::NEG_Y, DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, -3.0)] {
            let n = n.normalize();
            let (right, up) = level_axes(n);
            assert!((right.cross(up) - n).length() < 1e-15, "{n}");
            assert!(right.y == 0.0);
        }
        assert_eq!(level_axes(DVec3::NEG_Y), (DVec3::X, DVec3::Z));
        assert_eq!(level_axes(DVec3::Z), (DVec3::X, DVec3::Y));
    }

    #[test]
    fn edges_of_any_length_span_an_area_unless_parallel() {
        assert!(spans_area(DVec3::X * 1e-30, DVec3::Y * 1e30));
        assert!(!spans_area(DVec3::X, DVec3::X * -7.0));
        assert!(!spans_area(DVec3::X, DVec3::ZERO));
    }
}
