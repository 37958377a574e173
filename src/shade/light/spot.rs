//! A spot light.

use super::View;
use super::point::Point;
use super::sphere::Sphere;
use crate::math::DVec3;
use crate::scene::{PointLight, SphereLight, SpotLight};
use std::f64::consts::PI;

/// A cone of light: a point or a sphere, times a falloff by the angle between the cone's axis and the direction from
/// the light's middle.
pub(super) struct Spot {
    body: Body,
    light: SpotLight,
}

/// What shines.
enum Body {
    Point(Point),
    /// A sphere, and its radiance per unit of intensity.
    Sphere(Sphere, f64),
}

impl Spot {
    pub fn new(light: &SpotLight) -> Self {
        let SpotLight { position, intensity, radius, .. } = *light;
        let body = if radius > 0.0 {
            let sphere = SphereLight { centre: position, radius, radiance: intensity };
            Body::Sphere(Sphere::new(&sphere), 1.0 / (PI * radius * radius))
        } else {
            Body::Point(Point::new(&PointLight { position, intensity }))
        };
        Self { body, light: light.clone() }
    }

    pub fn unshadowed(&self, p: DVec3, n: DVec3) -> f64 {
        let falloff = self.falloff(p);
        if falloff == 0.0 {
            return 0.0;
        }
        falloff
            * match &self.body {
                Body::Point(point) => point.unshadowed(p, n),
                Body::Sphere(sphere, radiance) => radiance * sphere.unshadowed(p, n),
            }
    }

    /// The body as seen from `p`; `None` from within.
    pub fn seen_from(&self, p: DVec3) -> Option<View<'_>> {
        Some(match &self.body {
            Body::Point(point) => View::Point(point),
            Body::Sphere(sphere, radiance) => {
                View::Sphere(sphere.seen_from(p, radiance * self.falloff(p))?)
            }
        })
    }

    /// The share of the axis' intensity that is sent towards `p`.
    fn falloff(&self, p: DVec3) -> f64 {
        let away = p - self.light.position;
        self.light.falloff((away.dot(self.light.direction) / away.length()).clamp(-1.0, 1.0))
    }
}
