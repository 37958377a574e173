//! Linear radiance to display values: exposure, tone curve, transfer function, rounding.

use super::quantise::{Quantiser, SRGB_8, SRGB_16};
use crate::math::{Rgb, luminance, srgb_encode};
use crate::scene::ToneCurve;
use rayon::prelude::*;

/// How radiance becomes the display values of a png or ppm file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Display {
    /// Factor on radiance.
    pub exposure: f32,
    /// Tone curve, applied after the exposure.
    pub tone: ToneCurve,
}

/// Radiance is held below this before a curve, so that no curve divides infinity by infinity.
const BRIGHTEST: f32 = 1e9;

impl Display {
    /// Exposes `radiance` and applies the tone curve; linear display values in [0, 1]. NaN and
    /// negative values become 0.
    pub fn tone(&self, radiance: Rgb) -> Rgb {
        let clip = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, BRIGHTEST) };
        let c = Rgb::from_array((radiance * self.exposure).to_array().map(clip));
        match self.tone {
            ToneCurve::Srgb | ToneCurve::Linear => c.min(Rgb::ONE),
            ToneCurve::Reinhard => (c / (1.0 + luminance(c))).min(Rgb::ONE),
            ToneCurve::Filmic => filmic(c),
        }
    }

    /// The code values in [0, 1] that a png file holds, before they are rounded.
    pub fn code(&self, radiance: Rgb) -> [f64; 3] {
        self.tone(radiance).to_array().map(|x| match self.tone {
            ToneCurve::Linear => f64::from(x),
            _ => srgb_encode(f64::from(x)),
        })
    }

    /// 8-bit values, three bytes a pixel. `width` only splits the work.
    pub fn encode_8(&self, rgb: &[Rgb], width: u32) -> Vec<u8> {
        self.encode(rgb, width, &SRGB_8, 255.0, |level| [level as u8])
    }

    /// 16-bit values, big-endian as png has them, six bytes a pixel. `width` only splits the work.
    pub fn encode_16(&self, rgb: &[Rgb], width: u32) -> Vec<u8> {
        self.encode(rgb, width, &SRGB_16, 65_535.0, u16::to_be_bytes)
    }

    fn encode<const N: usize>(
        &self,
        rgb: &[Rgb],
        width: u32,
        srgb: &Quantiser,
        max: f64,
        bytes: fn(u16) -> [u8; N],
    ) -> Vec<u8> {
        let level = |x: f32| match self.tone {
            ToneCurve::Linear => (f64::from(x) * max + 0.5) as u16,
            _ => srgb.level(x),
        };
        let mut out = vec![0; rgb.len() * 3 * N];
        let rows = out.par_chunks_mut(width as usize * 3 * N).zip(rgb.par_chunks(width as usize));
        rows.for_each(|(out, row)| {
            for (out, c) in out.chunks_exact_mut(3 * N).zip(row) {
                for (out, x) in out.chunks_exact_mut(N).zip(self.tone(*c).to_array()) {
                    out.copy_from_slice(&bytes(level(x)));
                }
            }
        });
        out
    }
}

/// Narkowicz's fit to the ACES reference curve (2015), per channel.
fn filmic(c: Rgb) -> Rgb {
    let curve = c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14);
    curve.min(Rgb::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVES: [ToneCurve; 4] =
        [ToneCurve::Srgb, ToneCurve::Linear, ToneCurve::Reinhard, ToneCurve::Filmic];

    #[test]
    fn closed_form_of_each_curve() {
        let grey = |tone, exposure, x| Display { exposure, tone }.tone(Rgb::splat(x)).x;
        assert_eq!(grey(ToneCurve::Srgb, 2.0, 0.25), 0.5);
        assert_eq!(grey(ToneCurve::Linear, 1.0, 3.0), 1.0);
        assert!((grey(ToneCurve::Reinhard, 1.0, 3.0) - 0.75).abs() < 1e-6);
        let expected = 0.5 * (2.51 * 0.5 + 0.03) / (0.5 * (2.43 * 0.5 + 0.59) + 0.14);
        assert!((grey(ToneCurve::Filmic, 0.5, 1.0) - expected).abs() < 1e-6);
    }

    #[test]
    fn reinhard_keeps_the_hue() {
        let c = Rgb::new(0.4, 0.2, 0.1);
        let toned = Display { exposure: 1.0, tone: ToneCurve::Reinhard }.tone(c);
        assert!((toned / c - Rgb::splat(1.0 / (1.0 + luminance(c)))).length() < 1e-6);
    }

    #[test]
    fn levels_are_the_functions_rounding() {
        let ramp: Vec<Rgb> = (0..5000).map(|i| Rgb::splat(i as f32 / 4000.0)).collect();
        for tone in CURVES {
            let display = Display { exposure: 0.9, tone };
            let (b8, b16) = (display.encode_8(&ramp, 50), display.encode_16(&ramp, 50));
            for (i, c) in ramp.iter().enumerate() {
                let code = display.code(*c)[1];
                assert_eq!(f64::from(b8[3 * i + 1]), (code * 255.0).round());
                let wide = u16::from_be_bytes([b16[6 * i + 2], b16[6 * i + 3]]);
                assert_eq!(f64::from(wide), (code * 65_535.0).round());
            }
        }
    }

    #[test]
    fn odd_radiance_stays_in_range() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 0.0];
        for tone in CURVES {
            for exposure in [1.0, 0.0, f32::MAX] {
                for x in odd {
                    let c = Display { exposure, tone }.tone(Rgb::new(x, 0.5, 0.1));
                    assert!(c.is_finite() && c.min_element() >= 0.0 && c.max_element() <= 1.0);
                }
            }
        }
        let bright = Display { exposure: 1.0, tone: ToneCurve::Filmic }.tone(Rgb::INFINITY);
        assert_eq!(bright, Rgb::ONE);
    }
}
