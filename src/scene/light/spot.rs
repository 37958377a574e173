//! A spot light.

use super::{EmittingSurface, FarField, LightData, bound, place};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A cone of light with a smooth edge. With a radius it is a small sphere that shines into the cone and casts
/// soft shadows; without, it is a delta light. It is not seen itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpotLight {
    /// Where it is.
    pub position: DVec3,
    /// Unit vector along the cone's axis, away from the light.
    pub direction: DVec3,
    /// Radiant intensity along the axis.
    pub intensity: Rgb,
    /// Cosine of the angle from the axis up to which the intensity is full.
    pub cos_inner: f64,
    /// Cosine of the angle from the axis beyond which there is none; at most `cos_inner`.
    pub cos_outer: f64,
    /// Radius of the sphere that shines; 0 for hard shadows.
    pub radius: f64,
}

impl SpotLight {
    /// The share of the axis' intensity that is sent at an angle of this cosine from the axis: smooth from 1 to 0
    /// between the two angles, cubic in the cosine (Pharr, Jakob and Humphreys, 2023, section 12.2.1).
    pub fn falloff(&self, cos: f64) -> f64 {
        let Self { cos_inner, cos_outer, .. } = *self;
        if cos >= cos_inner {
            return 1.0;
        }
        if cos <= cos_outer {
            return 0.0;
        }
        let x = (cos - cos_outer) / (cos_inner - cos_outer);
        x * x * (3.0 - 2.0 * x)
    }
}

impl LightData for SpotLight {
    fn is_area(&self) -> bool {
        self.radius > 0.0
    }

    fn is_finite(&self) -> bool {
        let Self { position, direction, intensity: _, cos_inner, cos_outer, radius } = self;
        position.is_finite()
            && direction.is_finite()
            && [cos_inner, cos_outer, radius].iter().all(|x| x.is_finite())
    }

    fn bounds(&self) -> Bounds3 {
        Bounds3::EMPTY
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        let scale = place::uniform_scale("`a spot light` shines into a round cone", "", transform)?;
        self.radius *= scale;
        self.position = transform.transform_point3(self.position);
        self.direction = transform.transform_vector3(self.direction).normalize_or_zero();
        Ok(())
    }

    fn recentre(&mut self, recentring: &Recentring) {
        self.position = recentring.point_to_scene(self.position);
        self.intensity = recentring.intensity_to_scene(self.intensity);
        self.radius *= recentring.scale();
    }

    fn surface(&self) -> Option<EmittingSurface> {
        None
    }

    fn emission(&self) -> Rgb {
        self.intensity
    }

    fn far_field(&self) -> FarField {
        let cosines = [self.cos_inner, self.cos_outer];
        FarField::cone((self.position, self.radius), self.direction, cosines)
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        let cos = bound::most_cos(self.position, self.direction, cell);
        let falloff = self.falloff(cos);
        if falloff == 0.0 {
            return 0.0;
        }
        let shines = match self.is_area() {
            true => {
                bound::of_sphere(self.position, self.radius, cell)
                    / (PI * self.radius * self.radius)
            }
            false => bound::of_point(self.position, cell),
        };
        falloff * shines
    }
}
