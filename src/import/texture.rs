//! Image files to textures: linear RGB, f32.
//!
//! Integer formats are sRGB, by table; Radiance HDR is linear as it stands. Alpha is dropped.

use super::model::Model;
use crate::error::{Diagnostic, Error, Result};
use crate::math::Rgb;
use crate::scene::{Texture, TextureId};
use crate::stats::Fault;
use image::{DynamicImage, ImageReader, Limits};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The largest image that is decoded, bytes of its own pixel format.
pub const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// Textures that a model has already, or the reason why not.
pub(super) type TextureCache = HashMap<PathBuf, std::result::Result<TextureId, String>>;

/// As [`load_texture`], once per file of a model; adds texture and file to it.
pub(super) fn load_cached(
    path: &Path,
    cache: &mut TextureCache,
    model: &mut Model,
) -> std::result::Result<TextureId, String> {
    if let Some(known) = cache.get(path) {
        return known.clone();
    }
    let loaded = load_texture(path).map_err(|e| e.to_string()).map(|texture| {
        model.files.push(path.to_path_buf());
        model.world.textures.push(texture);
        model.world.textures.len() as TextureId - 1
    });
    cache.insert(path.to_path_buf(), loaded.clone());
    loaded
}

/// Reads an image (png, jpeg, hdr, pnm; the content decides).
///
/// Errors: `Error::Io`; `Error::Input` for what is no such image or larger than
/// [`MAX_IMAGE_BYTES`], before memory is asked for.
pub fn load_texture(path: &Path) -> Result<Texture> {
    let image = decode(path)?;
    let (width, height) = (image.width(), image.height());
    let texels = linear(image);
    if texels.iter().any(|c| Fault::of(c.to_array()).is_some()) {
        return Err(bad_pixel(path));
    }
    Ok(Texture { name: path.display().to_string(), width, height, texels })
}

/// The error of an image with a value that is no amount of light.
pub(super) fn bad_pixel(path: &Path) -> Error {
    Error::input(path, "a pixel of the image is negative or not a finite number")
}

/// The image of a file, with at least one pixel.
///
/// Errors: those of [`load_texture`] but for its pixels' values.
pub(super) fn decode(path: &Path) -> Result<DynamicImage> {
    let bytes = super::source::read(path)?;
    let bad = |e: image::ImageError| Error::input(path, format!("not a readable image: {e}"));
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_IMAGE_BYTES);
    limits.max_image_width = Some(1 << 16);
    limits.max_image_height = Some(1 << 16);
    let reader = || {
        ImageReader::new(std::io::Cursor::new(&bytes))
            .with_guessed_format()
            .map_err(|e| Error::io("read", path, e))
    };
    // Some decoders ask for memory before they look at the limits: the size comes first.
    let (width, height) = reader()?.into_dimensions().map_err(bad)?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels * 3 > MAX_IMAGE_BYTES {
        return Err(Diagnostic::new(path, format!("an image of {width} x {height} pixels"))
            .help(format!("at most {} bytes can be decoded", MAX_IMAGE_BYTES))
            .into());
    }
    let mut decoder = reader()?;
    decoder.limits(limits);
    decoder.decode().map_err(bad)
}

fn linear(image: DynamicImage) -> Vec<Rgb> {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            image.into_rgb32f().pixels().map(|p| Rgb::from_array(p.0)).collect()
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let table = srgb_table(65_536);
            let texel = |p: &image::Rgb<u16>| Rgb::from_array(p.0.map(|c| table[c as usize]));
            image.into_rgb16().pixels().map(texel).collect()
        }
        _ => {
            let table = srgb_table(256);
            let texel = |p: &image::Rgb<u8>| Rgb::from_array(p.0.map(|c| table[c as usize]));
            image.into_rgb8().pixels().map(texel).collect()
        }
    }
}

/// Linear values of `n` evenly spaced sRGB codes from 0 to 1 (IEC 61966-2-1), rounded once.
fn srgb_table(n: usize) -> Vec<f32> {
    let decode = |i: usize| {
        let code = i as f64 / (n - 1) as f64;
        let value =
            if code <= 0.04045 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) };
        value as f32
    };
    (0..n).map(decode).collect()
}
