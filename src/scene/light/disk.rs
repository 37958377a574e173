//! A disk light.

use super::{EmittingShape, EmittingSurface, FarField, LightData, bound, place};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb, orthonormal_basis};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Corners of the surface that rays see, an even number: its rim is off the circle by at most 1/4,000 of the radius.
const CORNERS: u32 = 128;

/// A flat disk that emits from the side that its normal points to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiskLight {
    /// Centre.
    pub centre: DVec3,
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// Radius, positive.
    pub radius: f64,
    /// Emitted radiance.
    pub radiance: Rgb,
    /// Whether the back emits too.
    pub two_sided: bool,
}

impl DiskLight {
    /// The corners of the regular polygon that has the disk's area, counter-clockwise on the emitting side.
    fn corners(&self) -> impl Iterator<Item = DVec3> {
        let (s, t) = orthonormal_basis(self.normal);
        let step = TAU / f64::from(CORNERS);
        let radius = self.radius * (step / libm::sin(step)).sqrt();
        let corner = move |i: u32| {
            let angle = step * f64::from(i);
            s * libm::cos(angle) + t * libm::sin(angle)
        };
        let centre = self.centre;
        (0..CORNERS).map(move |i| centre + corner(i) * radius)
    }
}

impl LightData for DiskLight {
    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        self.centre.is_finite() && self.normal.is_finite() && self.radius.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        self.corners().for_each(|p| bounds.include(p));
        bounds
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        let instead = ", or a quad light";
        self.radius *= place::uniform_scale("`a disk light` is a circle", instead, transform)?;
        self.centre = transform.transform_point3(self.centre);
        self.normal = transform.transform_vector3(self.normal).normalize_or_zero();
        Ok(())
    }

    fn recentre(&mut self, recentring: &Recentring) {
        self.centre = recentring.point_to_scene(self.centre);
        self.radius *= recentring.scale();
    }

    fn surface(&self) -> Option<EmittingSurface> {
        let corners = self.corners().map(|p| p.as_vec3()).collect();
        // Strips from side to side: a fan's triangles would all meet in one point, where rays slip through.
        let strip = |i: u32| {
            let (left, right) = (CORNERS - i, CORNERS - i - 1);
            [[i, i + 1, left % CORNERS], [i + 1, right, left % CORNERS]]
        };
        let triangles = (0..CORNERS / 2).flat_map(strip);
        let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
        Some(EmittingSurface {
            shape: EmittingShape::Triangles(corners, triangles),
            radiance: self.radiance,
            two_sided: self.two_sided,
        })
    }

    fn emission(&self) -> Rgb {
        self.radiance
    }

    fn far_field(&self) -> FarField {
        let area = PI * self.radius * self.radius;
        FarField::flat((self.centre, self.radius), area, self.normal, self.two_sided)
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        let height = bound::most_height(self.centre, self.normal, self.two_sided, cell);
        let reach = (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO).to_array();
        let reach = DVec3::from(reach.map(f64::sqrt)) * self.radius;
        let around = Bounds3 { min: self.centre - reach, max: self.centre + reach };
        bound::of_flat(PI * self.radius * self.radius, &around, height, cell)
    }
}
