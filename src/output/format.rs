//! From a film to a file of the format that its name asks for.

use super::{Display, Written, atomic, exr, maps, png};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::{Settings, ToneCurve};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// What can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Display values, 8 or 16 bits.
    Png,
    /// Linear radiance and AOVs, f32.
    Exr,
    /// Display values, 8 bits, binary (P6).
    Ppm,
}

impl Format {
    /// The format that a file's ending names, in either case.
    ///
    /// # Errors
    /// [`Error::Usage`] for another ending or none, with the endings there are.
    pub fn of(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some("ppm") => Ok(Self::Ppm),
            _ => Err(Error::Usage(format!(
                "cannot tell the format of {}: the name must end in .png, .exr or .ppm",
                path.display()
            ))),
        }
    }
}

/// How a film is written.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Exposure and tone curve of png and ppm; exr takes neither.
    pub display: Display,
    /// Bits a channel of png: 8 or 16.
    pub png_bits: u8,
    /// Frame number, written to the file's metadata.
    pub frame: Option<u32>,
    /// The settings as short text for the file's metadata; nothing that differs between runs of
    /// the same frame, since the same frame is to be the same bytes.
    pub settings: String,
    /// Whether exr frames hold the maps of reuse as channels, and other frames have them beside them:
    /// the distance to paint as the farthest, in the unit of the film's.
    pub maps: Option<f32>,
    /// An attribute of exr frames: name and bytes.
    pub attribute: Option<(&'static str, Arc<[u8]>)>,
}

impl Default for WriteOptions {
    fn default() -> Self {
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        Self {
            display,
            png_bits: 8,
            frame: None,
            settings: String::new(),
            maps: None,
            attribute: None,
        }
    }
}

impl WriteOptions {
    /// What the job's settings ask for, with those that shape the picture as text.
    pub fn of(settings: &Settings, frame: Option<u32>) -> Self {
        let s = settings;
        let text = format!(
            "size {}x{}, spp {}, shadow samples {}, sky samples {}, bounces {}, seed {}, \
             exposure {}, tone {:?}",
            s.width,
            s.height,
            s.spp,
            s.shadow_samples,
            s.sky_samples,
            s.bounces,
            s.seed,
            s.exposure,
            s.tone,
        );
        let clamp = s.clamp.map_or_else(String::new, |most| format!(", clamp {most}"));
        let text = text + &clamp;
        let display = Display { exposure: s.exposure, tone: s.tone };
        Self { display, png_bits: s.png_bits, frame, settings: text, maps: None, attribute: None }
    }

    /// One line for formats with a single comment.
    pub(super) fn comment(&self) -> String {
        let frame = self.frame.map(|f| format!("frame {f}"));
        let parts = frame.into_iter().chain([self.settings.clone()]);
        parts.filter(|p| !p.is_empty()).collect::<Vec<_>>().join(", ")
    }
}

/// The version, and a fingerprint of the sources: two builds of one version may make other bytes, which must
/// not be mixed in a sequence.
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("TWEENRAY_SOURCES"));

/// The program's name and version, as files name it.
pub(super) const SOFTWARE: &str = concat!("tweenray ", env!("CARGO_PKG_VERSION"));

/// Writes `film` to `path` in the format of its ending: whole or not at all. exr holds the AOVs
/// too, when the film has them.
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
            let mut channels = exr::channels_of(film);
            if options.maps.is_some() {
                channels.extend(maps::channels_of(film));
            }
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
    use super::super::read_image;
    use super::*;
    use crate::film::Encoding;
    use crate::math::Rgb;

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
        let options = WriteOptions::of(&Settings::default(), Some(7));
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
    fn what_cannot_be_written_is_a_usage_error() {
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
