//! Pictures in a page.

use crate::error::{Error, Result};
use crate::film::Image;
use crate::math::Rgb;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, RgbImage, imageops};

/// Quality of jpeg pictures, of 100: steps of the coding are not seen, and a frame of 640x360 takes
/// some 40 kB.
const QUALITY: u8 = 88;

/// A picture as a data URI.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `data:image/…;base64,…`
    pub uri: String,
}

impl Picture {
    /// `image`, sRGB values, no wider than `most` pixels; for looking at.
    ///
    /// # Errors
    /// [`Error::Failed`] when it cannot be encoded.
    pub fn jpeg(image: &Image, most: u32) -> Result<Self> {
        let mut pixels = to_8_bit(image);
        if pixels.width() > most {
            let height = f64::from(pixels.height()) * f64::from(most) / f64::from(pixels.width());
            let height = (height.round() as u32).max(1);
            pixels = imageops::resize(&pixels, most, height, imageops::FilterType::Triangle);
        }
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, QUALITY)
            .write_image(&pixels, pixels.width(), pixels.height(), ExtendedColorType::Rgb8)
            .map_err(failed)?;
        Ok(Self::of(&pixels, "jpeg", &bytes))
    }

    /// `image`, sRGB values, pixel for pixel in 8 bits; for comparing.
    ///
    /// # Errors
    /// [`Error::Failed`] when it cannot be encoded.
    pub fn png(image: &Image) -> Result<Self> {
        let pixels = to_8_bit(image);
        let mut bytes = Vec::new();
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
            .write_image(&pixels, pixels.width(), pixels.height(), ExtendedColorType::Rgb8)
            .map_err(failed)?;
        Ok(Self::of(&pixels, "png", &bytes))
    }

    fn of(pixels: &RgbImage, kind: &str, bytes: &[u8]) -> Self {
        let uri = format!("data:image/{kind};base64,{}", STANDARD.encode(bytes));
        Self { width: pixels.width(), height: pixels.height(), uri }
    }
}

fn failed(error: image::ImageError) -> Error {
    Error::Failed(format!("cannot encode a picture for the page: {error}"))
}

fn to_8_bit(image: &Image) -> RgbImage {
    // A NaN becomes 0.
    let level = |v: f32| (v * 255.0 + 0.5).clamp(0.0, 255.0) as u8;
    RgbImage::from_fn(image.width, image.height, |x, y| {
        let c = image.rgb[y as usize * image.width as usize + x as usize];
        image::Rgb(c.to_array().map(level))
    })
}

/// Where `image` is off from `reference` (both sRGB values, of one size), by the largest channel:
/// black 0, full at `most` steps of 1/255.
///
/// # Panics
/// When the sizes differ.
pub fn heat_map(reference: &Image, image: &Image, most: f32) -> Image {
    assert_eq!((reference.width, reference.height), (image.width, image.height), "of one size");
    let off = |(a, b): (&Rgb, &Rgb)| heat((*a - *b).abs().max_element() * 255.0 / most);
    let rgb = reference.rgb.iter().zip(&image.rgb).map(off).collect();
    Image { rgb, ..*reference }
}

/// Black through violet and orange to white, for 0 to 1; sRGB values.
fn heat(share: f32) -> Rgb {
    const STOPS: [Rgb; 5] = [
        Rgb::ZERO,
        Rgb::new(0.35, 0.05, 0.6),
        Rgb::new(0.85, 0.2, 0.4),
        Rgb::new(1.0, 0.65, 0.1),
        Rgb::new(1.0, 1.0, 0.8),
    ];
    let at = if share.is_nan() { 1.0 } else { share.clamp(0.0, 1.0) } * 4.0;
    let low = (at as usize).min(3);
    STOPS[low].lerp(STOPS[low + 1], at - low as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Encoding;

    fn ramp(width: u32, height: u32) -> Image {
        let pixel = |i: u32| Rgb::splat((i % width) as f32 / width as f32);
        let rgb = (0..width * height).map(pixel).collect();
        Image { width, height, rgb, encoding: Encoding::Srgb }
    }

    fn decoded(picture: &Picture) -> RgbImage {
        let (_, data) = picture.uri.split_once(";base64,").expect("a data URI");
        let bytes = STANDARD.decode(data).expect("base64");
        image::load_from_memory(&bytes).expect("a picture").to_rgb8()
    }

    #[test]
    fn png_keeps_every_value_and_jpeg_the_size_asked_for() {
        let image = ramp(64, 20);
        let exact = decoded(&Picture::png(&image).expect("encoded"));
        assert_eq!(exact, to_8_bit(&image));
        let small = Picture::jpeg(&image, 32).expect("encoded");
        assert_eq!((small.width, small.height), (32, 10));
        let small = decoded(&small);
        assert!(small.get_pixel(30, 5).0[0].abs_diff(240) < 8, "{:?}", small.get_pixel(30, 5));
        assert_eq!(Picture::jpeg(&image, 640).expect("encoded").width, 64);
    }

    #[test]
    fn the_heat_map_is_black_where_nothing_is_off_and_brighter_where_more_is() {
        let a = ramp(16, 4);
        let mut b = a.clone();
        b.rgb[3].y += 2.0 / 255.0;
        b.rgb[9].z += 8.0 / 255.0;
        let map = heat_map(&a, &b, 8.0);
        let light = |i: usize| map.rgb[i].element_sum();
        assert_eq!(light(0), 0.0);
        assert!(light(3) > 0.5 && light(9) > 2.0 * light(3));
    }
}
