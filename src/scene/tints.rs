//! The colours that light is made up of, of each of which a ratio is kept for other frames.

use crate::math::Rgb;

/// The primary colours: of light of several colours, and where glass may colour it.
pub const PRIMARIES: [Rgb; 3] = [Rgb::X, Rgb::Y, Rgb::Z];

/// How many ratios are kept of light that has `own` colours, one for each; three where glass may give it others.
pub fn ratio_count(own: usize, is_coloured: bool) -> usize {
    if is_coloured && own > 0 { PRIMARIES.len() } else { own }
}

/// The colours that so many ratios are of, of light that has the colours `own` where no glass colours it.
pub fn tints(own: &[Rgb], ratios: usize) -> &[Rgb] {
    match ratios == PRIMARIES.len() {
        true => &PRIMARIES,
        false => &own[..ratios],
    }
}

/// How much of a colour there is in `light`.
pub fn part(light: Rgb, tint: Rgb) -> f64 {
    f64::from(light.dot(tint) / tint.length_squared())
}
