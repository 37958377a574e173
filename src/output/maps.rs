//! Maps: where a frame's light comes from and how many camera samples its pixels have, painted over the frame.
//!
//! A map is a png file beside its frame, `frame_0001_provenance.png`, or channels of an exr frame. The colours below
//! are linear.

mod read;
mod scales;

pub use read::of_exr;
pub use scales::MapScales;

use super::exr::{ExrChannel, ExrSamples};
use super::{Display, WriteOptions, Written, png};
use crate::error::Result;
use crate::film::{Film, Provenance, ProvenanceKind};
use crate::math::{Rgb, luminance};
use crate::scene::{Aov, Aovs, ToneCurve};
use std::path::{Path, PathBuf};

/// Traced: the source paper's pink.
const PINK: Rgb = Rgb::new(1.0, 0.13, 0.6);
/// Inferred from earlier frames: the paper's red.
const RED: Rgb = Rgb::new(0.6, 0.0, 0.0);
/// Inferred from later frames.
const BLUE: Rgb = Rgb::new(0.0, 0.08, 0.7);
/// Inferred from both.
const BOTH: Rgb = Rgb::splat(0.3);
/// Share of the grey picture in a painted pixel.
const GREY: f32 = 0.25;
/// Share of the grey picture in pixels with nothing to infer.
const DARK: f32 = 0.05;
/// Error that has the full colour, display steps of 1/255.
const WORST: f32 = 16.0;
/// Difference of the hues of consecutive frames, as a share of the circle; by the golden ratio, so that nearby frames
/// have different hues.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// One of the maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Map {
    /// Traced, inferred from earlier or later frames or both, or nothing to infer.
    Provenance,
    /// The reference frame with the largest weight.
    Frame,
    /// Distance of the samples that were used from the pixel's own point.
    Distance,
    /// Errors of the audited pixels.
    Audit,
    /// Number of camera samples.
    Samples,
}

impl MapScales {
    /// The maps that frames can have.
    pub fn maps(self) -> impl Iterator<Item = Map> {
        Map::ALL.into_iter().filter(move |map| match map {
            Map::Samples => self.samples.is_some(),
            Map::Provenance | Map::Frame | Map::Distance | Map::Audit => self.farthest.is_some(),
        })
    }

    /// Explanation of `map`, in a line.
    pub fn meaning(self, map: Map) -> String {
        let Some([least, most]) = self.samples.filter(|_| map == Map::Samples) else {
            return map.meaning().into();
        };
        let at = |step: u8| {
            let ratio = f64::from(most) / f64::from(least);
            f64::from(least) * ratio.powf(f64::from(step) / 4.0)
        };
        let [violet, red, orange] = [1, 2, 3].map(|step| at(step).round());
        format!(
            "{} Black: {least}, violet: about {violet}, red: {red}, orange: {orange}, white: {most}.",
            map.meaning()
        )
    }
}

impl Map {
    /// All maps.
    pub const ALL: [Self; 5] =
        [Self::Provenance, Self::Frame, Self::Distance, Self::Audit, Self::Samples];

