//! The sRGB transfer functions (IEC 61966-2-1:1999), in f64.
//!
//! They use the crate `libm`, so a pixel that went through them is the same on every CPU.

/// Linear value to sRGB code value; both nominally in [0, 1]. Values below 0 follow the linear
/// piece, values above 1 the power.
pub fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// sRGB code value to linear value; the inverse of [`srgb_encode`].
pub fn srgb_decode(code: f64) -> f64 {
    if code <= 0.040_45 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        for (linear, code) in [(0.0, 0.0), (1.0, 1.0), (0.001, 0.01292), (0.5, 0.735_356_983_052)] {
            assert!((srgb_encode(linear) - code).abs() < 1e-11, "{linear}");
            assert!((srgb_decode(code) - linear).abs() < 1e-11, "{code}");
        }
    }

    #[test]
    fn encoding_and_decoding_are_inverse() {
        for i in 0..=65_535 {
            let code = f64::from(i) / 65_535.0;
            // The standard's own constants leave a step of 3e-8 where the pieces meet.
            assert!((srgb_encode(srgb_decode(code)) - code).abs() < 5e-8, "{i}");
        }
    }
}
