//! A directional light.

use super::{EmittingSurface, FarField, LightData};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};

/// Parallel light from infinitely far (a delta light).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DirectionalLight {
    /// Unit vector from the surface towards the light.
    pub to_light: DVec3,
    /// Irradiance on a surface that faces it.
    pub irradiance: Rgb,
}

impl LightData for DirectionalLight {
    fn is_area(&self) -> bool {
        false
    }

    fn is_finite(&self) -> bool {
        self.to_light.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        Bounds3::EMPTY
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        self.to_light = transform.transform_vector3(self.to_light).normalize_or_zero();
        Ok(())
    }

    fn recentre(&mut self, _recentring: &Recentring) {}

    fn surface(&self) -> Option<EmittingSurface> {
        None
    }

    fn emission(&self) -> Rgb {
        self.irradiance
    }

    fn far_field(&self) -> FarField {
        FarField::parallel(self.to_light)
    }

    fn most_irradiance(&self, _cell: &Bounds3) -> f64 {
        1.0
    }
}
