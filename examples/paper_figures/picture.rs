//! Panels in a grid, and what is painted over them.

use std::path::Path;
use tweenray::film::{Film, Provenance, ProvenanceKind};
use tweenray::math::Rgb;
use tweenray::output::{WriteOptions, write_image};
use tweenray::scene::Settings;

/// White pixels between panels.
const GAP: u32 = 6;
const RED: Rgb = Rgb::new(0.6, 0.0, 0.0);
const PINK: Rgb = Rgb::new(1.0, 0.4, 0.8);

/// Writes panels of one size as a grid of `columns`, row by row.
pub fn save_grid(path: &Path, columns: u32, panels: &[Film]) {
    let (w, h) = (panels[0].width, panels[0].height);
    let rows = (panels.len() as u32).div_ceil(columns);
    let mut grid = Film::new(columns * (w + GAP) - GAP, rows * (h + GAP) - GAP, false);
    grid.rgb.fill(Rgb::ONE);
    for (k, panel) in (0..).zip(panels) {
        let (x0, y0) = (k % columns * (w + GAP), k / columns * (h + GAP));
        for y in 0..h {
            for x in 0..w {
                let index = grid.index(x0 + x, y0 + y);
                grid.rgb[index] = panel.rgb[panel.index(x, y)];
            }
        }
    }
    let options = WriteOptions::of(&Settings::default(), None);
    write_image(path, &grid, &options).unwrap_or_else(|e| panic!("{e}"));
}

/// What a pixel is painted with, if with anything.
pub type Paint = Option<Rgb>;

/// The film in grey under a coat of paint, where it is painted.
pub fn painted(film: &Film, paint: impl Fn(usize) -> Paint) -> Film {
    let mut out = film.clone();
    for (i, c) in out.rgb.iter_mut().enumerate() {
        if let Some(paint) = paint(i) {
            *c = Rgb::splat(c.min(Rgb::ONE).element_sum() / 3.0) * 0.25 + paint * 0.75;
        }
    }
    out
}

/// Figure 6's colours: re-traced pink, taken from the cache red.
pub fn hit_or_traced(source: &Provenance) -> Paint {
    match source.kind {
        ProvenanceKind::Background => None,
        ProvenanceKind::Traced => Some(PINK),
        ProvenanceKind::Earlier | ProvenanceKind::Later | ProvenanceKind::Both => Some(RED),
    }
}

/// Figure 3's: how far two distances are apart, as a share of the nearer one.
pub fn by_difference(share: f32) -> Paint {
    Some(match share {
        s if s <= 0.05 => RED,
        s if s <= 0.2 => Rgb::new(0.0, 0.5, 0.0),
        _ => Rgb::new(0.0, 0.05, 0.7),
    })
}
