//! Rays and hits.

use crate::math::DVec3;

/// A primitive: triangle or analytic sphere `prim_id` of geometry `geom_id`.
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

/// What an intersector returns, nothing more.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f64,
    /// Weight of vertex 1; 0 on spheres.
    pub u: f64,
    /// Weight of vertex 2; 0 on spheres.
    pub v: f64,
    /// What was hit.
    pub prim: PrimRef,
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

    /// Whether an intersector may see the ray: finite origin and direction, a direction that is
    /// not zero, `tnear <= tfar`, neither NaN. (A NaN costs Embree a thousand times a normal ray.)
    pub fn is_valid(&self) -> bool {
        self.org.is_finite()
            && self.dir.is_finite()
            && self.dir != DVec3::ZERO
            && self.tnear <= self.tfar
            && self.tnear.is_finite()
    }
}
