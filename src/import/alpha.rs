//! Image files to masks of cut-outs: 8 bits a texel, as stored.
//!
//! The alpha channel counts where the image has one that is not opaque all over, else the mean of the colours or the
//! grey. Nothing is decoded from sRGB: a half is code 127.5 of 255. Values of more bits are rounded to 8, which
//! takes none of them across the half.

use super::texture::{bad_pixel, decode};
use crate::error::Result;
use crate::scene::AlphaMask;
use image::DynamicImage;
use std::path::Path;

/// Reads the mask of an image, in the formats of [`super::load_texture`].
///
/// Errors: those of [`super::load_texture`].
pub fn load_mask(path: &Path) -> Result<AlphaMask> {
    mask_of(path, &decode(path)?)
}

/// The mask of a decoded image.
///
/// Errors: a value that is no alpha.
pub(super) fn mask_of(path: &Path, image: &DynamicImage) -> Result<AlphaMask> {
    let (width, height) = (image.width(), image.height());
    let texels = texels(image).ok_or_else(|| bad_pixel(path))?;
    Ok(AlphaMask { name: path.display().to_string(), width, height, texels })
}

/// Alpha in 8 bits; `None` where a value that counts is negative or not finite.
fn texels(image: &DynamicImage) -> Option<Vec<u8>> {
    let colour = image.color();
    let (channels, has_alpha) = (usize::from(colour.channel_count()), colour.has_alpha());
    if let Some(flat) = image.as_flat_samples_u8() {
        codes(flat.samples, channels, has_alpha, 255.0)
    } else if let Some(flat) = image.as_flat_samples_u16() {
        codes(flat.samples, channels, has_alpha, 65_535.0)
    } else if let Some(flat) = image.as_flat_samples_f32() {
        codes(flat.samples, channels, has_alpha, 1.0)
    } else {
        codes(image.to_rgba32f().as_raw(), 4, true, 1.0)
    }
}

/// Alpha in 8 bits of pixels of so many channels, the last of which may be alpha; `most` is opaque or white.
fn codes<T: Copy + Into<f64>>(
    samples: &[T],
    channels: usize,
    has_alpha: bool,
    most: f64,
) -> Option<Vec<u8>> {
    let pixels = || samples.chunks_exact(channels);
    let alpha = |pixel: &[T]| -> f64 { pixel[channels - 1].into() };
    let cuts = has_alpha && pixels().any(|pixel| alpha(pixel) < most || alpha(pixel).is_nan());
    let colours = channels - usize::from(has_alpha);
    let mean =
        |pixel: &[T]| pixel[..colours].iter().map(|x| (*x).into()).sum::<f64>() / colours as f64;
    let code = |value: f64| {
        let is_value = (0.0..=f64::MAX).contains(&value);
        is_value.then(|| (value / most * 255.0).round().min(255.0) as u8)
    };
    pixels().map(|pixel| code(if cuts { alpha(pixel) } else { mean(pixel) })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayAlphaImage, GrayImage, ImageBuffer, Rgb, Rgb32FImage, RgbaImage};

    #[test]
    fn alpha_counts_where_any_of_it_is_not_opaque() {
        let image = |pixels: Vec<u8>| RgbaImage::from_raw(2, 1, pixels).expect("two pixels").into();
        let cut = image(vec![255, 255, 255, 0, 0, 0, 0, 200]);
        assert_eq!(texels(&cut), Some(vec![0, 200]));
        let opaque = image(vec![255, 255, 255, 255, 10, 20, 30, 255]);
        assert_eq!(texels(&opaque), Some(vec![255, 20]));
        let grey = GrayAlphaImage::from_raw(2, 1, vec![9, 255, 9, 3]).expect("two pixels").into();
        assert_eq!(texels(&grey), Some(vec![255, 3]));
        let grey = GrayImage::from_raw(2, 1, vec![127, 128]).expect("two pixels").into();
        assert_eq!(texels(&grey), Some(vec![127, 128]));
    }

    #[test]
    fn no_rounding_crosses_the_half() {
        let sixteen = |codes: Vec<u16>| {
            let image: ImageBuffer<Rgb<u16>, _> = ImageBuffer::from_raw(1, 1, codes).expect("one");
            texels(&image.into()).expect("values")[0]
        };
        assert_eq!((sixteen(vec![32_767; 3]), sixteen(vec![32_768; 3])), (127, 128));
        assert_eq!((sixteen(vec![0; 3]), sixteen(vec![65_535; 3])), (0, 255));
        let float = |value: f32| {
            let image = Rgb32FImage::from_raw(1, 1, vec![value; 3]).expect("one");
            texels(&image.into()).map(|texels| texels[0])
        };
        assert_eq!((float(0.499_999), float(0.5)), (Some(127), Some(128)));
        assert_eq!((float(7.0), float(-1.0), float(f32::NAN)), (Some(255), None, None));
    }
}
