//! Diffuse reflection: light sent out alike in all directions (Lambert, 1760).

use crate::intersect::{SurfaceInteraction, corner_weights};
use crate::math::{DVec3, Rgb};
use crate::scene::{Material, Scene};
use crate::shade::cone::RayCone;
use crate::shade::texture;

/// The share of irradiance that is sent out at `si` towards `wo` (unit), the texture's mean over the ray's `cone` and
/// the vertex colours included, where no layer lies above.
pub(in crate::shade) fn albedo(
    scene: &Scene,
    material: &Material,
    si: &SurfaceInteraction,
    wo: DVec3,
    cone: RayCone,
) -> Rgb {
    if !(material.texture.is_some() | material.vertex_colours) {
        return material.diffuse;
    }
    painted(scene, (material, material.diffuse), (si, wo, cone))
}

/// `colour` times what image and vertex colours of `material` say where the point that is `seen` lies.
pub(super) fn painted(
    scene: &Scene,
    (material, colour): (&Material, Rgb),
    (si, wo, cone): (&SurfaceInteraction, DVec3, RayCone),
) -> Rgb {
    let mut albedo = colour;
    if let Some(map) = &material.texture {
        albedo *= texture::shown(scene, map, (si, wo, cone));
    }
    // No sphere has any.
    let mesh = scene.meshes.get(si.prim.geom_id as usize);
    if let Some((mesh, colours)) = mesh.and_then(|m| m.colours.as_ref().map(|c| (m, c))) {
        let prim = si.prim.prim_id as usize;
        let weights = corner_weights(mesh.corners(prim), si.p);
        albedo *= colours.between(mesh.triangles[prim], weights);
    }
    albedo
}
