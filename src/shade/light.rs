//! Samples on area lights, and what delta lights send: before any shadow ray.

use super::irradiance;
use crate::intersect::{Facet, Target};
use crate::math::{DVec3, Rgb};
use crate::sampling::{QuadWarp, SphereCone};
use crate::scene::Light;

/// A point on an area light as seen from a surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// The point, scene space.
    pub target: Target,
    /// Unshadowed irradiance that the sample stands for, up to a factor that all samples of one
    /// surface point share; 0 where the light does not shine.
    pub weight: f64,
}

/// An area light with what sampling it needs, computed once a frame.
#[allow(clippy::large_enum_variant)] // A handful of lights: nothing to gain from a box.
pub enum AreaLight {
    /// A flat quad.
    Quad {
        /// Uniform points on it.
        warp: QuadWarp,
        /// Corners.
        corners: [DVec3; 4],
        /// Unit normal of the emitting side.
        normal: DVec3,
        /// Whether the back emits too.
        two_sided: bool,
        /// What f32 may make of its two triangles.
        facet: Facet,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        centre: DVec3,
        /// Radius.
        radius: f64,
    },
}

/// An area light as seen from one surface point.
pub enum SeenLight<'a> {
    /// A quad: its points, unit normal and facets.
    Quad(&'a QuadWarp, DVec3, Facet),
    /// A sphere: its cone of directions, and centre.
    Sphere(SphereCone, DVec3),
}

impl AreaLight {
    /// Prepares `light`; `None` for delta lights.
    pub fn new(light: &Light) -> Option<Self> {
        match light {
            Light::Quad(q) => Some(Self::Quad {
                warp: QuadWarp::new(q.corners),
                corners: q.corners,
                normal: q.normal(),
                two_sided: q.two_sided,
                facet: Facet::of_quad(&q.corners),
            }),
            Light::Sphere { centre, radius, .. } => {
                Some(Self::Sphere { centre: *centre, radius: *radius })
            }
            Light::Point { .. } | Light::Directional { .. } => None,
        }
    }

    /// Unshadowed irradiance at `p` with unit normal `n` per unit radiance; 0 where no light can arrive.
    pub fn irradiance(&self, p: DVec3, n: DVec3) -> f64 {
        match self {
            Self::Quad { corners, normal, two_sided, .. } => {
                if !two_sided && normal.dot(p - corners[0]) <= 0.0 {
                    return 0.0;
                }
                irradiance::polygon(p, n, corners)
            }
            Self::Sphere { centre, radius } => irradiance::sphere(p, n, *centre, *radius),
        }
    }

    /// The light as seen from `p`; `None` from within.
    pub fn seen_from(&self, p: DVec3) -> Option<SeenLight<'_>> {
        Some(match self {
            Self::Quad { warp, normal, facet, .. } => SeenLight::Quad(warp, *normal, *facet),
            Self::Sphere { centre, radius } => {
                SeenLight::Sphere(SphereCone::new(*centre, *radius, p)?, *centre)
            }
        })
    }
}

impl SeenLight<'_> {
    /// A point of the light above the horizon of `n`, in the middle of what is: for slivers that
    /// no sample meets. `None` where nothing is.
    pub fn above(&self, p: DVec3, n: DVec3) -> Option<LightSample> {
        match self {
            Self::Quad(warp, normal, facet) => {
                let point = irradiance::middle_above(p, n, &warp.corners())?;
                let target = Target { point, normal: *normal, facet: *facet };
                Some(LightSample { target, weight: 1.0 })
            }
            Self::Sphere(cone, centre) => {
                let (dir, distance) = cone.above(n)?;
                let point = p + dir * distance;
                let normal = (point - *centre).normalize();
                let target = Target { point, normal, facet: Facet::EXACT };
                Some(LightSample { target, weight: 1.0 })
            }
        }
    }

    /// The light's point for `u` in the unit square: uniform over area (quad) or over solid angle
    /// (sphere; Shirley, Wang and Zimmerman, 1996).
    pub fn sample(&self, p: DVec3, n: DVec3, u: [f64; 2]) -> LightSample {
        match self {
            Self::Quad(warp, normal, facet) => {
                let point = warp.point(u);
                let to_light = point - p;
                let d2 = to_light.length_squared();
                let cos_light = to_light.dot(*normal).abs();
                let weight = (to_light.dot(n) * cos_light / (d2 * d2)).max(0.0);
                LightSample { target: Target { point, normal: *normal, facet: *facet }, weight }
            }
            Self::Sphere(cone, centre) => {
                let (dir, distance) = cone.direction(u);
                let point = p + dir * distance;
                let normal = (point - *centre).normalize();
                let target = Target { point, normal, facet: Facet::EXACT };
                LightSample { target, weight: dir.dot(n).max(0.0) }
            }
        }
    }
}

/// Radiance of an area light; zero for delta lights.
pub fn radiance(light: &Light) -> Rgb {
    match light {
        Light::Quad(q) => q.radiance,
        Light::Sphere { radiance, .. } => *radiance,
        Light::Point { .. } | Light::Directional { .. } => Rgb::ZERO,
    }
}

/// What a delta light sends to `p` with unit normal `n`: irradiance, unshadowed, and where the
/// shadow ray goes. `None` where it does not shine or for area lights.
pub fn delta(light: &Light, p: DVec3, n: DVec3) -> Option<(Rgb, ShadowTarget)> {
    match light {
        Light::Point { position, intensity } => {
            let to_light = *position - p;
            let d2 = to_light.length_squared();
            let cos = to_light.dot(n) / d2.sqrt();
            lit(cos).then(|| (*intensity * (cos / d2) as f32, ShadowTarget::Point(*position)))
        }
        Light::Directional { to_light, irradiance } => {
            let cos = to_light.dot(n);
            lit(cos).then(|| (*irradiance * cos as f32, ShadowTarget::Direction(*to_light)))
        }
        Light::Quad(_) | Light::Sphere { .. } => None,
    }
}

/// Whether light arrives from above; NaN goes on, to be counted at its pixel.
fn lit(cos: f64) -> bool {
    cos > 0.0 || cos.is_nan()
}

/// Where a shadow ray to a delta light goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowTarget {
    /// To a point.
    Point(DVec3),
    /// Without end.
    Direction(DVec3),
}
