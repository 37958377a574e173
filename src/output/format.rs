//! File formats of frames, and options for writing films.

use super::Display;
use super::maps::MapScales;
use crate::error::{Error, Result};
use crate::scene::{Aovs, Settings, ToneCurve};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// A file format of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Format {
    /// Display values, 8 or 16 bits.
    Png,
    /// Linear radiance and AOVs, f32; see [`Aovs`].
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
    /// What exr frames hold beside colour, as far as the film has it.
    pub aovs: Aovs,
    /// Set if maps are written as files beside frames that are not exr.
    pub maps: Option<MapScales>,
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
            aovs: Aovs::default(),
            maps: None,
            attribute: None,
        }
    }
}

impl WriteOptions {
    /// The options for the job's settings, with the settings that shape the picture as text.
    pub fn of(settings: &Settings, frame: Option<u32>) -> Self {
        let s = settings;
        let text = format!(
            "size {}x{}, spp {}, shadow samples {}, sky samples {}, bounces {}, seed {}, \
             exposure {}, tone {:?}",
            s.width,
            s.height,
            s.camera_samples(),
            s.shadow_sample_range(),
            s.sky_sample_range(),
            s.bounces,
            s.seed,
            s.exposure,
            s.tone,
        );
        let clamp = s.clamp.map_or_else(String::new, |most| format!(", clamp {most}"));
        let lights = if s.all_lights { ", all lights" } else { "" };
        let text = text + &clamp + lights;
        let display = Display { exposure: s.exposure, tone: s.tone };
        let aovs = s.aovs.clone().unwrap_or_default();
        let (png_bits, settings) = (s.png_bits, text);
        Self { display, png_bits, frame, settings, aovs, maps: None, attribute: None }
    }

    /// The metadata as one line, for formats with a single comment.
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
