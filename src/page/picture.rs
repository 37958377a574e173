//! Pictures in a page.

use crate::error::{Error, Result};
use crate::film::Image;
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

    /// A png file as it is.
    ///
    /// # Errors
    /// [`Error::Failed`] when it is none.
    pub fn of_png(bytes: &[u8]) -> Result<Self> {
        let pixels = image::load_from_memory_with_format(bytes, image::ImageFormat::Png);
        Ok(Self::of(&pixels.map_err(failed)?.to_rgb8(), "png", bytes))
    }

    /// The picture as a file.
    ///
    /// # Errors
    /// [`Error::Failed`] when it is not one of these.
    pub fn bytes(&self) -> Result<Vec<u8>> {
        let data = self.uri.split_once(";base64,").map_or("", |(_, data)| data);
        STANDARD.decode(data).map_err(|e| Error::Failed(format!("a picture is damaged: {e}")))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Encoding;
    use crate::math::Rgb;

    fn ramp(width: u32, height: u32) -> Image {
        let pixel = |i: u32| Rgb::splat((i % width) as f32 / width as f32);
        let rgb = (0..width * height).map(pixel).collect();
        Image { width, height, rgb, encoding: Encoding::Srgb }
    }

    fn decoded(picture: &Picture) -> RgbImage {
        let bytes = picture.bytes().expect("a data URI");
        image::load_from_memory(&bytes).expect("a picture").to_rgb8()
    }

    #[test]
    fn png_keeps_every_value_and_jpeg_the_size_asked_for() {
        let image = ramp(64, 20);
        let exact = decoded(&Picture::png(&image).expect("encoded"));
        assert_eq!(exact, to_8_bit(&image));
        let bytes = Picture::png(&image).and_then(|p| p.bytes()).expect("bytes");
        assert_eq!(decoded(&Picture::of_png(&bytes).expect("a png file")), exact);
        assert!(Picture::of_png(&bytes[..50]).is_err());
        let small = Picture::jpeg(&image, 32).expect("encoded");
        assert_eq!((small.width, small.height), (32, 10));
        let small = decoded(&small);
        assert!(small.get_pixel(30, 5).0[0].abs_diff(240) < 8, "{:?}", small.get_pixel(30, 5));
        assert_eq!(Picture::jpeg(&image, 640).expect("encoded").width, 64);
    }
}
