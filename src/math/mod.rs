//! Vectors, boxes and frames of reference.
//!
//! Geometry is computed in f64 ([`DVec3`]) and stored in f32 where Embree needs it; colour is
//! linear f32 ([`Rgb`]). Nothing here knows what a scene is.

pub use glam::{DAffine2, DAffine3, DMat2, DMat3, DQuat, DVec2, DVec3, Vec2, Vec3};

mod bounds;
pub mod bulk;
mod double_double;
mod srgb;

pub use bounds::Bounds3;
pub use double_double::{DoubleDouble, DoubleDouble3};
pub use srgb::{srgb_decode, srgb_encode};

/// Linear RGB: radiance, irradiance, reflectance; Rec. 709 primaries.
pub type Rgb = Vec3;

/// Two unit vectors that make a right-handed orthonormal frame with the unit vector `n`.
///
/// No branch on a small component, hence no loss near the poles (Duff et al., 2017).
pub fn orthonormal_basis(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

/// Relative luminance of linear Rec. 709 RGB.
pub fn luminance(c: Rgb) -> f32 {
    0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_is_orthonormal_in_every_direction() {
        for n in [DVec3::X, DVec3::NEG_Z, DVec3::Z, DVec3::new(1e-9, 1e-9, -1.0).normalize()] {
            let (s, t) = orthonormal_basis(n);
            for (a, b) in [(s, t), (s, n), (t, n)] {
                assert!(a.dot(b).abs() < 1e-15);
            }
            assert!((s.length() - 1.0).abs() < 1e-15 && (t.length() - 1.0).abs() < 1e-15);
            assert!(s.cross(t).dot(n) > 0.999_999);
        }
    }
}
