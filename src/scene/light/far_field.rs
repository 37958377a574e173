//! Irradiance from lights seen from afar, where neither their shapes nor shadows are looked at: a cheap stand-in for
//! closed forms, for lights that send little.
//!
//! Exact for directional and point lights, for spots without a radius, and for spheres that lie whole above the horizon.
//! More than 0 wherever a light sends anything.

use crate::math::DVec3;
use std::f64::consts::PI;
use wide::{CmpGe, f64x4};

/// A light is close within so many times its radius.
const CLOSE: f64 = 3.0;
/// A squared distance that is none.
const NO_DISTANCE: f64 = 1e-60;

/// The parts of a light that matter from afar. Of `flat`, `everywhere` and `cone` one is not 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FarField {
    /// Middle of the light; of parallel light the direction to it.
    centre: DVec3,
    /// 0 of parallel light, else 1.
    is_near: f64,
    /// All of the light lies in a ball of this radius.
    reach: f64,
    /// Normal of a flat light, axis of a cone.
    axis: DVec3,
    /// Area of a flat light.
    flat: f64,
    /// 1 of a flat light that emits on both sides, else 0.
    two_sided: f64,
    /// Intensity of a light that sends alike in all directions, per unit of emission.
    everywhere: f64,
    /// Intensity along the axis of a cone, per unit of emission.
    cone: f64,
    /// Cosine of the angle beyond which a cone sends nothing.
    cos_outer: f64,
    /// 1 over the difference between this and the cosine of the angle up to which it sends all.
    sharpness: f64,
}

impl FarField {
    /// A light that sends nothing.
    const DARK: Self = Self {
        centre: DVec3::ZERO,
        is_near: 1.0,
        reach: 0.0,
        axis: DVec3::ZERO,
        flat: 0.0,
        two_sided: 0.0,
        everywhere: 0.0,
        cone: 0.0,
        cos_outer: 0.0,
        sharpness: 0.0,
    };

    /// Light from one direction.
    pub(super) fn parallel(to_light: DVec3) -> Self {
        Self { centre: to_light, is_near: 0.0, everywhere: 1.0, ..Self::DARK }
    }

    /// A disk at infinity whose radius is seen under an angle with this sine, per unit of radiance.
    pub(super) fn distant_disk(to_light: DVec3, sin: f64) -> Self {
        Self { reach: sin, everywhere: PI * sin * sin, ..Self::parallel(to_light) }
    }

    /// A ball, or with `reach` 0 a point, of this intensity per unit of emission.
    pub(super) fn everywhere(centre: DVec3, reach: f64, intensity: f64) -> Self {
        Self { centre, reach, everywhere: intensity, ..Self::DARK }
    }

    /// A flat surface in a ball of radius `reach`.
    pub(super) fn flat(
        (centre, reach): (DVec3, f64),
        area: f64,
        normal: DVec3,
        two_sided: bool,
    ) -> Self {
        let two_sided = f64::from(u8::from(two_sided));
        Self { centre, reach, axis: normal, flat: area, two_sided, ..Self::DARK }
    }

    /// A cone with a smooth edge between the angles of two cosines, the inner one first, of intensity 1 along its axis
    /// per unit of emission.
    pub(super) fn cone(
        (centre, reach): (DVec3, f64),
        axis: DVec3,
        [cos_inner, cos_outer]: [f64; 2],
    ) -> Self {
        let sharpness = 1.0 / (cos_inner - cos_outer).max(f64::EPSILON);
        Self { centre, reach, axis, cone: 1.0, cos_outer, sharpness, ..Self::DARK }
    }

    /// Its middle and the radius around it, scene space; `None` of parallel light.
    pub fn place(&self) -> Option<(DVec3, f64)> {
        (self.is_near > 0.0).then_some((self.centre, self.reach))
    }

    /// The most that it sends in any direction, per unit of emission: intensity, of parallel light irradiance.
    pub fn intensity(&self) -> f64 {
        self.flat + self.everywhere + self.cone
    }

    /// Whether the light is so near to `p`, or so large, that the distance to its middle says little.
    pub fn is_close(&self, p: DVec3) -> bool {
        let close = CLOSE * self.reach;
        self.centre.distance_squared(p) < close * close * self.is_near
    }

