//! Axis-aligned boxes in f64.

use super::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

/// An axis-aligned box; empty while `min > max` on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounds3 {
    /// Lower corner.
    pub min: DVec3,
    /// Upper corner.
    pub max: DVec3,
}

impl Bounds3 {
    /// The box of no point: `include` grows it.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// True while no point was included.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Grows the box to hold `p`.
    pub fn include(&mut self, p: DVec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// The smallest box that holds both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box that holds this one moved by `transform`; an empty one stays empty.
    pub fn transformed(self, transform: &DAffine3) -> Self {
        let mut moved = Self::EMPTY;
        for corner in (0..8).filter(|_| !self.is_empty()) {
            let edge = |axis| if corner >> axis & 1 == 0 { self.min[axis] } else { self.max[axis] };
            moved.include(transform.transform_point3(DVec3::from([0, 1, 2].map(edge))));
        }
        moved
    }

    /// Middle of the box; zero for the empty box.
    pub fn centre(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { 0.5 * self.min + 0.5 * self.max }
    }

    /// Edge lengths; zero for the empty box.
    pub fn extent(&self) -> DVec3 {
        if self.is_empty() { DVec3::ZERO } else { self.max - self.min }
    }

    /// Half the diagonal.
    pub fn radius(&self) -> f64 {
        0.5 * self.extent().length()
    }

    /// The largest coordinate of any point in the box, its sign left out; infinite for an empty box.
    pub fn largest_coordinate(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// Whether `p` lies in the closed box.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// The least distance from `p` to a point of the box; infinite for an empty box.
    pub fn distance_to_point(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length()
    }

    /// The least distance between points of two boxes; infinite where one is empty.
    pub fn distance_to(&self, other: &Self) -> f64 {
        (self.min - other.max).max(other.min - self.max).max(DVec3::ZERO).length()
    }

    /// The part `(t_near, t_far)` of the ray `org + t·dir`, t in `[tnear, tfar]`, inside the box.
    ///
    /// `inv_dir` is `1/dir` by component; zero components may be ±infinity. NaN from `0·inf`
    /// (a ray in a face's plane) counts as inside that slab.
    pub fn clip(&self, org: DVec3, inv_dir: DVec3, tnear: f64, tfar: f64) -> Option<(f64, f64)> {
        let (mut near, mut far) = (tnear, tfar);
        for axis in 0..3 {
            let a = (self.min[axis] - org[axis]) * inv_dir[axis];
            let b = (self.max[axis] - org[axis]) * inv_dir[axis];
            if a.is_nan() || b.is_nan() {
                continue;
            }
            // No `f64::min`: rustc 1.95 folded it wrongly for a box and a ray that are constants, with an infinite end.
            let (enters, leaves) = if a < b { (a, b) } else { (b, a) };
            if enters > near {
                near = enters;
            }
            if leaves < far {
                far = leaves;
            }
        }
        (near <= far).then_some((near, far))
    }
}
