//! Diffuse reflection: light sent out alike in all directions (Lambert, 1760).

use crate::intersect::SurfaceInteraction;
use crate::math::{DVec3, Rgb};
use crate::scene::{Material, Scene};
use crate::shade::cone::RayCone;
use crate::shade::texture;

/// Whether `material` reflects any light diffusely. What is NaN or negative goes on, to be counted at its pixel.
#[inline(always)]
pub(in crate::shade) fn is_diffuse(material: &Material) -> bool {
    material.diffuse != Rgb::ZERO
}

/// The share of irradiance that is sent out at `si` towards `wo` (unit), the texture's mean over the ray's `cone` included.
pub(in crate::shade) fn albedo(
    scene: &Scene,
    material: &Material,
    si: &SurfaceInteraction,
    wo: DVec3,
    cone: RayCone,
) -> Rgb {
    let Some(map) = &material.texture else { return material.diffuse };
    let footprint = cone.footprint(scene, si, wo);
    material.diffuse * texture::mapped(scene, map, si.uv, footprint)
}
