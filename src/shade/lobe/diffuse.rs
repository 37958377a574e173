//! Lambertian reflection.

use crate::intersect::SurfaceInteraction;
use crate::math::Rgb;
use crate::scene::{Material, Scene};
use crate::shade::texture;

/// Light sent out alike in all directions (Lambert, 1760).
pub(in crate::shade) struct Diffuse {
    /// Share of irradiance that is sent out.
    pub albedo: Rgb,
}

impl Diffuse {
    /// The lobe of `material` at `si`; `None` where it has none.
    #[inline(always)]
    pub fn of(scene: &Scene, material: &Material, si: &SurfaceInteraction) -> Option<Self> {
        // What is NaN or negative goes on, to be counted at its pixel.
        (material.diffuse != Rgb::ZERO).then(|| Self { albedo: albedo(scene, material, si) })
    }
}

/// Diffuse reflectance at `si`, texture included.
pub(in crate::shade) fn albedo(scene: &Scene, material: &Material, si: &SurfaceInteraction) -> Rgb {
    match material.texture {
        Some(id) => material.diffuse * texture::bilinear(&scene.textures[id as usize], si.uv),
        None => material.diffuse,
    }
}
