//! A picture as a file holds it: what `output` reads and `measure` compares.

use super::Film;
use crate::error::{Error, Result};
use crate::math::{Rgb, srgb_decode, srgb_encode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The encoding of an [`Image`]'s numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Encoding {
    /// Linear radiance, unbounded (exr, hdr).
    Linear,
    /// sRGB code values in [0, 1] (png, ppm, jpeg).
    Srgb,
}

/// An RGB picture. Row 0 is the top.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Image {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` pixels, row by row.
    #[serde(with = "crate::math::bulk")]
    pub rgb: Vec<Rgb>,
    /// Encoding of the pixels' numbers.
    pub encoding: Encoding,
}

impl Image {
    /// An image of `rgb`, row by row from the top.
    ///
    /// # Errors
    /// [`Error::Usage`] when there are not `width · height` pixels, or none.
    pub fn new(width: u32, height: u32, rgb: Vec<Rgb>, encoding: Encoding) -> Result<Self> {
        if rgb.is_empty() || rgb.len() as u64 != u64::from(width) * u64::from(height) {
            let n = rgb.len();
            return Err(Error::Usage(format!(
                "{n} pixels do not make an image of {width}x{height}"
            )));
        }
        Ok(Self { width, height, rgb, encoding })
    }

    /// The film's radiance, as it is.
    pub fn of_film(film: &Film) -> Self {
        let (width, height, rgb) = (film.width, film.height, film.rgb.clone());
        Self { width, height, rgb, encoding: Encoding::Linear }
    }

    /// A copy in `encoding`, every channel clipped to [0, 1] (a NaN to 0).
    pub fn clipped(&self, encoding: Encoding) -> Self {
        let convert: fn(f32) -> f32 = match (self.encoding, encoding) {
            (Encoding::Linear, Encoding::Srgb) => |x| srgb_encode(f64::from(clip(x))) as f32,
            (Encoding::Srgb, Encoding::Linear) => |x| srgb_decode(f64::from(clip(x))) as f32,
            _ => clip,
        };
        let rgb = self.rgb.par_iter().map(|c| Rgb::new(convert(c.x), convert(c.y), convert(c.z)));
        Self { rgb: rgb.collect(), encoding, ..*self }
    }

    /// Pixels with a channel that is NaN or infinite.
    pub fn count_not_finite(&self) -> usize {
        self.rgb.iter().filter(|c| !c.is_finite()).count()
    }
}

/// Clips to [0, 1]; NaN to 0.
fn clip(x: f32) -> f32 {
    if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_pixels_must_fit() {
        assert!(Image::new(2, 2, vec![Rgb::ZERO; 3], Encoding::Linear).is_err());
        assert!(Image::new(0, 0, vec![], Encoding::Linear).is_err());
        assert!(Image::new(3, 1, vec![Rgb::ZERO; 3], Encoding::Linear).is_ok());
    }

    #[test]
    fn clipping_and_encoding() {
        let odd = Rgb::new(f32::NAN, f32::INFINITY, -1.0);
        let image = Image::new(2, 1, vec![odd, Rgb::splat(0.5)], Encoding::Linear);
        let image = image.expect("two pixels");
        assert_eq!(image.count_not_finite(), 1);
        assert_eq!(image.clipped(Encoding::Linear).rgb, [Rgb::Y, Rgb::splat(0.5)]);
        let srgb = image.clipped(Encoding::Srgb);
        assert!((srgb.rgb[1].x - 0.735_357).abs() < 1e-6);
        let back = srgb.clipped(Encoding::Linear);
        assert!((back.rgb[1].x - 0.5).abs() < 1e-6);
    }
}
