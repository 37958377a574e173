//! A quad light.

use super::flat::Flat;
use super::{LightSample, ShadowTarget, irradiance};
use crate::intersect::PlaneError;
use crate::math::DVec3;
use crate::sampling::QuadWarp;
use crate::scene::{FaceLight, QuadLight};

/// A flat convex quad.
pub(super) struct Quad {
    warp: QuadWarp,
    corners: [DVec3; 4],
    plane: Flat,
    two_sided: bool,
    /// What is no farther from the plane, in scene space and per unit of its coordinates, lies on the light: 0 and less where
    /// nothing does that is lit.
    near: [f64; 2],
}

/// Rounding errors of a point of a face, per unit of its coordinates, in f64.
const ON_FACE: f64 = 1e-13;

impl Quad {
    pub fn new(light: &QuadLight) -> Self {
        let plane_error = PlaneError::of_quad(light);
        Self {
            warp: QuadWarp::new(light.corners),
            corners: light.corners,
            plane: Flat { normal: light.normal(), plane_error, area: light.area() },
            two_sided: light.two_sided,
            near: [-1.0, 0.0],
        }
    }

    /// A part of a mesh, whose own points it does not light: seen from them it has no height.
    pub fn of_face(light: &FaceLight) -> Self {
        let mut quad = Self::new(&light.part);
        let off_plane = |corner: &DVec3| quad.height(*corner).abs();
        let off_plane = light.part.corners.iter().map(off_plane).fold(0.0, f64::max);
        quad.near = [2.0 * off_plane, ON_FACE];
        let plane_error = &mut quad.plane.plane_error;
        *plane_error = plane_error.max(PlaneError::of(&light.triangle));
        quad
    }

    /// Above the plane on the emitting side, scene space.
    fn height(&self, p: DVec3) -> f64 {
        self.plane.normal.dot(p - self.corners[0])
    }

    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        if !self.reaches(p) {
            return 0.0;
        }
        irradiance::polygon(p, n, &self.corners)
    }

    /// Whether it emits towards `p`.
    pub fn reaches(&self, p: DVec3) -> bool {
        let [near, per_unit] = self.near;
        let height = self.height(p);
        let near = near + per_unit * (p.abs() + self.corners[0].abs()).max_element();
        (self.two_sided || height > 0.0) && height.abs() > near
    }

    /// Uniform over the area.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, u: [f64; 2]) -> LightSample {
        self.plane.sample_li(p, self.warp.point(u))
    }

    pub fn pdf_li(&self, p: DVec3, point: DVec3) -> f64 {
        self.plane.pdf(p, point).per_steradian()
    }

    pub fn above(&self, p: DVec3, n: DVec3) -> Option<ShadowTarget> {
        let point = irradiance::middle_above(p, n, &self.warp.corners())?;
        Some(self.plane.target(point))
    }
}
