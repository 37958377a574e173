//! A quad light.

use super::{EmittingShape, EmittingSurface, FarField, LightData, bound};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb};
use crate::scene::Recentring;
use serde::{Deserialize, Serialize};

/// A quad's corners may leave its plane by this share of its size: file coordinates have six digits or so.
const FLAT: f64 = 1e-5;

/// A flat convex quad that emits from the side its corners run counter-clockwise on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct QuadLight {
    /// Corners in order. Where the last two are the same, it is a triangle.
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

    /// The corners of the flat convex quad of two triangles of one orientation that share a side.
    pub fn joined(p: [DVec3; 3], q: [DVec3; 3]) -> Option<[DVec3; 4]> {
        let mut sides = (0..9).map(|k| (k / 3, k % 3));
        let (i, j) = sides.find(|(i, j)| p[*i] == q[(j + 1) % 3] && p[(i + 1) % 3] == q[*j])?;
        let quad = [p[i], q[(j + 2) % 3], p[(i + 1) % 3], p[(i + 2) % 3]];
        Self::is_flat_and_convex(&quad).then_some(quad)
    }

    /// Whether these corners, in order, are those of a flat convex quad.
    pub fn is_flat_and_convex(corners: &[DVec3; 4]) -> bool {
        let [a, b, c, d] = *corners;
        let normal = (c - a).cross(d - b).normalize_or_zero();
        let size = (c - a).length().max((d - b).length());
        let turns_left = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(r - q).dot(normal) > 0.0;
        (b - a).dot(normal).abs() <= FLAT * size
            && [(a, b, c), (b, c, d), (c, d, a), (d, a, b)]
                .into_iter()
                .all(|(p, q, r)| turns_left(p, q, r))
    }

    /// The triangles that it consists of, by their corners' places.
    pub fn triangles(&self) -> &'static [[u32; 3]] {
        let [.., c, d] = &self.corners;
        if c == d { &[[0, 1, 2]] } else { &[[0, 1, 2], [0, 2, 3]] }
    }

    /// Area.
    pub fn area(&self) -> f64 {
        0.5 * self.area_vector().length()
    }
}

impl LightData for QuadLight {
    fn is_area(&self) -> bool {
        true
    }

    fn is_finite(&self) -> bool {
        self.corners.iter().all(|c| c.is_finite())
    }

    fn bounds(&self) -> Bounds3 {
        let mut bounds = Bounds3::EMPTY;
        self.corners.iter().for_each(|c| bounds.include(*c));
        bounds
    }

    fn transform(&mut self, transform: &DAffine3, mirrors: bool) -> Result<()> {
        self.corners = self.corners.map(|c| transform.transform_point3(c));
        if mirrors {
            self.corners.swap(1, 3);
        }
        Ok(())
    }

    fn recentre(&mut self, recentring: &Recentring) {
        // The emitting mesh holds f32 corners; the light uses the very same points.
        self.corners = self.corners.map(|c| recentring.point_to_scene(c).as_vec3().as_dvec3());
    }

    fn surface(&self) -> Option<EmittingSurface> {
        let corners = self.corners.iter().map(|c| c.as_vec3()).collect();
        Some(EmittingSurface {
            shape: EmittingShape::Triangles(corners, self.triangles().to_vec()),
            radiance: self.radiance,
            two_sided: self.two_sided,
        })
    }

    fn emission(&self) -> Rgb {
        self.radiance
    }

    fn far_field(&self) -> FarField {
        let centre = self.corners.iter().sum::<DVec3>() / 4.0;
        let reach = self.corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        FarField::flat((centre, reach), self.area(), self.normal(), self.two_sided)
    }

    fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        let normal = self.normal();
        // A corner may lie a rounding error off the plane of the others.
        let height = |corner: &DVec3| bound::most_height(*corner, normal, self.two_sided, cell);
        let height = self.corners.iter().map(height).fold(0.0, f64::max);
        bound::of_flat(self.area(), &self.bounds(), height, cell)
    }
}
