//! Pictures that the user uploads for frames.

use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::math::{Rgb, srgb_decode};
use crate::reuse::colour::{Entry, KnownColours};
use crate::scene::{Settings, Shot, ToneCurve};

/// Checks that `image` can be used for frame `frame`.
///
/// # Errors
/// [`Error::Usage`]: no such frame in the shot, another size than the job's, or display values of
/// a tone curve that cannot be undone.
pub fn check_upload(frame: u32, image: &Image, shot: &Shot, settings: &Settings) -> Result<()> {
    if !(1..=shot.frames).contains(&frame) {
        let count = shot.frames;
        return Err(Error::Usage(format!(
            "a picture is uploaded for frame {frame}, but the shot has frames 1..{count}"
        )));
    }
    let (width, height) = (settings.width, settings.height);
    if (image.width, image.height) != (width, height) {
        return Err(Error::Usage(format!(
            "the picture uploaded for frame {frame} has {}x{} pixels, the frames have \
             {width}x{height}",
            image.width, image.height
        )));
    }
    if image.encoding == Encoding::Srgb && settings.tone != ToneCurve::Srgb {
        return Err(Error::Usage(format!(
            "the picture uploaded for frame {frame} holds display values, which stand for radiance \
             only under the tone curve srgb\n  help: upload an exr, or choose --tone srgb"
        )));
    }
    Ok(())
}

/// An uploaded picture as entries: display values become radiance again, distances are not known.
pub(super) fn known_of_upload(frame: u32, image: &Image, settings: &Settings) -> KnownColours {
    let decode = |v: f32| (srgb_decode(f64::from(v)) / f64::from(settings.exposure)) as f32;
    let radiance = |c: &Rgb| match image.encoding {
        Encoding::Linear => *c,
        Encoding::Srgb => Rgb::new(decode(c.x), decode(c.y), decode(c.z)),
    };
    let entry = |(pixel, c)| Entry { pixel, rgb: radiance(c), distance: f32::NAN };
    KnownColours { frame, entries: (0..).zip(&image.rgb).map(entry).collect() }
}
