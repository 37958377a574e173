//! The recheck: Embree's f32 hit computed again in f64, or found out to be none.

use super::super::cut_outs;
use super::super::triangle::{self, PlaneHit};
use super::{Candidate, EmbreeIntersector, ROUNDING};
use crate::embree::PacketHit;
use crate::math::DVec3;
use crate::ray::{Hit, PrimRef, Ray};
use crate::scene::Recheck;

/// How far beside its triangle a ray may pass, per unit of the largest coordinate: 4 ulp, less the
/// rounding of measuring it. That is what rounding the ray to f32 explains.
const EDGE_BAND: f64 = 7.99 * ROUNDING;

/// A hit in f64, and how sure its place along the ray is.
pub(super) struct Located {
    pub hit: Hit,
    /// How far along the ray, in `t`, the hit may lie from where it is said to be. Zero where the ray
    /// passes inside of the triangle; beside it, what the edge band across the ray comes to along it.
    slack: f64,
}

impl Located {
    /// Whether a hit that a turned ray found lies before one at `t` of the ray as it was asked for. Seen
    /// edge on, the neighbours of a triangle all lie within the band: turned, a ray meets another of them,
    /// and that is no sign that the first was wrong.
    pub fn lies_before(&self, t: f64) -> bool {
        self.hit.t + self.slack < t
    }
}

impl EmbreeIntersector<'_> {
    /// The hit in f64, or `None` for a phantom.
    #[inline]
    pub(super) fn recheck(&self, ray: &Ray, candidate: &Candidate) -> Option<Hit> {
        self.locate(ray, candidate).map(|located| located.hit)
    }

    /// The hit in f64 and how sure its place is, or `None` for a phantom.
    #[inline]
    pub(super) fn locate(&self, ray: &Ray, candidate: &Candidate) -> Option<Located> {
        let sure = |hit| Located { hit, slack: 0.0 };
        let hit = &candidate.hit;
        let Some(mesh) = self.scene.meshes.get(hit.prim.geom_id as usize) else {
            return self.recheck_sphere(ray, hit.prim).map(sure);
        };
        if self.rules.recheck == Recheck::Off {
            return Some(sure(self.as_it_is(hit, candidate.shift)));
        }
        let corners = mesh.corners(hit.prim.prim_id as usize);
        // A ray in the triangle's plane hits nothing, nor is a triangle without an inside hit.
        let met = triangle::meet_plane(ray, &corners)?;
        let (met, slack) = match met.is_inside() {
            true => (met, 0.0),
            false => beside(ray, &corners, met, candidate.shift)?,
        };
        let PlaneHit { t, u, v } = met;
        let hit = Hit { t, u, v, prim: hit.prim, rough: false };
        (ray.tnear..=ray.tfar).contains(&t).then_some(Located { hit, slack })
    }

    /// Embree's own numbers. Unless the recheck is off they are computed again when the surface is
    /// looked at.
    #[inline(always)]
    pub(super) fn as_it_is(&self, hit: &PacketHit, shift: f64) -> Hit {
        let (t, u, v) = (f64::from(hit.t) + shift, f64::from(hit.u), f64::from(hit.v));
        Hit { t, u, v, prim: hit.prim, rough: self.rules.recheck != Recheck::Off }
    }

    pub(super) fn recheck_sphere(&self, ray: &Ray, prim: PrimRef) -> Option<Hit> {
        let t = cut_outs::sphere_root(self.scene, ray, prim)?;
        Some(Hit { t, u: 0.0, v: 0.0, prim, rough: false })
    }
}

/// Whether the ray may in truth pass beside the triangle that Embree named.
///
/// Embree's edge functions are off by about 10 half ulp of (edge x distance x direction), rounding
/// of vertices and ray included, and the weights are those over the triangle's area as the ray sees
/// it: grazing hits, slivers and hits near an edge fail the test, and so does a hit that may in truth
/// lie behind the origin. `area` is twice the triangle's as the ray sees it, times the length of the ray's direction;
/// `edge` the longest of the mesh, so that no corner need be fetched.
#[inline(always)]
pub(super) fn is_risky(ray: &Ray, hit: &PacketHit, area: f64, edge: f64) -> bool {
    let least = f64::from(hit.u.min(hit.v).min(1.0 - hit.u - hit.v));
    let length = ray.dir.length();
    let distance = f64::from(hit.t) * length;
    let reach = ray.org.length() + distance;
    let bound = 16.0 * ROUNDING * edge * reach * length;
    // Written so that NaN is risky.
    let is_safe = least * area > bound && distance * area > bound * edge;
    !is_safe
}

/// Whether Embree took the hit for so much nearer than it is that what lies between was not looked at: in f32 the place of
/// a needle's plane is noise.
#[inline(always)]
pub(super) fn is_displaced(ray: &Ray, candidate: &Candidate, hit: &Hit) -> bool {
    let (length, t) = (ray.dir.length(), f64::from(candidate.hit.t));
    let reach = ray.at(candidate.shift).length() + t * length;
    (hit.t - candidate.shift - t) * length > 32.0 * ROUNDING * reach
}

/// Where a ray that meets its triangle's plane at `met`, outside, is nearest to the triangle, if that
/// is within the edge band, and what the band comes to along the ray. `None` for a phantom. The ray's
/// origin was moved by `shift` along it.
fn beside(ray: &Ray, corners: &[DVec3; 3], met: PlaneHit, shift: f64) -> Option<(PlaneHit, f64)> {
    let (nearest, distance) = triangle::nearest_on_outline(ray, corners)?;
    let largest = |p: DVec3| p.abs().max_element();
    let reach = corners.iter().fold(largest(ray.at(shift)), |reach, c| reach.max(largest(*c)));
    let band = EDGE_BAND * reach;
    if distance > band {
        return None;
    }
    // The plane's own t, unless the ray grazes it: then that point may be far away.
    let length = ray.dir.length();
    let apart = (met.t - nearest.t).abs() * length;
    let t = if apart <= band { met.t } else { nearest.t };
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    // 1 over the cosine to the normal; infinite in the plane.
    let slope = normal.length() * length / normal.dot(ray.dir).abs();
    Some((PlaneHit { t, ..nearest }, band * (1.0 + slope) / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn a_hit_that_may_lie_behind_the_origin_is_risky() {
        let ray = Ray::new(DVec3::X, DVec3::Z);
        let prim = PrimRef { geom_id: 0, prim_id: 0 };
        let at = |t: f32| PacketHit { t, u: 0.3, v: 0.3, ng: Vec3::Z, prim };
        assert!(!is_risky(&ray, &at(1.0), 1.0, 1.0));
        assert!(is_risky(&ray, &at(1e-9), 1.0, 1.0));
        assert!(is_risky(&ray, &at(1.0), f64::NAN, 1.0));
    }
}
