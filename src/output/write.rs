//! Writing a film to a file in the format of its ending.

use super::{Format, WriteOptions, Written, atomic, exr, maps, png};
use crate::error::{Error, Result};
use crate::film::Film;
use std::path::Path;

/// Writes `film` to `path` in the format of its ending: whole or not at all. exr holds the AOVs of
/// `options` too, as far as the film has them.
///
/// # Errors
/// [`Error::Usage`] for an unknown ending, for `png_bits` other than 8 and 16 and for a film
/// without pixels; [`Error::Io`] when the file cannot be written.
pub fn write_image(path: impl AsRef<Path>, film: &Film, options: &WriteOptions) -> Result<Written> {
    let path = path.as_ref();
    let format = Format::of(path)?;
    if film.rgb.is_empty() {
        let (w, h) = (film.width, film.height);
        return Err(Error::Usage(format!("an image of {w}x{h} pixels cannot be written")));
    }
    match format {
        Format::Png => png::write(path, film, options),
        Format::Exr => {
            let mut channels = exr::channels_of(film, &options.aovs);
            channels.extend(maps::channels_of(film, &options.aovs));
            let (width, height) = (film.width, film.height);
            let attribute = options.attribute.as_ref().map(|(name, bytes)| (*name, &**bytes));
            let comment = options.comment();
            let bytes = exr::encode_with(width, height, &channels, &comment, attribute)?;
            atomic::write(path, |w| w.write_all(&bytes))
        }
        Format::Ppm => {
            let pixels = options.display.encode_8(&film.rgb, film.width);
            atomic::write(path, |w| {
                write!(w, "P6\n{} {}\n255\n", film.width, film.height)?;
                w.write_all(&pixels)
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Display, read_image};
    use super::*;
    use crate::film::Encoding;
    use crate::math::Rgb;
    use crate::scene::{Aovs, Settings, ToneCurve};

    /// Every 8-bit level (and beyond) in every channel.
    fn film() -> Film {
        let mut film = Film::new(37, 21, false);
        for (i, c) in film.rgb.iter_mut().enumerate() {
            *c = Rgb::new(i as f32 / 700.0, 1.0 - i as f32 / 900.0, (i % 7) as f32 / 5.0);
        }
        film
    }

    fn round_trip(name: &str, options: &WriteOptions) -> crate::film::Image {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        let written = write_image(&path, &film(), options).expect("written");
        let bytes = std::fs::read(&path).expect("there");
        assert_eq!(written.hash, blake3::hash(&bytes));
        let image = read_image(&path).expect("readable");
        assert_eq!((image.width, image.height), (37, 21));
        image
    }

    #[test]
    fn png_and_ppm_come_back_exactly() {
        let eight = WriteOptions { frame: Some(3), settings: "é".into(), ..Default::default() };
        let sixteen = WriteOptions { png_bits: 16, ..Default::default() };
        let film = film();
        let expected_8 = eight.display.encode_8(&film.rgb, 37);
        for name in ["a.png", "b.ppm", "c.PNG"] {
            let image = round_trip(name, &eight);
            assert_eq!(image.encoding, Encoding::Srgb);
            for (c, e) in image.rgb.iter().zip(expected_8.chunks_exact(3)) {
                assert_eq!(*c, Rgb::from_array([0, 1, 2].map(|i| f32::from(e[i]) / 255.0)));
            }
        }
        let expected_16 = sixteen.display.encode_16(&film.rgb, 37);
        for (c, e) in round_trip("a.png", &sixteen).rgb.iter().zip(expected_16.chunks_exact(6)) {
            let level = |i: usize| f32::from(u16::from_be_bytes([e[2 * i], e[2 * i + 1]]));
            assert_eq!(*c, Rgb::from_array([0, 1, 2].map(|i| level(i) / 65_535.0)));
        }
    }

    #[test]
    fn exr_is_linear_whatever_the_exposure() {
        let display = Display { exposure: 8.0, tone: ToneCurve::Filmic };
        let image = round_trip("a.exr", &WriteOptions { display, ..Default::default() });
        assert_eq!((image.encoding, image.rgb), (Encoding::Linear, film().rgb));
    }

    #[test]
    fn the_same_film_is_the_same_bytes() {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = Settings { aovs: Some(Aovs::All), ..Settings::default() };
        let options = WriteOptions::of(&settings, Some(7));
        let mut film = film();
        film.gbuffer = Some(crate::film::GBuffer::new(film.rgb.len()));
        for name in ["a.png", "a.exr", "a.ppm"] {
            let write = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let path = folder.path().join(name);
                pool.expect("a pool").install(|| write_image(path, &film, &options))
            };
            let first = write(1).expect("written").hash;
            assert!((0..5).all(|i| write(1 + i % 3).expect("written").hash == first), "{name}");
        }
    }

    #[test]
    fn unknown_formats_and_empty_films_are_usage_errors() {
        let options = WriteOptions::default();
        for name in ["a.gif", "a", "png", ".png", "a.png.bak"] {
            let error = write_image(name, &film(), &options).expect_err("no such format");
            assert!(matches!(error, Error::Usage(_)));
            assert!(error.to_string().contains(".png, .exr or .ppm"), "{error}");
        }
        let empty = Film::new(0, 5, false);
        assert!(matches!(write_image("a.png", &empty, &options), Err(Error::Usage(_))));
        let odd = WriteOptions { png_bits: 12, ..options };
        assert!(matches!(write_image("a.png", &film(), &odd), Err(Error::Usage(_))));
    }
}
