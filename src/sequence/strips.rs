//! Strips of a rendered frame as bytes, and frames joined from strips.
//!
//! A strip is some whole rows of blocks, so its rays are the same as in a frame rendered at once. It is
//! encoded by [`postcard`] and deflated. The bytes are never stored, and the same program decodes
//! them.

use crate::error::{Error, Result};
use crate::film::{Film, GBuffer, Provenance};
use crate::inference::TracedPoints;
use crate::math::Rgb;
use crate::scene::Settings;
use crate::shade::Rendered;
use crate::stats::{BadSamples, RayCounts, ReuseCounts};
use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// Edge of the blocks that frames are traced in, pixels.
const BLOCK: u32 = 8;

/// The content of a strip.
#[derive(Serialize, Deserialize)]
struct Content {
    rgb: Vec<Rgb>,
    gbuffer: Option<GBuffer>,
    samples: Option<Vec<u32>>,
    provenance: Option<Vec<Provenance>>,
    bad: BadSamples,
    rays: RayCounts,
    reuse: ReuseCounts,
    sources: TracedPoints,
}

/// Which strip of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Strip {
    /// Number of the strip, from the top, from 0.
    pub number: u32,
    /// How many strips the frame is cut into.
    pub of: u32,
    /// Whether other frames are inferred from this one.
    pub is_source: bool,
}

/// Frames that were joined from strips, until they are asked for.
#[derive(Default)]
pub struct JoinedStrips(Mutex<BTreeMap<u32, Rendered>>);

impl JoinedStrips {
    /// Joins all `strips` of `frame`, in order.
    ///
    /// # Errors
    /// The strips do not make a frame of the size in `settings`.
    pub fn join(&self, frame: u32, strips: &[Arc<[u8]>], settings: &Settings) -> Result<()> {
        let rendered = join(strips, settings.width, settings.height)?;
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(frame, rendered);
        Ok(())
    }

    /// Takes the frame, if it was joined.
    pub fn take(&self, frame: u32) -> Option<Rendered> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).remove(&frame)
    }
}

/// The most strips that a frame of `height` pixel rows can have.
pub fn most(height: u32) -> u32 {
    height.div_ceil(BLOCK)
}

/// The pixel rows of a strip of a frame of `height` rows.
fn rows(strip: Strip, height: u32) -> Range<u32> {
    let blocks = u64::from(most(height));
    let edge = |n: u32| (blocks * u64::from(n) / u64::from(strip.of)) as u32 * BLOCK;
    edge(strip.number).min(height)..edge(strip.number + 1).min(height)
}

/// Which pixels of a frame are in the strip, row by row.
pub fn mask(strip: Strip, settings: &Settings) -> Vec<bool> {
    let Settings { width, height, .. } = *settings;
    let rows = rows(strip, height);
    (0..height).flat_map(|y| std::iter::repeat_n(rows.contains(&y), width as usize)).collect()
}

/// The bytes of a rendered strip.
pub fn encode(rendered: Rendered, strip: Strip) -> Result<Vec<u8>> {
    let Rendered { film, rays, sources, reuse, spreads: _, pilots: _ } = rendered;
    let Range { start, end } = rows(strip, film.height);
    let own = film.index(0, start)..film.index(0, end);
    // The audit is made once the strips are joined.
    let Film { width: _, height: _, rgb, gbuffer, samples, provenance, audit: _, bad } = film;
    let content = Content {
        rgb: rgb[own.clone()].to_vec(),
        gbuffer: gbuffer.map(|g| g.part(own.clone())),
        samples: samples.map(|samples| samples[own.clone()].to_vec()),
        provenance: provenance.map(|p| p[own].to_vec()),
        bad,
        rays,
        reuse,
        sources,
    };
    pack(&content)
}