    /// Irradiance of up to four lights at `p` with unit normal `n`, per unit of emission.
    pub fn irradiance(four: [Option<&Self>; 4], (p, n): (DVec3, DVec3)) -> [f64; 4] {
        let four = four.map(|field| field.unwrap_or(&Self::DARK));
        let lanes = |of: fn(&Self) -> f64| f64x4::from(four.map(of));
        let (zero, one) = (f64x4::ZERO, f64x4::ONE);
        let is_near = lanes(|f| f.is_near);
        let to_x = lanes(|f| f.centre.x) - is_near * f64x4::splat(p.x);
        let to_y = lanes(|f| f.centre.y) - is_near * f64x4::splat(p.y);
        let to_z = lanes(|f| f.centre.z) - is_near * f64x4::splat(p.z);
        let squared = (to_x * to_x + to_y * to_y + to_z * to_z).max(f64x4::splat(NO_DISTANCE));
        let inverse = one / squared.sqrt();
        let along_n =
            to_x * f64x4::splat(n.x) + to_y * f64x4::splat(n.y) + to_z * f64x4::splat(n.z);
        let along_axis =
            to_x * lanes(|f| f.axis.x) + to_y * lanes(|f| f.axis.y) + to_z * lanes(|f| f.axis.z);
        let reach = lanes(|f| f.reach);
        let risen = risen(along_n * inverse, (reach * inverse).min(f64x4::splat(2.0)));
        // The cosine at the light.
        let cos = -along_axis * inverse;
        let facing = cos.max(-cos * lanes(|f| f.two_sided));
        let seen = lanes(|f| f.flat) * facing;
        let inside = ((cos - lanes(|f| f.cos_outer)) * lanes(|f| f.sharpness)).max(zero).min(one);
        let falloff = inside * inside * (f64x4::splat(3.0) - inside - inside);
        let sent = seen + lanes(|f| f.everywhere) + lanes(|f| f.cone) * falloff;
        // Next to a light, or in it, a distance says nothing. On the axis of a disk the sum is exact.
        let squared = squared.max(reach * reach) + seen * f64x4::splat(1.0 / PI);
        (sent * risen / squared).to_array()
    }
}

/// Mean cosine above the horizon over lights whose middles are seen at angles of cosine `cos` from the normal, and whose
/// radius over distance is `reach`, at most 2: smooth, and 0 only where all of a light is below.
fn risen(cos: f64x4, reach: f64x4) -> f64x4 {
    let above = (cos + reach).max(f64x4::ZERO);
    let partly = above * above / (reach * f64x4::splat(4.0)).max(f64x4::splat(f64::MIN_POSITIVE));
    cos.cmp_ge(reach).blend(cos, partly)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn irradiance(field: &FarField, p: DVec3, n: DVec3) -> f64 {
        let [none, own, ..] = FarField::irradiance([None, Some(field), None, None], (p, n));
        assert_eq!(none, 0.0);
        own
    }

    #[test]
    fn delta_lights_and_whole_spheres_are_exact() {
        let (p, n) = (DVec3::new(0.3, -0.2, 0.1), DVec3::new(0.6, 0.8, 0.0));
        let sun = FarField::parallel(DVec3::Y);
        assert!((irradiance(&sun, p, n) - 0.8).abs() < 1e-15);
        assert_eq!(irradiance(&sun, p, -n), 0.0);
        let point = FarField::everywhere(p + DVec3::Y * 2.0, 0.0, 3.0);
        assert!((irradiance(&point, p, n) - 3.0 * 0.8 / 4.0).abs() < 1e-15);
        assert_eq!(irradiance(&point, p, -n), 0.0);
        let (half, whole) = (DVec3::new(0.0, 0.6, 0.8), DVec3::Y);
        let spot = |axis| FarField::cone((p + DVec3::Y * 2.0, 0.0), axis, [0.8, 0.4]);
        assert!((irradiance(&spot(-whole), p, DVec3::Y) - 0.25).abs() < 1e-15);
        assert!((irradiance(&spot(-half), p, DVec3::Y) - 0.125).abs() < 1e-15);
        assert_eq!(irradiance(&spot(whole), p, DVec3::Y), 0.0);
    }

    #[test]
    fn a_disk_is_exact_on_its_axis_and_dark_behind() {
        let disk = |two_sided| FarField::flat((DVec3::Y, 1.0), PI, DVec3::NEG_Y, two_sided);
        // π sin² of the half angle.
        assert!((irradiance(&disk(false), DVec3::ZERO, DVec3::Y) - 0.5 * PI).abs() < 1e-12);
        assert_eq!(irradiance(&disk(false), DVec3::Y * 2.0, DVec3::NEG_Y), 0.0);
        assert!((irradiance(&disk(true), DVec3::Y * 2.0, DVec3::NEG_Y) - 0.5 * PI).abs() < 1e-12);
    }

    #[test]
    fn a_light_sends_something_until_all_of_it_has_set() {
        let ball = FarField::everywhere(DVec3::X * 2.0, 0.5, 1.0);
        let above = |sin: f64| {
            let n = DVec3::new(-sin, (1.0 - sin * sin).sqrt(), 0.0);
            irradiance(&ball, DVec3::ZERO, n)
        };
        assert!(above(0.24) > 0.0 && above(0.2) > above(0.24));
        assert_eq!(above(0.26), 0.0);
        // In the light and in its middle.
        for p in [DVec3::X * 2.0, DVec3::X * 1.9] {
            let sent = irradiance(&ball, p, DVec3::Y);
            assert!(sent > 0.0 && sent.is_finite());
        }
    }
}
