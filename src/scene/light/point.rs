//! A point light.

use super::{EmittingSurface, FarField, LightData, bound};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};

/// A point that emits alike in all directions (a delta light).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointLight {
    /// Where it is.
    pub position: DVec3,
    /// Radiant intensity; irradiance at distance d is `intensity / d²` in world units.
    pub intensity: Rgb,
}

impl LightData for PointLight {
    fn is_area(&self) -> bool {
        false
    }

    fn is_finite(&self) -> bool {
        self.position.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        Bounds3::EMPTY
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        self.position = transform.transform_point3(self.position);
        Ok(())
    }

    fn recentre(&mut self, recentring: &Recentring) {
        self.position = recentring.point_to_scene(self.position);
        self.intensity = recentring.intensity_to_scene(self.intensity);
    }

    fn surface(&self) -> Option<EmittingSurface> {
        None
    }

    fn emission(&self) -> Rgb {
        self.intensity
    }

    fn far_field(&self) -> FarField {
        FarField::everywhere(self.position, 0.0, 1.0)
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        bound::of_point(self.position, cell)
    }
}