    /// Name of the map in its files' and channel's names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Provenance => "provenance",
            Self::Frame => "frame",
            Self::Distance => "distance",
            Self::Audit => "audit",
            Self::Samples => "samples",
        }
    }

    /// The map as a channel of exr frames.
    pub fn aov(self) -> Aov {
        match self {
            Self::Provenance => Aov::Provenance,
            Self::Frame => Aov::Frame,
            Self::Distance => Aov::Distance,
            Self::Audit => Aov::Audit,
            Self::Samples => Aov::Samples,
        }
    }

    /// Name of the map's channel, for example `reuse.provenance`.
    fn channel_name(self) -> String {
        match self {
            Self::Samples => self.name().into(),
            _ => format!("reuse.{}", self.name()),
        }
    }

    /// Explanation of the map without its scale.
    fn meaning(self) -> &'static str {
        match self {
            Self::Provenance => {
                "Pink: traced. Red: inferred from earlier frames, blue: from later ones, grey: from \
                 both. Dark: nothing to infer."
            }
            Self::Frame => {
                "A colour for each reference frame that light comes from; white: another move's."
            }
            Self::Distance => {
                "How far from the pixel's own point its light was found: black 0, white the farthest."
            }
            Self::Audit => {
                "Where the audit looked: white right, red too bright, blue too dark, full at 16 \
                 display steps."
            }
            Self::Samples => "How many camera samples each pixel has.",
        }
    }

    /// Path of the map's file for the frame at `path`: `out/f_0001_audit.png` for `out/f_0001.ppm`.
    pub fn path(self, path: &Path) -> PathBuf {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        path.with_file_name(format!("{stem}_{}.png", self.name()))
    }

    /// The map painted over the film in grey, linear display values.
    pub fn paint(self, film: &Film, display: &Display, scales: MapScales) -> Film {
        let farthest = scales.farthest.unwrap_or(1.0);
        let mut out = Film::new(film.width, film.height, false);
        for (i, c) in out.rgb.iter_mut().enumerate() {
            let grey = Rgb::splat(luminance(display.tone(film.rgb[i])));
            let source = film.provenance.as_ref().map_or(Provenance::default(), |s| s[i]);
            *c = match self {
                Self::Provenance => by_provenance(&source, grey),
                Self::Frame => inferred(&source, grey, || by_frame(source.frame)),
                Self::Distance => inferred(&source, grey, || heat(source.distance / farthest)),
                Self::Audit => grey * DARK,
                Self::Samples => by_samples(film, i, grey, scales),
            };
        }
        if self == Self::Audit {
            paint_audit(film, &mut out);
        }
        out
    }

    /// Writes the map's file for the frame at `path`.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] when the file cannot be written.
    pub fn write(
        self,
        path: &Path,
        film: &Film,
        options: &WriteOptions,
    ) -> Result<(PathBuf, Written)> {
        let path = self.path(path);
        // The paint is display values already.
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let scales = options.maps.unwrap_or(MapScales { farthest: None, samples: None });
        let painted = self.paint(film, &options.display, scales);
        let options = WriteOptions { display, png_bits: 8, ..options.clone() };
        png::write(&path, &painted, &options).map(|written| (path, written))
    }

    /// The map's channel of an exr frame.
    fn channel(self, film: &Film) -> ExrChannel {
        let n = film.rgb.len();
        let source = |i: usize| film.provenance.as_ref().map_or(Provenance::default(), |s| s[i]);
        let samples = match self {
            Self::Provenance => ExrSamples::U32((0..n).map(|i| source(i).kind as u32).collect()),
            Self::Frame => ExrSamples::U32((0..n).map(|i| source(i).frame).collect()),
            Self::Distance => ExrSamples::F32((0..n).map(|i| source(i).distance).collect()),
            Self::Audit => ExrSamples::F32(film.audit.clone().unwrap_or_else(|| vec![f32::NAN; n])),
            Self::Samples => ExrSamples::U32(film.samples.clone().unwrap_or_default()),
        };
        ExrChannel { name: self.channel_name(), samples }
    }
}

/// The maps among `aovs` as channels of an exr frame.
pub fn channels_of(film: &Film, aovs: &Aovs) -> Vec<ExrChannel> {
    let is_there = |map: &Map| *map != Map::Samples || film.samples.is_some();
    let asked = Map::ALL.into_iter().filter(|map| aovs.has(map.aov()) && is_there(map));
    asked.map(|map| map.channel(film)).collect()
}

fn painted(grey: Rgb, paint: Rgb) -> Rgb {
    grey * GREY + paint * (1.0 - GREY)
}

