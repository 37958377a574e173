//! A sphere light.

use super::{EmittingShape, EmittingSurface, FarField, LightData, bound, place};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A sphere that emits outwards.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SphereLight {
    /// Centre.
    pub centre: DVec3,
    /// Radius, positive.
    pub radius: f64,
    /// Emitted radiance.
    pub radiance: Rgb,
}

impl LightData for SphereLight {
    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        self.centre.is_finite() && self.radius.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        bounds.include(self.centre - DVec3::splat(self.radius));
        bounds.include(self.centre + DVec3::splat(self.radius));
        bounds
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        let Self { centre, radius, radiance: _ } = self;
        place::move_sphere("a sphere light", centre, radius, transform)
    }

    fn recentre(&mut self, recentring: &Recentring) {
        self.centre = recentring.point_to_scene(self.centre);
        self.radius *= recentring.scale();
    }

    fn surface(&self) -> Option<EmittingSurface> {
        Some(EmittingSurface {
            shape: EmittingShape::Sphere(self.centre, self.radius),
            radiance: self.radiance,
            two_sided: false,
        })
    }

    fn emission(&self) -> Rgb {
        self.radiance
    }

    fn far_field(&self) -> FarField {
        FarField::everywhere(self.centre, self.radius, PI * self.radius * self.radius)
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        bound::of_sphere(self.centre, self.radius, cell)
    }
}