/// A whole frame from all its strips, in order.
///
/// # Errors
/// The strips do not make a frame of this size.
fn join(strips: &[Arc<[u8]>], width: u32, height: u32) -> Result<Rendered> {
    let mut film = Film::new(width, height, false);
    film.rgb.clear();
    let (mut rays, mut reuse) = (RayCounts::default(), ReuseCounts::default());
    let mut sources = TracedPoints::default();
    for bytes in strips {
        let content = unpack(bytes)?;
        let Content { rgb, gbuffer, samples, provenance, bad, .. } = content;
        film.rgb.extend(rgb);
        if let Some(part) = gbuffer {
            film.gbuffer.get_or_insert_with(|| GBuffer::new(0)).append(part);
        }
        if let Some(part) = samples {
            film.samples.get_or_insert_default().extend(part);
        }
        if let Some(part) = provenance {
            film.provenance.get_or_insert_default().extend(part);
        }
        film.bad += bad;
        rays += content.rays;
        reuse += content.reuse;
        sources.append(content.sources);
    }
    if film.rgb.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(Error::Failed("strips of another rank do not make a frame".into()));
    }
    let (spreads, pilots) = (Vec::new(), Vec::new());
    Ok(Rendered { film, rays, sources, reuse, spreads, pilots })
}

fn pack(content: &Content) -> Result<Vec<u8>> {
    let raw =
        postcard::to_stdvec(content).map_err(|e| Error::Failed(format!("cannot pack: {e}")))?;
    let mut packed = Vec::new();
    let read = DeflateEncoder::new(&raw[..], Compression::fast()).read_to_end(&mut packed);
    read.map_err(|e| Error::Failed(format!("cannot pack: {e}")))?;
    Ok(packed)
}

fn unpack(bytes: &[u8]) -> Result<Content> {
    let wrong = |e: String| Error::Failed(format!("cannot understand another rank: {e}"));
    let mut raw = Vec::new();
    DeflateDecoder::new(bytes).read_to_end(&mut raw).map_err(|e| wrong(e.to_string()))?;
    postcard::from_bytes(&raw).map_err(|e| wrong(e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::ProvenanceKind;
    use crate::stats::RayKind;

    #[test]
    fn strips_are_whole_blocks_and_cover_every_row_once() {
        for (height, of) in [(27, 1), (27, 4), (360, 7), (8, 1), (1080, 135)] {
            let strips = (0..of).map(|number| Strip { number, of, is_source: false });
            let mut next = 0;
            for strip in strips {
                let rows = rows(strip, height);
                assert_eq!(rows.start, next);
                assert!(rows.end > rows.start && (rows.end % BLOCK == 0 || rows.end == height));
                next = rows.end;
            }
            assert_eq!(next, height);
        }
    }

    #[test]
    fn a_frame_joined_from_strips_equals_the_frame() {
        let (width, height) = (5, 20);
        let mut film = Film::new(width, height, true);
        let mut provenance = vec![Provenance::default(); film.rgb.len()];
        for (i, rgb) in film.rgb.iter_mut().enumerate() {
            *rgb = Rgb::new(i as f32, -0.0, f32::INFINITY);
            provenance[i].frame = i as u32;
            provenance[i].kind = ProvenanceKind::Later;
        }
        film.gbuffer.iter_mut().for_each(|g| g.depth[7] = 3.5);
        film.provenance = Some(provenance);
        film.samples = Some((0..film.rgb.len() as u32).collect());
        let rays = RayCounts::of(RayKind::Camera, 3);
        let rendered = |film: &Film| Rendered {
            film: film.clone(),
            rays,
            sources: TracedPoints::default(),
            reuse: ReuseCounts::default(),
            spreads: Vec::new(),
            pilots: Vec::new(),
        };
        let strip = |number| Strip { number, of: 3, is_source: true };
        let bytes = |number| encode(rendered(&film), strip(number)).expect("packed").into();
        let strips: Vec<Arc<[u8]>> = (0..3).map(bytes).collect();
        let joined = join(&strips, width, height).expect("joined");
        assert_eq!((&joined.film, joined.rays[RayKind::Camera]), (&film, 9));
        assert!(join(&strips[..2], width, height).is_err());
        assert!(join(&[vec![1, 2, 3].into()], width, height).is_err());
    }
}
