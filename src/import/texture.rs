//! Image files to textures.
//!
//! Colours of integer formats are sRGB, those of floats (Radiance HDR, OpenEXR) are linear as they stand; their alpha is
//! dropped. Data are one channel of an image, as it stands.

mod grey_exr;

use crate::error::{Diagnostic, Error, Result};
use crate::math::{Rgb, srgb_decode};
use crate::scene::Texture;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

/// The largest image that is decoded, bytes of its own pixel format: 16384 x 16384 of 8 bits, half as many of floats.
pub const MAX_IMAGE_BYTES: u64 = 2 << 30;
/// Bytes of an image whose file need not be as large as such images' are.
const FEW_BYTES: u64 = 64 << 20;
/// Pixels that a byte of a larger image's file stands for at most: of one bit each, deflated.
const PIXELS_A_BYTE: u64 = 8 * 1032;
/// The same of Radiance HDR: runs of 127 in four channels of two bytes each.
const HDR_PIXELS_A_BYTE: u64 = 16;
/// Its longest edge, pixels.
const MAX_IMAGE_EDGE: u32 = 1 << 16;

/// A channel of an image. In a grey image red, green and blue are the grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum ImageChannel {
    /// Red.
    Red,
    /// Green: where glTF has the roughness.
    Green,
    /// Blue.
    Blue,
    /// Alpha.
    Alpha,
}

/// Reads an image: bmp, exr, hdr, jpeg, png, pnm, or tga. The content decides, but for tga, which the name tells.
///
/// Errors: `Error::Io`; `Error::Input` for what is no such image or larger than [`MAX_IMAGE_BYTES`], before memory is
/// asked for.
pub fn load_texture(path: &Path) -> Result<Texture> {
    Ok(colours(path, &decode(path)?)?.0)
}

/// What a warning says of colours that [`reflectances`] cuts.
const CUT_COLOURS: &str =
    "colours above 1 are cut to 1: no surface reflects more light than it receives";

/// What a warning says of negative numbers, which programs and lossy compression make beside steep edges.
const CUT_NEGATIVES: &str = "numbers below 0 are cut to 0: no light is negative";
/// What a warning says of both.
const CUT_BOTH: &str =
    "colours above 1 and below 0 are cut: no surface reflects more light than it receives";

/// The colours of a decoded image, in codes of 8 bits if it has no more, and what a warning says of those that were cut.
///
/// Errors: a pixel that is not finite.
pub(super) fn colours(
    path: &Path,
    image: &DynamicImage,
) -> Result<(Texture, Option<&'static str>)> {
    colours_up_to(path, image, f32::INFINITY)
}

/// [`colours`] of which none is above 1, as no surface reflects more than it receives.
pub(super) fn reflectances(
    path: &Path,
    image: &DynamicImage,
) -> Result<(Texture, Option<&'static str>)> {
    colours_up_to(path, image, 1.0)
}

/// The colours of a decoded image, cut at 0 and `most`.
fn colours_up_to(
    path: &Path,
    image: &DynamicImage,
    most: f32,
) -> Result<(Texture, Option<&'static str>)> {
    let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
    if let Some(codes) = image.as_flat_samples_u8() {
        return Ok((Texture::from_srgb(name, size, rgb(codes.samples, image).collect()), None));
    }
    let texels: Vec<Rgb> = match image.as_flat_samples_u16() {
        Some(codes) => {
            let decode = |code: usize| srgb_decode(code as f64 / 65_535.0) as f32;
            let table: Vec<f32> = (0..65_536).map(decode).collect();
            let light = |codes: [u16; 3]| Rgb::from_array(codes.map(|c| table[c as usize]));
            rgb(codes.samples, image).map(light).collect()
        }
        None => floats(image).into_iter().map(Rgb::from_array).collect(),
    };
    if !texels.iter().all(|c| c.is_finite()) {
        return Err(bad_pixel(path));
    }
    let is_bright = texels.iter().any(|c| c.max_element() > most);
    let is_negative = texels.iter().any(|c| c.min_element() < 0.0);
    let cut = match (is_bright, is_negative) {
        (true, true) => Some(CUT_BOTH),
        (true, false) => Some(CUT_COLOURS),
        (false, true) => Some(CUT_NEGATIVES),
        (false, false) => None,
    };
    let texels = texels.into_iter().map(|c| c.clamp(Rgb::ZERO, Rgb::splat(most))).collect();
    Ok((Texture::from_linear(name, size, texels), cut))
}

