//! Sun and sky of a clear or hazy day.
//!
//! The sky is the analytic model of Preetham, Shirley and Smits ("A Practical Analytic Model for Daylight", 1999):
//! Perez's five-parameter distribution of luminance and chromaticity, fitted for turbidities from 2 to 10. The sun loses
//! light to air, haze and ozone by the transmittances of the same paper's appendix, at one wavelength for each primary
//! colour.
//!
//! Not done: twilight, clouds, the air between camera and scene.

use crate::math::{DVec3, Rgb};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Luminance of one unit of radiance, kcd/m².
const UNIT: f64 = 10.0;
/// Illuminance of the sun outside of the air, klx.
const SOLAR: f64 = 128.0;
/// Thickness of the layer of ozone, cm.
const OZONE: f64 = 0.35;
/// Wavelength of each primary colour, µm, and the absorption of ozone there, 1/cm.
const PRIMARIES: [[f64; 2]; 3] = [[0.610, 0.120], [0.550, 0.085], [0.465, 0.008]];

/// What decides the light of a day.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SunSky {
    /// Unit vector towards the middle of the sun, +y up, not below the horizon.
    pub to_sun: DVec3,
    /// How hazy the air is: 2 very clear, 3 clear, 6 hazy.
    pub turbidity: f64,
    /// Half of the angle under which the sun is seen, radians.
    pub sun_radius: f64,
    /// Diffuse reflectance of the ground that is seen below the horizon.
    pub ground: Rgb,
}

/// The sky of a day, with all that a lookup needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Daylight {
    to_sun: DVec3,
    /// Perez's five parameters of luminance and both chromaticities.
    perez: [[f64; 5]; 3],
    /// Luminance (kcd/m²) and chromaticities at the zenith, over the distribution there.
    scale: [f64; 3],
    /// Radiance of the ground.
    ground: Rgb,
}

impl SunSky {
    /// Irradiance of the sun on a surface that faces it; a unit stands for the light of 10 klx.
    pub fn sun_irradiance(&self) -> Rgb {
        let cos = self.to_sun.y.clamp(0.0, 1.0);
        let from_zenith = libm::acos(cos).to_degrees();
        let air_mass = 1.0 / (cos + 0.15 * libm::pow(93.885 - from_zenith, -1.253));
        let haze = (0.04608 * self.turbidity - 0.04586).max(0.0);
        let left = PRIMARIES.map(|[wavelength, ozone]| {
            let rayleigh = 0.008735 * libm::pow(wavelength, -4.08);
            let aerosol = haze * libm::pow(wavelength, -1.3);
            libm::exp(-air_mass * (rayleigh + aerosol + ozone * OZONE)) * SOLAR / UNIT
        });
        Rgb::from_array(left.map(|light| light as f32))
    }
}

impl Daylight {
    /// The sky of `day`.
    pub fn of(day: &SunSky) -> Self {
        let t = day.turbidity;
        let perez = [
            [
                0.1787 * t - 1.4630,
                -0.3554 * t + 0.4275,
                -0.0227 * t + 5.3251,
                0.1206 * t - 2.5771,
                -0.0670 * t + 0.3703,
            ],
            [
                -0.0193 * t - 0.2592,
                -0.0665 * t + 0.0008,
                -0.0004 * t + 0.2125,
                -0.0641 * t - 0.8989,
                -0.0033 * t + 0.0452,
            ],
            [
                -0.0167 * t - 0.2608,
                -0.0950 * t + 0.0092,
                -0.0079 * t + 0.2102,
                -0.0441 * t - 1.6537,
                -0.0109 * t + 0.0529,
            ],
        ];
        let sun = libm::acos(day.to_sun.y.clamp(0.0, 1.0));
        let zenith = at_zenith(t, sun);
        let scale =
            std::array::from_fn(|k| zenith[k] / distribution(&perez[k], 1.0, sun, day.to_sun.y));
        let mut sky = Self { to_sun: day.to_sun, perez, scale, ground: Rgb::ZERO };
        let arrives = sky.on_the_ground() + day.sun_irradiance() * day.to_sun.y.max(0.0) as f32;
        sky.ground = day.ground * arrives * FRAC_1_PI as f32;
        sky
    }

    /// Radiance along the unit direction `dir` without the sun itself; a unit stands for 10 kcd/m².
    pub fn radiance(&self, dir: DVec3) -> Rgb {
        if dir.y < 0.0 {
            return self.ground;
        }
        let cos_sun = dir.dot(self.to_sun).clamp(-1.0, 1.0);
        let to_sun = libm::acos(cos_sun);
        let [luminance, x, y] = std::array::from_fn(|k| {
            self.scale[k] * distribution(&self.perez[k], dir.y, to_sun, cos_sun)
        });
        let over_y = luminance / y / UNIT;
        let [cx, cy, cz] = [x * over_y, y * over_y, (1.0 - x - y) * over_y];
        // CIE XYZ to linear Rec. 709.
        let rgb = [
            3.240_454_2 * cx - 1.537_138_5 * cy - 0.498_531_4 * cz,
            -0.969_266_0 * cx + 1.876_010_8 * cy + 0.041_556_0 * cz,
            0.055_643_4 * cx - 0.204_025_9 * cy + 1.057_225_2 * cz,
        ];
        Rgb::from_array(rgb.map(|c| c.max(0.0) as f32))
    }

