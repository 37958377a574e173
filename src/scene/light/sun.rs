//! A sun: light from a disk at infinity.

use super::{EmittingSurface, FarField, LightData};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A disk of the sky that emits alike all over; rays that leave the scene see it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SunLight {
    /// Unit vector towards its middle.
    pub to_light: DVec3,
    /// Half of the angle under which it is seen, radians: above 0, below π/2.
    pub angular_radius: f64,
    /// Radiance.
    pub radiance: Rgb,
}

impl SunLight {
    /// The sun that sends this `irradiance` to a surface that faces it.
    pub fn of_irradiance(to_light: DVec3, angular_radius: f64, irradiance: Rgb) -> Self {
        let sin = libm::sin(angular_radius);
        let radiance = (irradiance.as_dvec3() / (PI * sin * sin)).as_vec3();
        Self { to_light, angular_radius, radiance }
    }

    /// Sine of the angular radius.
    pub fn sin(&self) -> f64 {
        libm::sin(self.angular_radius)
    }
}

impl LightData for SunLight {
    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        // What is no unit vector, and a disk of no size, have no place either.
        let is_unit = (self.to_light.length_squared() - 1.0).abs() < 1e-6;
        is_unit && self.angular_radius > 0.0 && self.angular_radius < 0.5 * PI
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
        self.radiance
    }

    fn far_field(&self) -> FarField {
        FarField::distant_disk(self.to_light, self.sin())
    }

    fn most_irradiance(&self, _cell: &Bounds3) -> f64 {
        PI * self.sin() * self.sin()
    }
}
