//! A light on a face of a mesh.

use super::{EmittingSurface, FarField, LightData, QuadLight};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};

/// A face of a mesh that emits, or a part of one, scene space. Rays see the mesh, which may reflect light too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaceLight {
    /// What emits, with the mean of its radiance; `stands_for` times that where it sends the light of others too.
    pub part: QuadLight,
    /// Corners of the triangle of the mesh that it is a part of, or of one of two.
    pub triangle: [DVec3; 3],
    /// The area of all faces whose light it sends over its own: 1 of what sends its own light alone.
    pub stands_for: f64,
}

impl LightData for FaceLight {
    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        self.part.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        self.part.bounds()
    }

    fn transform(&mut self, transform: &DAffine3, mirrors: bool) -> Result<()> {
        self.triangle = self.triangle.map(|corner| transform.transform_point3(corner));
        self.part.transform(transform, mirrors)
    }

    fn recentre(&mut self, _recentring: &Recentring) {}

    fn surface(&self) -> Option<EmittingSurface> {
        None
    }

    fn emission(&self) -> Rgb {
        self.part.radiance
    }

    fn far_field(&self) -> FarField {
        self.part.far_field()
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        self.part.most_irradiance(cell)
    }
}
