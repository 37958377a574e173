//! Strips of a rendered frame as bytes, and frames put together from strips.
//!
//! A strip is some whole rows of blocks, so its rays are the same as in a frame rendered at once. Its
//! bytes are those of [`postcard`], deflated; no file holds them, and the two ends are the same
//! program.

use super::shared::Strip;
use crate::error::{Error, Result};
use crate::film::{Film, GBuffer, Provenance};
use crate::inference::TracedPoints;
use crate::math::Rgb;
use crate::shade::{Progress, Rendered};
use crate::stats::{BadSamples, RayCounts, ReuseCounts};
use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::ops::Range;
use std::sync::Arc;

/// Edge of the blocks that frames are traced in, pixels.
const BLOCK: u32 = 8;

/// What a strip holds.
#[derive(Serialize, Deserialize)]
struct Content {
    rgb: Vec<Rgb>,
    gbuffer: Option<GBuffer>,
    provenance: Option<Vec<Provenance>>,
    bad: BadSamples,
    rays: RayCounts,
    reuse: ReuseCounts,
    sources: TracedPoints,
}

/// Hears of no tile: a strip is no share of this rank's frames.
pub struct NoProgress;

impl Progress for NoProgress {
    fn tile_done(&self, _share: f64, _rays: &RayCounts) {}
}

/// How many strips a frame of `height` rows has at most.
pub fn most(height: u32) -> u32 {
    height.div_ceil(BLOCK)
}

/// The pixel rows of a strip of a frame of `height` rows.
fn rows(strip: Strip, height: u32) -> Range<u32> {
    let blocks = u64::from(most(height));
    let edge = |n: u32| (blocks * u64::from(n) / u64::from(strip.of)) as u32 * BLOCK;
    edge(strip.number).min(height)..edge(strip.number + 1).min(height)
}

/// Which pixels of an image of `width` by `height` are in the strip.
pub fn mask(strip: Strip, width: u32, height: u32) -> Vec<bool> {
    let rows = rows(strip, height);
    (0..height).flat_map(|y| std::iter::repeat_n(rows.contains(&y), width as usize)).collect()
}

/// The bytes of what was rendered of a strip.
pub fn encode(rendered: Rendered, strip: Strip) -> Result<Vec<u8>> {
    let Rendered { film, rays, sources, reuse } = rendered;
    let Range { start, end } = rows(strip, film.height);
    let own = film.index(0, start)..film.index(0, end);
    let content = Content {
        rgb: film.rgb[own.clone()].to_vec(),
        gbuffer: film.gbuffer.as_ref().map(|g| g.part(own.clone())),
        provenance: film.provenance.as_ref().map(|s| s[own].to_vec()),
        bad: film.bad,
        rays,
        reuse,
        sources,
    };
    pack(&content)
}

/// A whole frame from all its strips, in order.
///
/// # Errors
/// They are no strips of a frame of this size.
pub fn join(strips: &[Arc<[u8]>], width: u32, height: u32) -> Result<Rendered> {
    let mut film = Film::new(width, height, false);
    film.rgb.clear();
    let (mut rays, mut reuse) = (RayCounts::default(), ReuseCounts::default());
    let mut sources = TracedPoints::default();
    for bytes in strips {
        let strip: Content = unpack(bytes)?;
        film.rgb.extend(strip.rgb);
        if let Some(part) = strip.gbuffer {
            film.gbuffer.get_or_insert_with(|| GBuffer::new(0)).append(part);
        }
        if let Some(part) = strip.provenance {
            film.provenance.get_or_insert_default().extend(part);
        }
        film.bad += strip.bad;
        rays += strip.rays;
        reuse += strip.reuse;
        sources.append(strip.sources);
    }
    if film.rgb.len() as u64 != u64::from(width) * u64::from(height) {
        return Err(Error::Failed("strips of another rank do not make a frame".into()));
    }
    Ok(Rendered { film, rays, sources, reuse })
}

/// `value` as bytes for another rank.
pub fn pack<T: Serialize>(value: &T) -> Result<Vec<u8>> {
    let raw = postcard::to_stdvec(value).map_err(|e| Error::Failed(format!("cannot pack: {e}")))?;
    let mut packed = Vec::new();
    let read = DeflateEncoder::new(&raw[..], Compression::fast()).read_to_end(&mut packed);
    read.map_err(|e| Error::Failed(format!("cannot pack: {e}")))?;
    Ok(packed)
}

/// What [`pack`] made bytes of.
pub fn unpack<T: for<'de> Deserialize<'de>>(bytes: &[u8]) -> Result<T> {
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
    fn a_frame_of_strips_is_the_frame() {
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
        let rays = RayCounts::of(RayKind::Camera, 3);
        let rendered = |film: &Film| Rendered {
            film: film.clone(),
            rays,
            sources: TracedPoints::default(),
            reuse: ReuseCounts::default(),
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