/// The normals of a decoded image: red, green and blue as they stand.
///
/// Errors: a value that is no share.
pub(super) fn normals(path: &Path, image: &DynamicImage) -> Result<Texture> {
    let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
    if let Some(codes) = image.as_flat_samples_u8() {
        return Ok(Texture::from_vectors8(name, size, rgb(codes.samples, image).collect()));
    }
    if let Some(codes) = image.as_flat_samples_u16() {
        return Ok(Texture::from_vectors16(name, size, rgb(codes.samples, image).collect()));
    }
    let vector = |values: [f32; 3]| {
        let [r, g, b] = values.map(share16);
        Some([r?, g?, b?])
    };
    let texels: Option<Vec<_>> = floats(image).into_iter().map(vector).collect();
    Ok(Texture::from_vectors16(name, size, texels.ok_or_else(|| bad_pixel(path))?))
}

/// One channel of a decoded image as it stands.
///
/// Errors: an alpha channel that the image does not have; a value that is no share.
pub(super) fn data(path: &Path, image: &DynamicImage, channel: ImageChannel) -> Result<Texture> {
    if channel == ImageChannel::Alpha && !image.color().has_alpha() {
        return Err(Error::input(path, "the image has no alpha channel"));
    }
    let (name, size) = (path.display().to_string(), [image.width(), image.height()]);
    if let Some(codes) = image.as_flat_samples_u8() {
        let texels = numbers(codes.samples, image, channel).collect();
        return Ok(Texture::from_data8(name, size, texels));
    }
    if let Some(codes) = image.as_flat_samples_u16() {
        let texels = numbers(codes.samples, image, channel).collect();
        return Ok(Texture::from_data16(name, size, texels));
    }
    let texels: Option<Vec<u16>> = match image.as_flat_samples_f32() {
        Some(values) => numbers(values.samples, image, channel).map(share16).collect(),
        None => None,
    };
    Ok(Texture::from_data16(name, size, texels.ok_or_else(|| bad_pixel(path))?))
}

/// The error of an image with a value that is no number.
pub(super) fn bad_pixel(path: &Path) -> Error {
    Error::input(path, "a pixel of the image is not a finite number")
}

/// The image of a file, with at least one pixel.
///
/// Errors: those of [`load_texture`] but for its pixels' values.
pub(super) fn decode(path: &Path) -> Result<DynamicImage> {
    decode_bytes(path, &super::source::read(path)?)
}

/// The image whose file holds `bytes`, as [`decode`]; `path` names it.
pub(super) fn decode_bytes(path: &Path, bytes: &[u8]) -> Result<DynamicImage> {
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_IMAGE_BYTES);
    limits.max_image_width = Some(MAX_IMAGE_EDGE);
    limits.max_image_height = Some(MAX_IMAGE_EDGE);
    // Some decoders ask for memory before they look at the limits: the size comes first.
    pixels(path, bytes)?;
    if let Some(grey) = grey_exr::decode(path, bytes)? {
        return Ok(grey);
    }
    let mut decoder = reader(path, bytes)?;
    if decoder.format() == Some(ImageFormat::Jpeg) && !is_whole_jpeg(bytes) {
        return Err(Error::input(path, "the picture has no end marker: the file was cut short"));
    }
    decoder.limits(limits);
    decoder.decode().map_err(|error| unreadable(path, &error))
}

