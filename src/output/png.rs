//! Films to png, with the colour space and a few words of metadata.

use super::format::{SOFTWARE, WriteOptions};
use super::{Written, atomic};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::scene::ToneCurve;
use std::io::{self, Write};
use std::path::Path;

/// Writes the film's display values with 8 or 16 bits a channel.
pub fn write(path: &Path, film: &Film, options: &WriteOptions) -> Result<Written> {
    let (depth, data) = match options.png_bits {
        8 => (png::BitDepth::Eight, options.display.encode_8(&film.rgb, film.width)),
        16 => (png::BitDepth::Sixteen, options.display.encode_16(&film.rgb, film.width)),
        n => return Err(Error::Usage(format!("png has 8 or 16 bits a channel, not {n}"))),
    };
    atomic::write(path, |w| encode(w, film, depth, &data, options).map_err(to_io))
}

fn encode(
    w: &mut dyn Write,
    film: &Film,
    depth: png::BitDepth,
    data: &[u8],
    options: &WriteOptions,
) -> std::result::Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(w, film.width, film.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Balanced);
    if options.display.tone == ToneCurve::Linear {
        encoder.set_source_gamma(png::ScaledFloat::new(1.0));
    } else {
        // Writes gAMA and cHRM beside sRGB, for readers that know only those.
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    }
    // tEXt is Latin-1; iTXt is UTF-8, and as many programs read it.
    encoder.add_itxt_chunk("Software".into(), SOFTWARE.into())?;
    if let Some(frame) = options.frame {
        encoder.add_itxt_chunk("Frame".into(), frame.to_string())?;
    }
    if !options.settings.is_empty() {
        encoder.add_itxt_chunk("Settings".into(), options.settings.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(data)?;
    writer.finish()
}

fn to_io(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use std::io::BufReader;

    #[test]
    fn colour_space_and_metadata_are_in_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let mut options = WriteOptions { frame: Some(42), ..Default::default() };
        options.settings = "spp 4, größer".into();
        let film = Film::new(3, 2, false);
        write(&path, &film, &options).expect("written");
        let info = |path: &Path| {
            let file = BufReader::new(File::open(path).expect("there"));
            png::Decoder::new(file).read_info().expect("a png").info().clone()
        };
        let found = info(&path);
        assert_eq!(found.srgb, Some(png::SrgbRenderingIntent::Perceptual));
        let text = |key: &str| {
            let chunk = found.utf8_text.iter().find(|t| t.keyword == key).expect("the chunk");
            chunk.get_text().expect("text")
        };
        assert_eq!(text("Software"), SOFTWARE);
        assert_eq!((text("Frame").as_str(), text("Settings").as_str()), ("42", "spp 4, größer"));

        options.display.tone = ToneCurve::Linear;
        write(&path, &film, &options).expect("written");
        let found = info(&path);
        assert_eq!((found.srgb, found.gamma()), (None, Some(png::ScaledFloat::new(1.0))));
    }
}
