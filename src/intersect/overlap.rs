//! Triangles as Embree gets them: a little larger than they are, so that neighbours overlap.
//!
//! Embree's robust mode never loses a ray between two triangles at their common edge, but it does
//! at a vertex: each edge function there is rounding noise, and the triangles around need not agree.
//! Grown by more than that noise, at least one of them reports a hit, whatever the ray's kind, and
//! the f64 recheck with the true corners says what was really hit.

use crate::math::{DVec3, Vec3};
use crate::scene::Mesh;
use rayon::prelude::*;

/// How far each edge moves outwards, scene space: two f32 ulp of a coordinate near 1. One was
/// enough for 20 million rays at vertices; rays from further away are noisier.
pub(super) const OVERLAP: f64 = 4.0 / (1u64 << 24) as f64;
/// No corner moves further than this share of its shorter edge: a needle must not grow out of
/// proportion.
const MOST: f64 = 0.25;

/// Corners of the grown triangles, three a triangle, and the spare element that Embree wants.
pub(super) fn grown(mesh: &Mesh) -> Vec<Vec3> {
    let mut corners = vec![Vec3::ZERO; 3 * mesh.triangles.len() + 1];
    let triangles = corners.par_chunks_exact_mut(3).enumerate();
    triangles.for_each(|(prim, out)| {
        let true_corners = mesh.corners(prim);
        for (k, out) in out.iter_mut().enumerate() {
            let moved =
                moved_corner(true_corners[k], true_corners[(k + 1) % 3], true_corners[(k + 2) % 3]);
            *out = moved.as_vec3();
        }
    });
    corners
}

/// Corner `p` of a triangle with the other corners `q` and `r`, where both its edges have moved
/// outwards in the triangle's plane.
fn moved_corner(p: DVec3, q: DVec3, r: DVec3) -> DVec3 {
    let (to_q, to_r) = (q - p, r - p);
    let (q_length, r_length) = (to_q.length(), to_r.length());
    let (to_q, to_r) = (to_q / q_length, to_r / r_length);
    let sine = to_q.cross(to_r).length();
    let outwards = -(to_q + to_r) / sine * OVERLAP;
    // A triangle without an inside gets none; written so that NaN ends here.
    if !(sine > 0.0 && outwards.is_finite()) {
        return p;
    }
    outwards.clamp_length_max(MOST * q_length.min(r_length)) + p
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_move_out_by_the_overlap() {
        let corners =
            [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.4, 0.25, 0.3), DVec3::new(0.2, 0.5, 0.4)];
        let moved: [DVec3; 3] = std::array::from_fn(|k| {
            moved_corner(corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3])
        });
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        for k in 0..3 {
            let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
            let outwards = (b - a).cross(normal).normalize();
            assert!(outwards.dot(c - a) < 0.0);
            for p in [moved[k], moved[(k + 1) % 3]] {
                assert!(((p - a).dot(outwards) - OVERLAP).abs() < 1e-3 * OVERLAP);
                assert!((p - a).dot(normal).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn what_has_no_inside_stays_as_it_is() {
        let p = DVec3::new(0.5, 0.5, 0.5);
        assert_eq!(moved_corner(p, p, p), p);
        assert_eq!(moved_corner(p, p + DVec3::X, p + DVec3::X * 2.0), p);
        let needle = moved_corner(p, p + DVec3::X, p + DVec3::new(1.0, 1e-12, 0.0));
        assert!((needle - p).length() <= MOST);
    }
}
