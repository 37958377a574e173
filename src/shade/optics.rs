//! Mirrors and smooth dielectrics: directions and Fresnel's shares, f64.

use crate::math::DVec3;

/// Mirror direction of `wo` (leaving the surface) about the unit normal `n`, also leaving.
pub fn reflect(wo: DVec3, n: DVec3) -> DVec3 {
    n * (2.0 * wo.dot(n)) - wo
}

/// What a smooth dielectric boundary does to a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Split {
    /// Share reflected, unpolarised, in `[0, 1]`; 1 is total internal reflection.
    pub reflectance: f64,
    /// Unit direction of the transmitted ray, leaving; `None` at total internal reflection.
    pub refracted: Option<DVec3>,
}

/// Fresnel's equations and Snell's law at a boundary with unit normal `n`, for `wo` leaving
/// towards the viewer; `n` may point to either side. `eta` is the index on the far side of the
/// boundary over the index on the viewer's side; where that is no positive number the reflectance
/// is NaN.
pub fn split(wo: DVec3, n: DVec3, eta: f64) -> Split {
    if !(eta > 0.0 && eta < f64::INFINITY) {
        return Split { reflectance: f64::NAN, refracted: None };
    }
    let cos = wo.dot(n);
    let (n, cos) = if cos < 0.0 { (-n, -cos) } else { (n, cos) };
    let cos = cos.min(1.0);
    let Some(cos_t) = refracted_cosine(cos, eta) else {
        return Split { reflectance: 1.0, refracted: None };
    };
    let refracted = ((n * cos - wo) / eta - n * cos_t).normalize();
    Split { reflectance: fresnel(cos, cos_t, eta), refracted: Some(refracted) }
}

/// The reflectance alone, of light at the cosine `cos` to the normal, at most 1; on either side.
pub fn reflectance(cos: f64, eta: f64) -> f64 {
    if !(eta > 0.0 && eta < f64::INFINITY) {
        return f64::NAN;
    }
    let cos = cos.abs().min(1.0);
    refracted_cosine(cos, eta).map_or(1.0, |cos_t| fresnel(cos, cos_t, eta))
}

/// The cosine on the far side, of light at the cosine `cos` on the near one; `None` at total internal reflection.
fn refracted_cosine(cos: f64, eta: f64) -> Option<f64> {
    // (eta cos_t)², in a form that is exactly cos² where the indices are equal.
    let scaled = cos * cos + (eta - 1.0) * (eta + 1.0);
    // What is NaN goes on.
    if scaled <= 0.0 { None } else { Some(scaled.sqrt() / eta) }
}

/// Share that a thin pane reflects of light at the cosine `cos` to its normal, where `ior` is the index of
/// refraction of the pane over that around it: with R for one face, R + (1-R)² R (1 + R² + R⁴ + ...) by all
/// reflections between both faces (Stokes, 1862), of unpolarised light at each.
pub fn pane_reflectance(cos: f64, ior: f64) -> f64 {
    let of_face = reflectance(cos, ior);
    2.0 * of_face / (1.0 + of_face)
}

/// Unpolarised Fresnel reflectance from the cosines on both sides.
fn fresnel(cos: f64, cos_t: f64, eta: f64) -> f64 {
    let parallel = (eta * cos - cos_t) / (eta * cos + cos_t);
    let perpendicular = (cos - eta * cos_t) / (cos + eta * cos_t);
    let both = 0.5 * (parallel * parallel + perpendicular * perpendicular);
    // Grazing on both sides of eta = 1 is 0/0; nothing is there to reflect.
    if eta == 1.0 && both.is_nan() { 0.0 } else { both.clamp(0.0, 1.0) }
}

/// `direction`, mirrored at the plane of `ng` where it points to the other side than `wanted`.
///
/// A shading normal can send a reflection into the surface or a refraction out of it; mirroring
/// keeps it on its side and is continuous where it grazes the plane.
pub fn keep_side(direction: DVec3, ng: DVec3, wanted_outside: bool) -> DVec3 {
    let height = direction.dot(ng);
    if (height > 0.0) == wanted_outside { direction } else { direction - ng * (2.0 * height) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wo(angle: f64) -> DVec3 {
        DVec3::new(libm::sin(angle), 0.0, libm::cos(angle))
    }

    #[test]
    fn normal_incidence_reflects_the_textbook_share() {
        for eta in [1.5f64, 1.0 / 1.5, 2.4] {
            let expected = ((eta - 1.0) / (eta + 1.0)).powi(2);
            assert!((split(DVec3::Z, DVec3::Z, eta).reflectance - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn snell_holds_at_a_million_angles() {
        for i in 0..1_000_000 {
            let angle = i as f64 * std::f64::consts::FRAC_PI_2 / 1_000_000.0;
            let s = split(wo(angle), DVec3::Z, 1.5);
            let t = s.refracted.expect("no total reflection into glass");
            let sin_t = t.x.hypot(t.y);
            assert!((libm::sin(angle) - 1.5 * sin_t).abs() <= 1e-12);
            assert!((0.0..=1.0).contains(&s.reflectance));
        }
    }

    #[test]
    fn equal_indices_reflect_nothing_and_grazing_reflects_all() {
        for i in 0..1000 {
            let angle = i as f64 * std::f64::consts::FRAC_PI_2 / 1000.0;
            assert_eq!(split(wo(angle), DVec3::Z, 1.0).reflectance, 0.0);
        }
        assert_eq!(split(DVec3::X, DVec3::Z, 1.5).reflectance, 1.0);
    }

    #[test]
    fn total_internal_reflection_starts_at_the_critical_angle() {
        let critical = libm::asin(1.0 / 1.5);
        let at = |angle| split(wo(angle), DVec3::Z, 1.0 / 1.5);
        assert!(at(critical - 1e-9).refracted.is_some());
        assert_eq!(at(critical + 1e-9), Split { reflectance: 1.0, refracted: None });
        for ulps in -4i64..=4 {
            let angle = f64::from_bits((critical.to_bits() as i64 + ulps) as u64);
            assert!(at(angle).reflectance.is_finite());
        }
    }

    #[test]
    fn fresnel_is_reciprocal() {
        for i in 1..1000 {
            let angle = i as f64 * std::f64::consts::FRAC_PI_2 / 1000.0;
            let there = split(wo(angle), DVec3::Z, 1.5);
            let t = there.refracted.expect("no total reflection into glass");
            let back = split(t, DVec3::Z, 1.0 / 1.5);
            assert!((there.reflectance - back.reflectance).abs() < 1e-12);
        }
    }

    #[test]
    fn a_kept_side_is_kept() {
        let down = DVec3::new(1.0, 0.0, -0.1).normalize();
        assert!(keep_side(down, DVec3::Z, true).z > 0.0);
        assert_eq!(keep_side(down, DVec3::Z, false), down);
    }
}
