//! Image files to textures.
//!
//! Colours of integer formats are sRGB, those of floats (Radiance HDR, OpenEXR) are linear as they stand; their alpha is
//! dropped. Data are one channel of an image, as it stands.

use super::model::Model;
use crate::error::{Diagnostic, Error, Result};
use crate::math::{Rgb, srgb_decode};
use crate::scene::{Texture, TextureId};
use crate::stats::Fault;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The largest image that is decoded, bytes of its own pixel format.
pub const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// Textures that a model has already, or the reason why not.
pub(super) type TextureCache = HashMap<(PathBuf, ImageUse), std::result::Result<TextureId, String>>;

/// What an image's numbers stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImageUse {
    /// Reflectances.
    Colour,
    /// A number from 0 to 1 in one channel.
    Data(ImageChannel),
    /// Normals in tangent space: red, green and blue.
    Normals,
}

/// A channel of an image. In a grey image red, green and blue are the grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ImageChannel {
    /// Red.
    Red,
    /// Green: where glTF has the roughness.
    Green,
    /// Blue.
    Blue,
    /// Alpha.
    Alpha,
}

/// As [`load_image`], once per file and use of a model; adds texture and file to it.
pub(super) fn load_cached(
    path: &Path,
    image_use: ImageUse,
    cache: &mut TextureCache,
    model: &mut Model,
) -> std::result::Result<TextureId, String> {
    let key = (path.to_path_buf(), image_use);
    if let Some(known) = cache.get(&key) {
        return known.clone();
    }
    let loaded = load_image(path, image_use).map_err(|e| e.to_string()).map(|texture| {
        if !model.files.iter().any(|file| file == path) {
            model.files.push(path.to_path_buf());
        }
        model.world.textures.push(texture);
        model.world.textures.len() as TextureId - 1
    });
    cache.insert(key, loaded.clone());
    loaded
}

/// Reads an image: bmp, exr, hdr, jpeg, png, pnm, or tga. The content decides, but for tga, which the name tells.
///
/// Errors: `Error::Io`; `Error::Input` for what is no such image or larger than
/// [`MAX_IMAGE_BYTES`], before memory is asked for.
pub fn load_texture(path: &Path) -> Result<Texture> {
    let image = decode(path)?;
    let size = [image.width(), image.height()];
    texture(path.display().to_string(), size, image).ok_or_else(|| bad_pixel(path))
}

/// Reads an image for a use, in the formats of [`load_texture`].
///
/// Errors: those of [`load_texture`], and an alpha channel that the image does not have.
pub fn load_image(path: &Path, image_use: ImageUse) -> Result<Texture> {
    match image_use {
        ImageUse::Colour => load_texture(path),
        ImageUse::Data(channel) => load_data(path, channel),
        ImageUse::Normals => load_normals(path),
    }
}

/// Why a texture that was read for `image_use` may be meant for another, if it may.
pub(super) fn doubt(texture: &Texture, image_use: ImageUse) -> Option<&'static str> {
    match (image_use, texture.looks_like_normals()) {
        (ImageUse::Normals, false) => Some(
            "this does not look like a normal map: few of its texels are unit vectors in tangent space",
        ),
        (ImageUse::Colour, true) => Some("this looks like a normal map, and is shown as a colour"),
        (ImageUse::Normals, true) | (ImageUse::Colour, false) | (ImageUse::Data(_), _) => None,
    }
}

fn load_normals(path: &Path) -> Result<Texture> {
    let image = decode(path)?;
    let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
    if image.as_flat_samples_u8().is_some() {
        let texels = image.into_rgb8().pixels().map(|p| p.0).collect();
        return Ok(Texture::from_vectors8(name, size, texels));
    }
    if image.as_flat_samples_u16().is_some() {
        let texels = image.into_rgb16().pixels().map(|p| p.0).collect();
        return Ok(Texture::from_vectors16(name, size, texels));
    }
    let code = |value: f32| {
        let is_value = value.is_finite() && value >= 0.0;
        is_value.then(|| (value.min(1.0) * 65_535.0).round() as u16)
    };
    let vector = |p: &image::Rgb<f32>| {
        let [r, g, b] = p.0.map(code);
        Some([r?, g?, b?])
    };
    let texels: Option<Vec<[u16; 3]>> = image.into_rgb32f().pixels().map(vector).collect();
    Ok(Texture::from_vectors16(name, size, texels.ok_or_else(|| bad_pixel(path))?))
}

fn load_data(path: &Path, channel: ImageChannel) -> Result<Texture> {
    let image = decode(path)?;
    if channel == ImageChannel::Alpha && !image.color().has_alpha() {
        return Err(Error::input(path, "the image has no alpha channel"));
    }
    let at = channel as usize;
    let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
    if image.as_flat_samples_u8().is_some() {
        let texels = image.into_rgba8().pixels().map(|p| p.0[at]).collect();
        return Ok(Texture::from_data8(name, size, texels));
    }
    if image.as_flat_samples_u16().is_some() {
        let texels = image.into_rgba16().pixels().map(|p| p.0[at]).collect();
        return Ok(Texture::from_data16(name, size, texels));
    }
    let code = |value: f32| {
        let is_value = value.is_finite() && value >= 0.0;
        is_value.then(|| (value.min(1.0) * 65_535.0).round() as u16)
    };
    let texels: Option<Vec<u16>> = image.into_rgba32f().pixels().map(|p| code(p.0[at])).collect();
    Ok(Texture::from_data16(name, size, texels.ok_or_else(|| bad_pixel(path))?))
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
