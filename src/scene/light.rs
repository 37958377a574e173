//! Lights: plain data, in world space inside a `World` and in scene space inside a `Scene`.

use crate::math::{DVec3, Rgb};
use serde::{Deserialize, Serialize};

/// A light. Radiometric units: radiance W/(m²·sr), intensity W/sr, irradiance W/m².
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Light {
    /// A point that emits alike in all directions (a delta light).
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity; irradiance at distance d is `intensity / d²` in world units.
        intensity: Rgb,
    },
    /// Parallel light from infinitely far (a delta light).
    Directional {
        /// Unit vector from the surface towards the light.
        to_light: DVec3,
        /// Irradiance on a surface that faces it.
        irradiance: Rgb,
    },
    /// A flat convex quad.
    Quad(QuadLight),
    /// A sphere that emits outwards.
    Sphere {
        /// Centre.
        centre: DVec3,
        /// Radius, positive.
        radius: f64,
        /// Emitted radiance.
        radiance: Rgb,
    },
}

/// A flat convex quad that emits from the side its corners run counter-clockwise on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QuadLight {
    /// Corners in order.
    pub corners: [DVec3; 4],
    /// Emitted radiance.
    pub radiance: Rgb,
    /// Whether the back emits too.
    pub two_sided: bool,
}

impl QuadLight {
    /// Cross product of the diagonals: twice the area long, along the emitting side's normal.
    pub fn area_vector(&self) -> DVec3 {
        (self.corners[2] - self.corners[0]).cross(self.corners[3] - self.corners[1])
    }

    /// Unit normal of the emitting side.
    pub fn normal(&self) -> DVec3 {
        self.area_vector().normalize()
    }

    /// Area.
    pub fn area(&self) -> f64 {
        0.5 * self.area_vector().length()
    }
}

/// What a ray that hits nothing sees, and how it lights surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Constant background radiance.
    pub radiance: Rgb,
    /// Whether that radiance lights diffuse surfaces through occluded sky rays.
    pub lights: bool,
    /// Plain ambient term: each diffuse hit gets `albedo · ambient`, without any ray.
    pub ambient: Rgb,
}

impl Default for Sky {
    fn default() -> Self {
        Self { radiance: Rgb::ZERO, lights: true, ambient: Rgb::ZERO }
    }
}