    /// Irradiance of the sky on level ground: the midpoint rule by equal shares of cosine-weighted solid angle.
    fn on_the_ground(&self) -> Rgb {
        const STEPS: [usize; 2] = [16, 32];
        let mut sum = Rgb::ZERO;
        for i in 0..STEPS[0] {
            let sin2 = (i as f64 + 0.5) / STEPS[0] as f64;
            for j in 0..STEPS[1] {
                let (sin, cos) = libm::sincos(TAU * (j as f64 + 0.5) / STEPS[1] as f64);
                let level = sin2.sqrt();
                sum += self.radiance(DVec3::new(level * sin, (1.0 - sin2).sqrt(), level * cos));
            }
        }
        sum * (PI / (STEPS[0] * STEPS[1]) as f64) as f32
    }
}

/// Perez's distribution at the cosine `cos` to the zenith and the angle `to_sun` to the sun, of cosine `cos_sun`.
fn distribution([a, b, c, d, e]: &[f64; 5], cos: f64, to_sun: f64, cos_sun: f64) -> f64 {
    let by_height = 1.0 + a * libm::exp(b / cos.max(1e-6));
    by_height * (1.0 + c * libm::exp(d * to_sun) + e * cos_sun * cos_sun)
}

/// Luminance (kcd/m²) and chromaticities at the zenith, for the turbidity `t` and the angle `sun` from there to the sun.
fn at_zenith(t: f64, sun: f64) -> [f64; 3] {
    let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * sun);
    let luminance = (4.0453 * t - 4.9710) * libm::tan(chi) - 0.2155 * t + 2.4192;
    let cubic = |[a, b, c, d]: [f64; 4]| ((a * sun + b) * sun + c) * sun + d;
    let chromaticity = |rows: [[f64; 4]; 3]| {
        let [square, linear, constant] = rows.map(cubic);
        (square * t + linear) * t + constant
    };
    let x = chromaticity([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = chromaticity([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    [luminance.max(0.0), x, y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::luminance;

    fn day(height: f64, turbidity: f64) -> SunSky {
        let (sin, cos) = libm::sincos(f64::to_radians(height));
        let to_sun = DVec3::new(cos, sin, 0.0);
        SunSky { to_sun, turbidity, sun_radius: 0.00465, ground: Rgb::splat(0.2) }
    }

    #[test]
    fn a_clear_day_is_as_bright_as_days_are() {
        let noon = day(60.0, 3.0);
        // A clear noon has 80 to 110 klx of sun and 10 to 25 klx of sky.
        let sun = f64::from(luminance(noon.sun_irradiance())) * UNIT;
        let sky = f64::from(luminance(Daylight::of(&noon).on_the_ground())) * UNIT;
        assert!((75.0..110.0).contains(&sun), "{sun}");
        assert!((8.0..35.0).contains(&sky), "{sky}");
        // Low, the sun is weak and red.
        let low = day(3.0, 3.0).sun_irradiance();
        assert!(low.x > 3.0 * low.z && low.x < 0.5 * noon.sun_irradiance().x, "{low}");
    }

    #[test]
    fn the_sky_is_blue_away_from_the_sun_and_finite_all_round() {
        for height in [0.0, 1.0, 20.0, 60.0, 90.0] {
            for turbidity in [1.7, 3.0, 10.0] {
                let sky = Daylight::of(&day(height, turbidity));
                for i in 0..40 {
                    for j in 0..40 {
                        let (sin, cos) = libm::sincos(TAU * f64::from(i) / 40.0);
                        let y = f64::from(j) / 20.0 - 1.0;
                        let level = (1.0 - y * y).sqrt();
                        let seen = sky.radiance(DVec3::new(level * sin, y, level * cos));
                        assert!(
                            seen.is_finite() && seen.min_element() >= 0.0,
                            "{height} {turbidity} {seen}"
                        );
                    }
                }
            }
        }
        let sky = Daylight::of(&day(40.0, 3.0));
        let away = sky.radiance(DVec3::new(-0.6, 0.8, 0.0));
        assert!(away.z > 1.5 * away.x, "{away}");
        let towards = sky.radiance(day(42.0, 3.0).to_sun);
        assert!(luminance(towards) > 3.0 * luminance(away));
    }

    /// The zenith's luminance at turbidity 3 and 45 degrees, worked out by hand from the paper's formula.
    #[test]
    fn the_zenith_is_as_the_paper_says() {
        let [luminance, x, y] = at_zenith(3.0, PI / 4.0);
        let chi = (4.0f64 / 9.0 - 3.0 / 120.0) * PI / 2.0;
        assert!((luminance - (7.1649 * chi.tan() + 1.7727)).abs() < 1e-9);
        assert!((0.24..0.30).contains(&x) && (0.24..0.31).contains(&y), "{x} {y}");
        let sky = Daylight::of(&day(45.0, 3.0)).radiance(DVec3::Y);
        assert!((f64::from(crate::math::luminance(sky)) * UNIT / luminance - 1.0).abs() < 1e-3);
    }
}
