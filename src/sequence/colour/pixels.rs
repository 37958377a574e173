//! Discoveries from a film's traced pixels, and inferred pixels put into a film.

use crate::film::{Film, Provenance, ProvenanceKind};
use crate::reuse::colour::{Entry, InferredColour, KnownColours};
use crate::scene::{Camera, Rect, Settings};
use crate::stats::ReuseCounts;

/// The colours of those pixels of the film that were traced: for each the pixel's index, its radiance and the distance
/// of its first hit from the camera.
pub(super) fn discoveries(
    frame: u32,
    film: &Film,
    inferred: &[Option<InferredColour>],
    camera: &Camera,
    settings: &Settings,
) -> KnownColours {
    let mut entries = Vec::new();
    for (x, y) in pixels_of(settings) {
        let index = film.index(x, y);
        if inferred[index].is_none() {
            let depth = film.gbuffer.as_ref().map_or(f32::NAN, |g| g.depth[index]);
            let middle = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
            // Rounding can put a hit at the eye itself a little behind it.
            let distance = (f64::from(depth) / middle.dot(camera.forward)).max(0.0) as f32;
            entries.push(Entry { pixel: index as u32, rgb: film.rgb[index], distance });
        }
    }
    KnownColours { frame, entries }
}

/// Puts inferred pixels into the film, and sets the provenance of each pixel.
pub(super) fn fill(
    film: &mut Film,
    frame: u32,
    inferred: &[Option<InferredColour>],
    settings: &Settings,
) -> ReuseCounts {
    let mut counts = ReuseCounts::default();
    let mut provenance = vec![Provenance::default(); film.rgb.len()];
    for (x, y) in pixels_of(settings) {
        let index = film.index(x, y);
        counts.direct += 1;
        if let Some(known) = &inferred[index] {
            film.rgb[index] = known.rgb;
            provenance[index] = known.provenance(frame);
            counts.direct_inferred += 1;
        } else {
            provenance[index].kind = ProvenanceKind::Traced;
        }
    }
    film.provenance = Some(provenance);
    counts
}

/// The pixels to render, row by row.
fn pixels_of(settings: &Settings) -> impl Iterator<Item = (u32, u32)> + use<> {
    let Rect { x0, y0, x1, y1 } = settings.region();
    (y0..y1).flat_map(move |y| (x0..x1).map(move |x| (x, y)))
}