/// Whether a JPEG file goes on to the marker that ends its picture; decoders show grey for what is missing.
fn is_whole_jpeg(bytes: &[u8]) -> bool {
    const END: u8 = 0xd9;
    // Behind the marker of the start.
    let mut at = 2;
    loop {
        let Some(rest) = bytes.get(at..) else { return false };
        // Within the picture's data 0 follows on what is no marker; 1 and the restarts are markers without a segment.
        let is_marker =
            |pair: &[u8]| pair[0] == 0xff && !matches!(pair[1], 0 | 1 | 0xff | 0xd0..=0xd7);
        let Some(place) = rest.windows(2).position(is_marker) else { return false };
        if rest[place + 1] == END {
            return true;
        }
        let Some(length) = rest.get(place + 2..place + 4) else { return false };
        at += place + 2 + usize::from(u16::from_be_bytes([length[0], length[1]]));
    }
}

/// How many pixels the image has whose file holds `bytes`, by its header.
///
/// Errors: what is no image, no pixels, more than [`MAX_IMAGE_BYTES`], or far more than the file can hold.
pub(super) fn pixels(path: &Path, bytes: &[u8]) -> Result<u64> {
    let (width, height, most, decoded) = match grey_exr::size(bytes) {
        Some((width, height)) => {
            let pixels = u64::from(width) * u64::from(height);
            (width, height, PIXELS_A_BYTE, pixels.saturating_mul(grey_exr::PIXEL))
        }
        None => {
            let reader = reader(path, bytes)?;
            let is_hdr = reader.format() == Some(ImageFormat::Hdr);
            let decoder = reader.into_decoder().map_err(|error| unreadable(path, &error))?;
            let (width, height) = decoder.dimensions();
            let most = if is_hdr { HDR_PIXELS_A_BYTE } else { PIXELS_A_BYTE };
            (width, height, most, decoder.total_bytes())
        }
    };
    let pixels = u64::from(width) * u64::from(height);
    let fault = Diagnostic::new(path, format!("an image of {width} x {height} pixels"));
    if pixels == 0 {
        return Err(fault.into());
    }
    if decoded > MAX_IMAGE_BYTES || width.max(height) > MAX_IMAGE_EDGE {
        let help = format!(
            "at most {MAX_IMAGE_BYTES} bytes can be decoded, and {MAX_IMAGE_EDGE} pixels along an edge: make it smaller"
        );
        return Err(fault.help(help).into());
    }
    let length = bytes.len() as u64;
    if decoded > FEW_BYTES && pixels > most * length {
        return Err(fault.help(format!("its file has only {length} bytes: it is damaged")).into());
    }
    Ok(pixels)
}

fn reader<'a>(path: &Path, bytes: &'a [u8]) -> Result<ImageReader<Cursor<Cow<'a, [u8]>>>> {
    // The older of two first lines of the same format, which some programs still write.
    let bytes = match bytes.strip_prefix(b"#?RGBE\n") {
        Some(rest) => Cow::Owned([b"#?RADIANCE\n", rest].concat()),
        None => Cow::Borrowed(bytes),
    };
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| Error::io("read", path, e))?;
    // A tga file does not begin with anything of its own.
    if let (None, Ok(named)) = (reader.format(), ImageFormat::from_path(path)) {
        reader.set_format(named);
    }
    Ok(reader)
}

fn unreadable(path: &Path, error: &image::ImageError) -> Error {
    Error::input(path, format!("not a readable image: {error}"))
}

/// Red, green and blue of the pixels of `image`, whose samples these are; of a grey image thrice the grey.
fn rgb<T: Copy>(samples: &[T], image: &DynamicImage) -> impl ExactSizeIterator<Item = [T; 3]> {
    let channels = usize::from(image.color().channel_count());
    let [green, blue] = if channels < 3 { [0; 2] } else { [1, 2] };
    samples.chunks_exact(channels).map(move |pixel| [pixel[0], pixel[green], pixel[blue]])
}