fn by_provenance(source: &Provenance, grey: Rgb) -> Rgb {
    match source.kind {
        ProvenanceKind::Background => grey * DARK,
        ProvenanceKind::Traced => painted(grey, PINK),
        ProvenanceKind::Earlier => painted(grey, RED),
        ProvenanceKind::Later => painted(grey, BLUE),
        ProvenanceKind::Both => painted(grey, BOTH),
    }
}

fn inferred(source: &Provenance, grey: Rgb, paint: impl FnOnce() -> Rgb) -> Rgb {
    if source.is_inferred() { painted(grey, paint()) } else { grey * DARK }
}

/// Pixels that were not asked for are dark.
fn by_samples(film: &Film, at: usize, grey: Rgb, scales: MapScales) -> Rgb {
    match film.samples.as_ref().map_or(0, |samples| samples[at]) {
        0 => grey * DARK,
        count => painted(grey, heat(scales.share_of(count))),
    }
}

/// A colour for each frame; white for frames of another shot.
fn by_frame(frame: u32) -> Rgb {
    if frame == 0 {
        return Rgb::ONE;
    }
    let hue = (f64::from(frame) * HUE_STEP).fract() as f32 * 6.0;
    let wave = |shift: f32| ((hue + shift).rem_euclid(6.0) - 3.0).abs() - 1.0;
    let full = Rgb::new(wave(0.0), wave(4.0), wave(2.0)).clamp(Rgb::ZERO, Rgb::ONE);
    // Squared, so that the steps between hues look even.
    full * full
}

/// Black through violet and orange to white, for 0 to 1.
fn heat(share: f32) -> Rgb {
    const STOPS: [Rgb; 5] = [
        Rgb::ZERO,
        Rgb::new(0.1, 0.0, 0.35),
        Rgb::new(0.7, 0.03, 0.15),
        Rgb::new(1.0, 0.4, 0.0),
        Rgb::new(1.0, 1.0, 0.6),
    ];
    let at = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) } * (STOPS.len() - 1) as f32;
    let low = (at as usize).min(STOPS.len() - 2);
    STOPS[low].lerp(STOPS[low + 1], at - low as f32)
}

