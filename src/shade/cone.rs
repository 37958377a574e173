//! Ray cones: how much of a surface a ray stands for (Amanatides, 1984).
//!
//! A cone has a width where its ray starts and widens, or narrows, along the way. What curved mirrors and glass do to it
//! is that of rays near the normal, the same in all directions (Akenine-Möller et al., 2021). Rough mirrors
//! are taken for smooth ones: their many rays blur what they see by themselves.

use crate::intersect::{Hit, Ray, SurfaceInteraction, curvature, uv_gradients};
use crate::math::{DVec2, DVec3};
use crate::scene::Scene;

/// The cone around a ray.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct RayCone {
    /// Width where the ray is, scene space; negative beyond a focus.
    pub width: f32,
    /// By how much it widens along a unit of length; negative before a focus.
    pub spread: f32,
}

impl RayCone {
    /// The cone of a camera ray whose unit direction has the cosine `cos` to the view axis, along which a cone's spread is
    /// `spread`. A pixel off the axis is seen under a solid angle of cos³.
    #[inline(always)]
    pub fn of_camera(spread: f64, cos: f64) -> Self {
        Self { width: 0.0, spread: (spread * cos * cos.sqrt()) as f32 }
    }

    /// The cone where its ray has gone `length` further, scene space.
    #[inline(always)]
    pub fn advanced(self, length: f64) -> Self {
        Self { width: self.width + self.spread * length as f32, ..self }
    }

    /// The cone at the end of its `ray`: at `hit`, or where the ray starts if it meets nothing.
    #[inline(always)]
    pub fn at_end(self, ray: &Ray, hit: Option<&Hit>) -> Self {
        self.advanced(hit.map_or(0.0, |hit| hit.t * ray.dir.length()))
    }

    /// The cone after reflection or, by what has an index of refraction `transmitted` times as large, refraction at `si`,
    /// on which the ray came from `outside` or inside.
    pub fn scattered(
        self,
        scene: &Scene,
        si: &SurfaceInteraction,
        outside: bool,
        transmitted: Option<f64>,
    ) -> Self {
        let outward = curvature(scene, si);
        let curvature = if outside { outward } else { -outward };
        match transmitted {
            Some(eta) => self.refracted(curvature, eta),
            None => self.reflected(curvature),
        }
    }

    /// The cone after reflection by a surface of this curvature (per unit of length, positive where it bulges towards the
    /// ray): normals at both sides of the cone differ by an angle, and reflected rays by twice as much.
    pub fn reflected(self, curvature: f64) -> Self {
        let spread = self.spread + 2.0 * curvature as f32 * self.width;
        Self { spread, ..self }
    }

    /// The cone after refraction by a surface of this curvature, with `eta` the index of refraction behind it over
    /// that before it (Snell's law for small angles).
    pub fn refracted(self, curvature: f64, eta: f64) -> Self {
        let (curvature, inverse) = (curvature as f32, 1.0 / eta as f32);
        let spread = self.spread * inverse + curvature * self.width * (inverse - 1.0);
        Self { spread, ..self }
    }

    /// What the cone covers of the texture of the surface `si`, seen along `wo` (unit): two conjugate diameters of the
    /// ellipse, in texture coordinates of set number `set`. Not finite where coordinates have no gradient.
    pub fn footprint(
        self,
        scene: &Scene,
        si: &SurfaceInteraction,
        wo: DVec3,
        set: u8,
    ) -> [DVec2; 2] {
        let cos = wo.dot(si.ng);
        // Across the plane of incidence the cone is as wide as in the air, along it it is stretched.
        let along =
            (wo - si.ng * cos).try_normalize().unwrap_or_else(|| si.ng.any_orthonormal_vector());
        let across = si.ng.cross(along);
        let width = f64::from(self.width.abs());
        let [u, v] = uv_gradients(scene, si, set);
        let in_uv = |d: DVec3| DVec2::new(u.dot(d), v.dot(d));
        [in_uv(along * (width / cos.abs())), in_uv(across * width)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parallel_rays_meet_at_the_focus() {
        let parallel = RayCone { width: 0.1, spread: 0.0 };
        // A concave mirror of radius 4 has its focus at 2.
        assert_eq!(parallel.reflected(-0.25).advanced(2.0).width, 0.0);
        assert!(parallel.reflected(0.25).advanced(2.0).width > 0.19);
        // A ball of glass of index 2 focuses on its back: n / (n - 1) radii behind the front.
        let inside = parallel.refracted(1.0 / 3.0, 2.0);
        assert!(inside.advanced(6.0).width.abs() < 1e-7);
        // A ball of index 1.5 has its focus at n D / (4 (n - 1)) = 1.5 radii from the middle.
        let inside = parallel.refracted(1.0, 1.5).advanced(2.0);
        let behind = inside.refracted(-1.0, 1.0 / 1.5);
        assert!(behind.advanced(0.5).width.abs() < 1e-6);
    }

    #[test]
    fn a_window_of_flat_glass_changes_nothing_behind_it() {
        let cone = RayCone { width: 0.1, spread: 0.01 };
        let behind = cone.refracted(0.0, 1.5).refracted(0.0, 1.0 / 1.5);
        assert!((behind.spread - cone.spread).abs() < 1e-9);
    }
}
