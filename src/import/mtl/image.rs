//! `map_Kd`, `map_d` and other maps: a file and options of how its image lies on the surface.
//!
//! `-s u v w` multiplies the texture coordinates and `-o u v w` is then added, 1 and 0 where a number is left out; the
//! third is for solid textures and does nothing. With `-clamp on` the image does not repeat: its edge goes on. Of
//! `map_Pr` also the channel `-imfchan` is read, of normals the strength `-bm`. Other options are noted and ignored.

use crate::import::lines::{Words, number, show};
use crate::import::source::Notes;
use crate::import::texture::ImageChannel;
use crate::math::{DAffine2, DVec2};
use crate::scene::{TextureMap, Wrap, limits};

/// Largest offset, as in a scene file.
const MOST_OFFSET: f64 = 1e30;

/// What the image of a `map` statement gives, which decides on the options that count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MapKind {
    /// Colours or cut-outs.
    Image,
    /// One channel, `-imfchan`.
    Data,
    /// Normals of the strength `-bm`, or heights.
    Normals,
}

/// The image of a `map` statement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MapImage {
    /// The file, as it is written.
    pub name: String,
    pub options: MapOptions,
}

/// How the image of a `map` statement lies on the surface, and what of it counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MapOptions {
    scale: [f64; 2],
    offset: [f64; 2],
    wrap: Wrap,
    /// Of data.
    pub channel: ImageChannel,
    /// Of normals.
    pub strength: f64,
}

impl Default for MapOptions {
    fn default() -> Self {
        let (channel, strength) = (ImageChannel::Green, 1.0);
        Self { scale: [1.0; 2], offset: [0.0; 2], wrap: Wrap::Repeat, channel, strength }
    }
}

impl MapImage {
    /// The options and the file's name, which may hold blanks, of `[options] file` after `keyword`.
    ///
    /// Errors: an option without a value or with one that is impossible; no file.
    pub fn read(
        keyword: &str,
        kind: MapKind,
        mut words: Words<'_>,
        line: usize,
        notes: &mut Notes,
    ) -> Result<Self, String> {
        let mut options = MapOptions::default();
        loop {
            let mut ahead = words;
            let Some(option) = ahead.next() else { break };
            let of = |message| format!("`{keyword}`: the option `{}` {message}", show(option));
            match option {
                b"-s" => options.scale = scale(&mut ahead).map_err(of)?,
                b"-o" => options.offset = offset(&mut ahead).map_err(of)?,
                b"-clamp" => options.wrap = clamp(&mut ahead).map_err(of)?,
                b"-imfchan" if kind == MapKind::Data => {
                    options.channel = channel(&mut ahead).map_err(of)?;
                }
                b"-bm" if kind == MapKind::Normals => {
                    options.strength = strength(&mut ahead).map_err(of)?;
                }
                _ => {
                    let Some(values) = values_of_ignored(option) else { break };
                    notes.add(&format!("texture option `{}` is ignored", show(option)), line);
                    skip(values, &mut ahead).map_err(of)?;
                }
            }
            words = ahead;
        }
        let name = String::from_utf8_lossy(words.rest()).into_owned();
        if name.is_empty() {
            return Err(format!("`{keyword}` without a file name"));
        }
        Ok(Self { name, options })
    }
}

impl MapOptions {
    /// As scene data, with the decoded image's index.
    pub fn map(&self, image: u32) -> TextureMap {
        let ([x, y], offset) = (self.scale, DVec2::from_array(self.offset));
        let transform = DAffine2::from_cols(DVec2::new(x, 0.0), DVec2::new(0.0, y), offset);
        TextureMap { wrap: [self.wrap; 2], transform, ..TextureMap::of(image) }
    }
}

/// How many values an option has that is ignored; `None` for what is no option.
fn values_of_ignored(option: &[u8]) -> Option<usize> {
    match option {
        b"-t" => Some(3),
        b"-mm" => Some(2),
        b"-blendu" | b"-blendv" | b"-cc" | b"-bm" | b"-boost" | b"-texres" | b"-imfchan"
        | b"-type" | b"-colorspace" => Some(1),
        _ => None,
    }
}

/// Passes over the values of an ignored option, the second and third of which may be left out.
fn skip(values: usize, words: &mut Words<'_>) -> Result<(), String> {
    for used in 0..values {
        let mut ahead = *words;
        let is_value = ahead.next().is_some_and(|word| values == 1 || number(word).is_ok());
        if is_value {
            *words = ahead;
        } else if used == 0 {
            return Err("lacks a value".into());
        }
    }
    Ok(())
}

fn scale(words: &mut Words<'_>) -> Result<[f64; 2], String> {
    let scale = numbers(words, 1.0)?;
    match scale.into_iter().find(|x| !limits::FACTOR.contains(&x.abs())) {
        Some(x) => {
            Err(format!("holds {x:?}: a number from 1e-30 to 1e30 or its negative is needed"))
        }
        None => Ok([scale[0], scale[1]]),
    }
}

fn offset(words: &mut Words<'_>) -> Result<[f64; 2], String> {
    let offset = numbers(words, 0.0)?;
    match offset.into_iter().find(|x| x.abs() > MOST_OFFSET) {
        Some(x) => Err(format!("holds {x:?}: from -1e30 to 1e30 is possible")),
        None => Ok([offset[0], offset[1]]),
    }
}

fn clamp(words: &mut Words<'_>) -> Result<Wrap, String> {
    match words.next() {
        Some(b"on") => Ok(Wrap::Clamp),
        Some(b"off") => Ok(Wrap::Repeat),
        Some(other) => Err(format!("is `on` or `off`, not `{}`", show(other))),
        None => Err("lacks a value".into()),
    }
}

fn channel(words: &mut Words<'_>) -> Result<ImageChannel, String> {
    match words.next() {
        Some(b"r") => Ok(ImageChannel::Red),
        // The luminance of a grey image is its green, and depth is no channel of an image.
        Some(b"g" | b"l" | b"z") => Ok(ImageChannel::Green),
        Some(b"b") => Ok(ImageChannel::Blue),
        Some(b"m") => Ok(ImageChannel::Alpha),
        Some(other) => Err(format!("takes r, g, b, m, l or z, not `{}`", show(other))),
        None => Err("lacks a value".into()),
    }
}

fn strength(words: &mut Words<'_>) -> Result<f64, String> {
    let word = words.next().ok_or("lacks a value")?;
    // A negative one turns heights around, which are not read.
    let strength = value(word)?.abs();
    match (0.0..=*limits::FACTOR.end()).contains(&strength) {
        true => Ok(strength),
        false => Err(format!("holds {strength:?}: from 0 to 1e30 is possible")),
    }
}

fn value(word: &[u8]) -> Result<f64, String> {
    number(word).map_err(|message| format!("has no such value: {message}"))
}

/// One to three numbers; those that are left out are `absent`. A later word that is no number begins the file's name.
fn numbers(words: &mut Words<'_>, absent: f64) -> Result<[f64; 3], String> {
    let mut values = [absent; 3];
    for (k, each) in values.iter_mut().enumerate() {
        let mut ahead = *words;
        let Some(word) = ahead.next() else {
            if k == 0 {
                return Err("lacks a value".into());
            }
            break;
        };
        // NaN and infinity are numbers, of which none can be used.
        let is_number = std::str::from_utf8(word).is_ok_and(|word| word.parse::<f64>().is_ok());
        if k > 0 && !is_number {
            break;
        }
        *each = value(word)?;
        *words = ahead;
    }
    Ok(values)
}
