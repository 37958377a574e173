//! Image files to textures.
//!
//! Integer formats are sRGB, those of floats (Radiance HDR, OpenEXR) are linear as they stand. Alpha is dropped.

use crate::error::{Diagnostic, Error, Result};
use crate::math::{Rgb, srgb_decode};
use crate::scene::Texture;
use crate::stats::Fault;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::path::Path;

/// The largest image that is decoded, bytes of its own pixel format.
pub const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// Reads an image: bmp, exr, hdr, jpeg, png, pnm, or tga. The content decides, but for tga, which the name tells.
///
/// Errors: `Error::Io`; `Error::Input` for what is no such image or larger than
/// [`MAX_IMAGE_BYTES`], before memory is asked for.
pub fn load_texture(path: &Path) -> Result<Texture> {
    texture_of(path, decode(path)?)
}

/// The texture of a decoded image.
///
/// Errors: a pixel that is no light.
pub(super) fn texture_of(path: &Path, image: DynamicImage) -> Result<Texture> {
    let size = [image.width(), image.height()];
    texture(path.display().to_string(), size, image).ok_or_else(|| bad_pixel(path))
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
        let mut reader = ImageReader::new(std::io::Cursor::new(&bytes))
            .with_guessed_format()
            .map_err(|e| Error::io("read", path, e))?;
        // A tga file does not begin with anything of its own.
        if let (None, Ok(named)) = (reader.format(), ImageFormat::from_path(path)) {
            reader.set_format(named);
        }
        Ok::<_, Error>(reader)
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

/// The image as it is kept: in codes of 8 bits if it has no more. `None` where a pixel is no light.
fn texture(name: String, size: [u32; 2], image: DynamicImage) -> Option<Texture> {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let image = image.into_rgb32f();
            let texels: Vec<Rgb> = image.pixels().map(|p| Rgb::from_array(p.0)).collect();
            let is_light = texels.iter().all(|c| Fault::of(c.to_array()).is_none());
            is_light.then(|| Texture::from_linear(name, size, texels))
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let decode = |code: usize| srgb_decode(code as f64 / 65_535.0) as f32;
            let table: Vec<f32> = (0..65_536).map(decode).collect();
            let texel = |p: &image::Rgb<u16>| Rgb::from_array(p.0.map(|c| table[c as usize]));
            let texels = image.into_rgb16().pixels().map(texel).collect();
            Some(Texture::from_linear(name, size, texels))
        }
        _ => {
            let texels = image.into_rgb8().pixels().map(|p| p.0).collect();
            Some(Texture::from_srgb(name, size, texels))
        }
    }
}
