//! Shading normals by the policy of a mesh.

mod smooth;

use crate::math::{DVec3, Vec3};
use crate::scene::{NormalPolicy, WorldMesh};

/// The warning about normals that are zero or not finite.
pub(super) const UNUSABLE: &str =
    "a normal has no length or is not a number: flat shading in its place";

/// Sets the shading normals of `mesh` by `policy`; [`NormalPolicy::Auto`] keeps those
/// that the mesh has.
pub fn apply(mesh: &mut WorldMesh, policy: NormalPolicy) {
    mesh.normals = match policy {
        NormalPolicy::Flat => None,
        NormalPolicy::Auto { .. } if mesh.normals.is_some() => return,
        NormalPolicy::Auto { crease_degrees } | NormalPolicy::Smooth { crease_degrees } => {
            Some(smooth::smooth(&mesh.positions, &mesh.triangles, crease_degrees))
        }
    };
}

/// The unit vector along `n`, or zero where `n` has no direction (zero or not finite).
pub(super) fn unit_or_zero(n: DVec3) -> Vec3 {
    let size = n.abs().max_element();
    if !(n.is_finite() && size > 0.0) {
        return Vec3::ZERO;
    }
    // Scaling first keeps squares from under- and overflow.
    (n / size).normalize().as_vec3()
}

#[cfg(test)]
mod tests;
