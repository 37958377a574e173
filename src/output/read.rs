//! Pictures from files: png (8 and 16 bits), ppm and its kin, jpeg, hdr, exr.
//!
//! The format is recognised by the first bytes, not by the name. png, ppm and jpeg are taken as sRGB
//! code values, hdr and exr as linear radiance. Grey becomes three equal channels; alpha is left
//! out, and so are colour profiles.

use super::exr;
use super::path_kind::{Regular, check_memory};
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::math::Rgb;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

/// Bytes that a decoded picture may take: 256 MiB.
pub const DEFAULT_MEMORY_LIMIT: u64 = 256 << 20;

/// Reads a picture, up to [`DEFAULT_MEMORY_LIMIT`].
///
/// # Errors
/// [`Error::Io`] when the file cannot be opened or read; [`Error::Input`] when it is no picture
/// that can be read here, is damaged, or needs more memory than the limit.
pub fn read_image(path: impl AsRef<Path>) -> Result<Image> {
    read_image_within(path, DEFAULT_MEMORY_LIMIT)
}

/// Reads a picture whose decoding takes at most `limit` bytes.
///
/// # Errors
/// As [`read_image`].
pub fn read_image_within(path: impl AsRef<Path>, limit: u64) -> Result<Image> {
    let path = path.as_ref();
    let io = |e| Error::io("read", path, e);
    let mut source = Regular::at(path)?.source;
    let mut magic = Vec::new();
    source.by_ref().take(4).read_to_end(&mut magic).map_err(io)?;
    source.rewind().map_err(io)?;
    if magic == [0x76, 0x2f, 0x31, 0x01] {
        rgb_of(path, &exr::decode(path, source, limit)?)
    } else {
        decode_with_image(path, source, limit)
    }
}

/// The picture among an exr file's channels: R, G and B, or Y for grey.
fn rgb_of(path: &Path, channels: &exr::ExrChannels) -> Result<Image> {
    let find = |name| channels.f32(name).or_else(|| channels.f32("Y"));
    let (Some(r), Some(g), Some(b)) = (find("R"), find("G"), find("B")) else {
        let names: Vec<&str> = channels.list.iter().map(|c| c.name.as_str()).collect();
        let names = names.join(", ");
        return Err(Error::input(path, format!("no channels R, G, B or Y among {names}")));
    };
    let rgb = r.iter().zip(g).zip(b).map(|((r, g), b)| Rgb::new(*r, *g, *b));
    Image::new(channels.width, channels.height, rgb.collect(), Encoding::Linear)
}

fn decode_with_image(path: &Path, source: BufReader<File>, limit: u64) -> Result<Image> {
    let refuse = |e: ImageError| match e {
        ImageError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io("read", path, e)
        }
        e => Error::input(path, format!("not a readable picture: {e}")),
    };
    let reader =
        ImageReader::new(source).with_guessed_format().map_err(|e| Error::io("read", path, e))?;
    let Some(format) = reader.format() else {
        return Err(Error::input(
            path,
            "not a picture that can be read: png, ppm, jpeg, hdr or exr",
        ));
    };
    let mut reader = reader;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(limit);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(refuse)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    // The file's own samples, then three f32 each.
    check_memory(path, decoder.total_bytes().saturating_add(pixels.saturating_mul(12)), limit)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(refuse)?;
    let encoding = if format == ImageFormat::Hdr { Encoding::Linear } else { Encoding::Srgb };
    let rgb = bytemuck::cast_slice(&picture.into_rgb32f().into_raw()).to_vec();
    Image::new(width, height, rgb, encoding)
        .map_err(|_| Error::input(path, format!("a picture of {width}x{height} pixels")))
}

#[cfg(test)]
mod tests {
    use super::super::{WriteOptions, write_image};
    use super::*;
    use crate::film::Film;
    use std::fs;

    fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        (folder, path)
    }

    #[test]
    fn grey_and_wide_ppm_kin() {
        let (_folder, path) = file("a.pgm", b"P5 2 1 255\n\x00\xff");
        assert_eq!(read_image(&path).expect("grey").rgb, [Rgb::ZERO, Rgb::ONE]);
        let (_folder, path) = file("a.ppm", b"P6 1 1 65535\n\x80\x00\xff\xff\x00\x01");
        let expected = Rgb::new(32_768.0, 65_535.0, 1.0) / 65_535.0;
        assert!((read_image(&path).expect("wide").rgb[0] - expected).length() < 1e-7);
    }

    #[test]
    fn hdr_is_linear() {
        let (_folder, path) = file("a.hdr", b"");
        let file = File::create(&path).expect("created");
        let pixels = [image::Rgb([4.0f32, 0.5, 0.25])];
        image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 1, 1).expect("written");
        let image = read_image(&path).expect("hdr");
        assert_eq!(image.encoding, Encoding::Linear);
        assert!((image.rgb[0] - Rgb::new(4.0, 0.5, 0.25)).length() < 0.05);
    }

    #[test]
    fn a_file_that_is_no_picture_is_refused() {
        let cases: [(&str, &[u8]); 6] = [
            ("empty.png", b""),
            ("text.png", b"hello, this is no picture"),
            ("short.png", b"\x89PNG\r\n\x1a\n\x00\x00\x00\x0dIHDR"),
            ("magic.exr", b"\x76\x2f\x31\x01"),
            ("short.ppm", b"P6 4 4 255\nabc"),
            ("zero.ppm", b"P6 0 4 255\n"),
        ];
        for (name, bytes) in cases {
            let (_folder, path) = file(name, bytes);
            let error = read_image(&path).expect_err(name);
            assert!(matches!(error, Error::Input(_)), "{name}: {error}");
            assert!(error.to_string().contains(name), "{error}");
        }
        assert!(matches!(read_image("no/such.png"), Err(Error::Io { .. })));
        assert!(matches!(read_image("/dev/zero"), Err(Error::Input(_))));
        assert!(matches!(read_image("/tmp"), Err(Error::Input(_))));
    }

    #[test]
    fn a_header_beyond_the_memory_limit_is_refused() {
        let bomb = b"P6 60000 60000 255\n";
        let mut png = Vec::new();
        let mut encoder = png::Encoder::new(&mut png, 100_000, 100_000);
        encoder.set_color(png::ColorType::Rgb);
        drop(encoder.write_header());
        for (name, bytes) in [("bomb.ppm", bomb.as_slice()), ("bomb.png", &png)] {
            let (_folder, path) = file(name, bytes);
            let error = read_image(&path).expect_err("too large");
            assert!(matches!(error, Error::Input(_)), "{error}");
        }
    }

    /// Damaged copies of good files end in an error or a picture, never in a panic.
    #[test]
    fn damaged_files_never_panic() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut film = Film::new(21, 34, true);
        for (i, c) in film.rgb.iter_mut().enumerate() {
            *c = Rgb::splat(i as f32 / 500.0);
        }
        let mut random = 1u64;
        let mut next = move |n: usize| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) as usize % n
        };
        for name in ["a.png", "a.exr", "a.ppm"] {
            let path = folder.path().join(name);
            write_image(&path, &film, &WriteOptions::default()).expect("written");
            let good = fs::read(&path).expect("there");
            for round in 0..400 {
                let mut bytes = good.clone();
                for _ in 0..=next(3) {
                    // Headers are short: aim at them half of the time.
                    let at =
                        if round % 2 == 0 { next(good.len()) } else { next(good.len().min(600)) };
                    bytes[at] = next(256) as u8;
                }
                if round % 5 == 0 {
                    bytes.truncate(next(good.len()));
                }
                fs::write(&path, &bytes).expect("written");
                let _ = read_image_within(&path, 1 << 24);
            }
        }
    }

    /// Another program's file: half floats.
    #[test]
    fn an_exr_file_of_another_renderer_is_read() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/peers/reference_07.exr");
        if !Path::new(path).exists() {
            eprintln!("skipped: {path} is not here");
            return;
        }
        let image = read_image(path).expect("an exr");
        assert_eq!((image.width, image.height, image.encoding), (640, 360, Encoding::Linear));
        assert_eq!(image.count_not_finite(), 0);
        let mean = image.rgb.iter().sum::<Rgb>() / image.rgb.len() as f32;
        assert!(mean.min_element() > 0.05 && mean.max_element() < 5.0, "{mean}");
    }
}
