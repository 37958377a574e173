//! What a medium takes from light on the way through it.

use crate::math::Rgb;
use crate::scene::Glass;

/// Share of radiance that is left after `distance`, world units, in `glass` (Beer, 1852).
pub(super) fn transmittance(glass: &Glass, distance: f64) -> Rgb {
    Rgb::from_array(glass.absorption.to_array().map(|absorption| match absorption {
        // Where there is no end, too.
        0.0 => 1.0,
        _ => libm::exp(-f64::from(absorption) * distance) as f32,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_ways_in_a_row_multiply_and_clear_glass_takes_nothing() {
        let glass = Glass { absorption: Rgb::new(0.0, 0.5, 3.0), ..Glass::clear(1.5) };
        let [one, other, both] = [0.3, 0.9, 1.2].map(|way| transmittance(&glass, way));
        assert!((one * other - both).abs().max_element() < 1e-7);
        assert_eq!(transmittance(&glass, 0.0), Rgb::ONE);
        assert_eq!(transmittance(&glass, f64::INFINITY), Rgb::new(1.0, 0.0, 0.0));
        assert!((f64::from(both.y) - libm::exp(-0.6)).abs() < 1e-7);
    }
}