/// Red, green and blue of an image of floats.
fn floats(image: &DynamicImage) -> Vec<[f32; 3]> {
    match image.as_flat_samples_f32() {
        Some(values) => rgb(values.samples, image).collect(),
        None => image.to_rgb32f().pixels().map(|pixel| pixel.0).collect(),
    }
}

/// One channel of the pixels of `image`, whose samples these are and which has the channel.
fn numbers<T: Copy>(
    samples: &[T],
    image: &DynamicImage,
    channel: ImageChannel,
) -> impl Iterator<Item = T> {
    let channels = usize::from(image.color().channel_count());
    let at = match channel {
        ImageChannel::Alpha => channels - 1,
        _ if channels < 3 => 0,
        colour => colour as usize,
    };
    samples.chunks_exact(channels).map(move |pixel| pixel[at])
}

/// A share as one of 65535, cut at 0 and 1; `None` of what is not finite.
fn share16(value: f32) -> Option<u16> {
    value.is_finite().then(|| (value.clamp(0.0, 1.0) * 65_535.0).round() as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_every_pixel_format_are_taken_as_their_conversions_are() {
        let path = Path::new("t");
        let source = image::Rgba32FImage::from_fn(3, 2, |x, y| {
            image::Rgba([0.1, 0.3, 0.8, 0.5].map(|c: f32| c + 0.05 * (x + y) as f32))
        });
        let source = DynamicImage::from(source);
        let formats: [DynamicImage; 10] = [
            source.to_luma8().into(),
            source.to_luma_alpha8().into(),
            source.to_rgb8().into(),
            source.to_rgba8().into(),
            source.to_luma16().into(),
            source.to_luma_alpha16().into(),
            source.to_rgb16().into(),
            source.to_rgba16().into(),
            source.to_rgb32f().into(),
            source.to_rgba32f().into(),
        ];
        for image in &formats {
            let colour = image.color();
            let expected = image.to_rgba32f();
            // Codes of 8 bits, or floats rounded to 16.
            let is_near = |a: f32, b: f32| (a - b).abs() < 1e-5;
            let vectors = normals(path, image).expect("normals");
            let (shown, _) = colours(path, image).expect("colours");
            for (x, y, pixel) in expected.enumerate_pixels() {
                let at = |texture: &Texture| {
                    texture.levels()[0].texel(x as usize, y as usize).to_array()
                };
                for c in 0..3 {
                    assert!(is_near(at(&vectors)[c], pixel.0[c]), "{colour:?}");
                    let light = match image.as_flat_samples_f32() {
                        Some(_) => pixel.0[c],
                        None => srgb_decode(f64::from(pixel.0[c])) as f32,
                    };
                    assert!(is_near(at(&shown)[c], light), "{colour:?}");
                }
                use ImageChannel::{Alpha, Blue, Green, Red};
                for channel in [Red, Green, Blue, Alpha] {
                    match data(path, image, channel) {
                        Ok(data) => {
                            assert!(is_near(at(&data)[0], pixel.0[channel as usize]), "{colour:?}");
                        }
                        Err(_) => assert!(channel == Alpha && !colour.has_alpha(), "{colour:?}"),
                    }
                }
            }
        }
    }

    #[test]
    fn reflectances_of_floats_are_cut_at_one() {
        let path = Path::new("t");
        let image: DynamicImage =
            image::Rgb32FImage::from_pixel(1, 1, image::Rgb([0.5, 1.0, 3.0])).into();
        let texel = |texture: Texture| texture.levels()[0].texel(0, 0);
        assert_eq!(texel(colours(path, &image).expect("light").0), Rgb::new(0.5, 1.0, 3.0));
        let (texture, cut) = reflectances(path, &image).expect("colours");
        assert_eq!((texel(texture), cut), (Rgb::new(0.5, 1.0, 1.0), Some(CUT_COLOURS)));
        // As lossy compression leaves it beside a steep edge.
        let ringing = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([-1e-5, 1.0, 0.0])).into();
        let (texture, cut) = colours(path, &ringing).expect("light");
        assert_eq!((texel(texture), cut), (Rgb::new(0.0, 1.0, 0.0), Some(CUT_NEGATIVES)));
        let white: DynamicImage = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([1.0; 3])).into();
        for white in [white.to_rgb8().into(), white.to_rgb16().into(), white] {
            assert_eq!(reflectances(path, &white).expect("colours").1, None);
        }
        for bad in [f32::NAN, f32::INFINITY] {
            let bad = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([0.5, bad, 0.5])).into();
            assert!(reflectances(path, &bad).is_err() && colours(path, &bad).is_err());
        }
    }

    #[test]
    fn large_images_are_read_and_what_a_file_cannot_hold_is_not() {
        let path = Path::new("t.hdr");
        let file = |width: u32, height: u32, length: usize| {
            let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
            [head.as_bytes(), &vec![0; length]].concat()
        };
        let found = |width, height, length| {
            pixels(path, &file(width, height, length)).map_err(|error| error.to_string())
        };
        assert_eq!(found(8192, 4096, 3 << 20), Ok(1 << 25));
        for (width, height, length, help) in [
            (16_384, 16_384, 32 << 20, "at most 2147483648 bytes"),
            (65_537, 1, 2 << 20, "65536 pixels along an edge"),
            (8192, 4096, 70_000, "it is damaged"),
            (100_000, 100_000, 200, "at most"),
        ] {
            let refused = found(width, height, length).expect_err("refused");
            assert!(refused.contains(help), "{refused}");
        }
    }

    #[test]
    fn a_jpeg_that_ends_early_is_refused() {
        let path = Path::new("t.jpg");
        let noise = |x: u32, y: u32| image::Rgb([(x * 37 + y * 91) as u8, (x * y) as u8, y as u8]);
        let image = image::RgbImage::from_fn(64, 48, noise);
        let mut bytes = Vec::new();
        image.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Jpeg).expect("written");
        assert!(decode_bytes(path, &bytes).is_ok());
        // What some cameras write behind the picture does not matter.
        let longer = [&bytes[..], &[0xff, 0xda, 0, 1, 2]].concat();
        assert!(decode_bytes(path, &longer).is_ok());
        for end in [bytes.len() - 1, bytes.len() - 2, bytes.len() * 2 / 3, 200, 3, 2] {
            assert!(decode_bytes(path, &bytes[..end]).is_err(), "{end} bytes");
        }
    }

    #[test]
    fn radiance_files_have_either_of_two_first_lines() {
        let path = Path::new("t.hdr");
        let picture = b"FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x20\x81";
        let pixel = |first: &[u8]| {
            let image = decode_bytes(path, &[first, picture].concat()).expect("an image");
            image.to_rgb32f().get_pixel(0, 0).0
        };
        assert_eq!(pixel(b"#?RGBE\n"), pixel(b"#?RADIANCE\n"));
        assert_eq!(pixel(b"#?RGBE\n"), [1.0, 0.5, 0.25]);
    }

    #[test]
    fn data_and_normals_of_floats_are_cut_at_zero_and_one() {
        let path = Path::new("t");
        let of = |value: f32| {
            let image = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([value; 3])).into();
            let texel = |texture: Texture| texture.levels()[0].texel(0, 0).x;
            let data = data(path, &image, ImageChannel::Red).map(texel).ok();
            assert_eq!(normals(path, &image).map(texel).ok(), data);
            data
        };
        assert_eq!([of(-0.1), of(0.0), of(1.0), of(7.0)], [0.0, 0.0, 1.0, 1.0].map(Some));
        assert_eq!([of(f32::NAN), of(f32::INFINITY)], [None; 2]);
    }
}