/// Paints audited pixels as dots of 3 x 3 pixels, since single ones would be invisible; red if the pixel
/// is too bright, blue if too dark, white if exact.
fn paint_audit(film: &Film, out: &mut Film) {
    let Some(audit) = &film.audit else { return };
    let (width, height) = (film.width as usize, film.height as usize);
    let dot = |error: f32| {
        let share = (error.abs() / WORST).min(1.0).sqrt();
        Rgb::ONE.lerp(if error > 0.0 { Rgb::X } else { Rgb::Z }, share)
    };
    // The worse of two dots that overlap is seen whole.
    let mut shown = vec![f32::NAN; audit.len()];
    for (i, error) in audit.iter().enumerate().filter(|(_, error)| !error.is_nan()) {
        let (x, y) = (i % width, i / width);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                let at = row * width + column;
                if shown[at].is_nan() || shown[at].abs() < error.abs() {
                    shown[at] = *error;
                    out.rgb[at] = dot(*error);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Policy, Settings};

    fn film() -> Film {
        let mut film = Film::new(6, 5, false);
        film.rgb.fill(Rgb::splat(0.5));
        let mut sources = vec![Provenance::default(); 30];
        let kinds = [
            ProvenanceKind::Traced,
            ProvenanceKind::Earlier,
            ProvenanceKind::Later,
            ProvenanceKind::Both,
        ];
        for (i, kind) in kinds.into_iter().enumerate() {
            sources[i] = Provenance { kind, frame: i as u32, distance: 0.5 * i as f32 };
        }
        film.provenance = Some(sources);
        film
    }

    const SCALES: MapScales = MapScales { farthest: Some(1.0), samples: Some([4, 64]) };

    #[test]
    fn each_provenance_has_its_colour() {
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let map = Map::Provenance.paint(&film(), &display, SCALES);
        let [traced, earlier, later, both, background] = [0, 1, 2, 3, 4].map(|i| map.rgb[i]);
        assert!(traced.x > traced.z && traced.z > traced.y, "pink: {traced}");
        assert!(earlier.x > 2.0 * earlier.y.max(earlier.z), "red: {earlier}");
        assert!(later.z > 2.0 * later.x.max(later.y), "blue: {later}");
        assert_eq!(both, Rgb::splat(both.x));
        assert!(background.x < 0.3 * both.x && background == Rgb::splat(background.x));
    }

    #[test]
    fn consecutive_frames_have_unlike_colours_and_traced_pixels_none() {
        for frame in 1..200 {
            let apart = (by_frame(frame) - by_frame(frame + 1)).abs().max_element();
            assert!(apart > 0.5, "{frame}: {apart}");
        }
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let map = Map::Frame.paint(&film(), &display, SCALES);
        assert_eq!(map.rgb[0], map.rgb[4]);
        assert_ne!(map.rgb[2], map.rgb[3]);
    }

    #[test]
    fn luminance_of_the_heat_map_rises_throughout() {
        let light: Vec<f32> = (0..=20).map(|k| luminance(heat(k as f32 / 20.0))).collect();
        assert!(light.windows(2).all(|w| w[0] < w[1]), "{light:?}");
        assert_eq!((heat(f32::NAN), heat(9.0)), (heat(0.0), heat(1.0)));
    }

    #[test]
    fn errors_have_signs_and_the_worse_covers_the_better() {
        let mut film = film();
        let mut audit = vec![f32::NAN; 30];
        (audit[8], audit[9]) = (-12.0, 1.0);
        film.audit = Some(audit);
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let map = Map::Audit.paint(&film, &display, SCALES);
        assert!(map.rgb[9].z > map.rgb[9].x, "the worse, too dark, is blue: {}", map.rgb[9]);
        assert!(map.rgb[10].x > map.rgb[10].z && map.rgb[29] == map.rgb[23]);
    }

    #[test]
    fn more_camera_samples_are_brighter_by_their_ratio() {
        let mut film = film();
        film.rgb.fill(Rgb::ZERO);
        film.samples = Some((0..30).map(|i| if i < 5 { 4 << i } else { 0 }).collect());
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let map = Map::Samples.paint(&film, &display, SCALES);
        for (i, share) in [0.0, 0.25, 0.5, 0.75, 1.0].into_iter().enumerate() {
            let expected = heat(share) * (1.0 - GREY);
            assert!((map.rgb[i] - expected).abs().max_element() < 1e-4, "{i}: {}", map.rgb[i]);
        }
        assert_eq!(map.rgb[5], Rgb::ZERO, "not asked for");
        assert_eq!(
            SCALES.meaning(Map::Samples),
            "How many camera samples each pixel has. Black: 4, violet: about 8, red: 16, orange: 32, white: 64."
        );
    }

    #[test]
    fn frames_have_the_maps_that_their_settings_allow() {
        let maps = |policy, most_spp| {
            let mut settings = Settings { spp: 2, most_spp, ..Settings::default() };
            settings.reuse.policy = policy;
            MapScales::of(&settings).maps().count()
        };
        assert_eq!(maps(Policy::Off, None), 0);
        assert_eq!(maps(Policy::Off, Some(8)), 1);
        assert_eq!((maps(Policy::Surface, None), maps(Policy::Surface, Some(8))), (4, 5));
    }

    #[test]
    fn an_exr_frame_holds_them_as_channels() {
        let channels = channels_of(&film(), &Aovs::All);
        let names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["reuse.provenance", "reuse.frame", "reuse.distance", "reuse.audit"]);
        let ExrSamples::U32(provenance) = &channels[0].samples else { panic!("numbers") };
        assert_eq!(provenance[..5], [1, 2, 3, 4, 0]);
        assert_eq!(Map::Audit.path(Path::new("o/f_01.ppm")), Path::new("o/f_01_audit.png"));
    }
}
