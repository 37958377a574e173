//! A disk light.

use super::{EmittingShape, EmittingSurface, LightData, Size, place};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb, orthonormal_basis};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Triangles of the surface that rays see: its rim is off the circle by 1/3,000 of the radius.
const TRIANGLES: u32 = 128;

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
    /// The centre, then the corners of the regular polygon that has the disk's area, counter-clockwise on the
    /// emitting side.
    fn fan(&self) -> impl Iterator<Item = DVec3> {
        let (s, t) = orthonormal_basis(self.normal);
        let step = TAU / f64::from(TRIANGLES);
        let radius = self.radius * (step / libm::sin(step)).sqrt();
        let corner = move |i: u32| {
            let angle = step * f64::from(i);
            s * libm::cos(angle) + t * libm::sin(angle)
        };
        let centre = self.centre;
        let rim = (0..TRIANGLES).map(move |i| centre + corner(i) * radius);
        std::iter::once(centre).chain(rim)
    }
}

impl LightData for DiskLight {
    fn name(&self) -> &'static str {
        "disk"
    }

    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        self.centre.is_finite() && self.normal.is_finite() && self.radius.is_finite()
    }

    fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        self.fan().for_each(|p| bounds.include(p));
        bounds
    }

    fn size(&self) -> Option<Size> {
        Some(Size::Triangles(self.bounds()))
    }

    fn transform(&mut self, transform: &DAffine3, _mirrors: bool) -> Result<()> {
        let instead = ", or a quad light";
        self.radius *= place::uniform_scale("`a disk light` is a circle", instead, transform)?;
        self.centre = transform.transform_point3(self.centre);
        self.normal = transform.transform_vector3(self.normal).normalize_or_zero();
        Ok(())
    }

    fn recentre(&mut self, recentring: &Recentring) {
        // The triangles meet at an f32 corner; the light uses the very same point.
        self.centre = recentring.point_to_scene(self.centre).as_vec3().as_dvec3();
        self.radius *= recentring.scale();
    }

    fn surface(&self) -> Option<EmittingSurface> {
        let corners = self.fan().map(|p| p.as_vec3()).collect();
        let triangles = (0..TRIANGLES).map(|i| [0, 1 + i, 1 + (i + 1) % TRIANGLES]).collect();
        Some(EmittingSurface {
            shape: EmittingShape::Triangles(corners, triangles),
            radiance: self.radiance,
            two_sided: self.two_sided,
        })
    }
}
