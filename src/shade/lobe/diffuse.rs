//! Diffuse reflection: light sent out alike in all directions (Lambert, 1760).

use crate::intersect::SurfaceInteraction;
use crate::math::Rgb;
use crate::scene::{Material, Scene};
use crate::shade::texture;

/// Whether `material` reflects any light diffusely. What is NaN or negative goes on, to be counted at its pixel.
#[inline(always)]
pub(in crate::shade) fn is_diffuse(material: &Material) -> bool {
    material.diffuse != Rgb::ZERO
}

/// The share of irradiance that is sent out at `si`, texture included.
pub(in crate::shade) fn albedo(scene: &Scene, material: &Material, si: &SurfaceInteraction) -> Rgb {
    match material.texture {
        Some(id) => material.diffuse * texture::bilinear(&scene.textures[id as usize], si.uv),
        None => material.diffuse,
    }
}
