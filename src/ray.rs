//! Rays and hits: plain data, below everything that traces.

use crate::math::DVec3;

/// A primitive: triangle or analytic sphere `prim_id` of geometry `geom_id`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PrimRef {
    /// Geometry.
    pub geom_id: u32,
    /// Primitive in it.
    pub prim_id: u32,
}

impl PrimRef {
    /// No primitive.
    pub const NONE: Self = Self { geom_id: u32::MAX, prim_id: u32::MAX };
}

/// A half-line with a valid segment, scene space, f64: points are `org + t·dir`.
///
/// Its layout is that of `TrRay` in `ffi/shim.h`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Origin.
    pub org: DVec3,
    /// Direction, not necessarily unit.
    pub dir: DVec3,
    /// Start of the valid segment.
    pub tnear: f64,
    /// End of the valid segment.
    pub tfar: f64,
    /// The primitive that the ray leaves; it cannot be hit again.
    pub exclude: PrimRef,
}

/// The answer of an intersector, nothing more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// Weight of vertex 1; 0 on spheres.
    pub u: f64,
    /// Weight of vertex 2; 0 on spheres.
    pub v: f64,
    /// The primitive that was hit.
    pub prim: PrimRef,
    /// Whether `t`, `u` and `v` are f32 numbers, to be computed again in f64 from the triangle
    /// once its corners are at hand. That the ray meets the triangle is certain all the same.
    pub rough: bool,
}

impl Ray {
    /// A ray from `org` along `dir` without an end and without an excluded primitive.
    pub fn new(org: DVec3, dir: DVec3) -> Self {
        Self { org, dir, tnear: 0.0, tfar: f64::INFINITY, exclude: PrimRef::NONE }
    }

    /// The point at `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.org + self.dir * t
    }

    /// Whether an intersector may see the ray: no NaN, an origin and a direction whose squares f32
    /// can hold, a direction that is not zero, `0 <= tnear <= tfar`, a finite `tnear`. (Embree
    /// would cut a segment that begins behind the origin; the oracle would not.)
    ///
    /// (A NaN origin costs Embree a thousand times a normal ray, and returns nothing useful.)
    #[inline]
    pub fn is_valid(&self) -> bool {
        const LARGEST: f64 = 1e18;
        let org = self.org.abs().max_element();
        let dir = self.dir.abs().max_element();
        // max_element ignores NaN, the sum does not.
        let sum = self.org.x + self.org.y + self.org.z + self.dir.x + self.dir.y + self.dir.z;
        org <= LARGEST
            && (1.0 / LARGEST..=LARGEST).contains(&dir)
            && !sum.is_nan()
            && self.tnear >= 0.0
            && self.tnear <= self.tfar
            && self.tnear.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_rays_are_recognised() {
        let good = Ray::new(DVec3::ZERO, DVec3::Z);
        assert!(good.is_valid());
        assert!(Ray { dir: DVec3::new(0.0, -0.0, 1e17), ..good }.is_valid());
        let nan = f64::NAN;
        for bad in [
            Ray { org: DVec3::new(nan, 0.0, 0.0), ..good },
            Ray { org: DVec3::new(0.0, f64::INFINITY, 0.0), ..good },
            Ray { org: DVec3::splat(1e30), ..good },
            Ray { dir: DVec3::ZERO, ..good },
            Ray { dir: DVec3::new(1.0, nan, 0.0), ..good },
            Ray { dir: DVec3::splat(1e-20), ..good },
            Ray { dir: DVec3::splat(1e38), ..good },
            Ray { tnear: nan, ..good },
            Ray { tfar: nan, ..good },
            Ray { tnear: 2.0, tfar: 1.0, ..good },
            Ray { tnear: -1.0, ..good },
        ] {
            assert!(!bad.is_valid(), "{bad:?}");
        }
    }
}
