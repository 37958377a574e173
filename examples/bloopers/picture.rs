//! Pictures side by side.

use std::path::Path;
use tweenray::film::Film;
use tweenray::math::Rgb;
use tweenray::output::{WriteOptions, write_image};
use tweenray::scene::Settings;

/// Linear radiance, row 0 at the top.
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgb: Vec<Rgb>,
}

/// White columns between the two halves.
const GAP: u32 = 6;

/// Writes `left` and `right` as one PNG.
pub fn save_beside(path: &Path, left: &Picture, right: &Picture) {
    let width = left.width + GAP + right.width;
    let mut film = Film::new(width, left.height, false);
    film.rgb.fill(Rgb::ONE);
    for (picture, x0) in [(left, 0), (right, left.width + GAP)] {
        for (k, rgb) in picture.rgb.iter().enumerate() {
            let (x, y) = (k as u32 % picture.width, k as u32 / picture.width);
            let index = film.index(x0 + x, y);
            film.rgb[index] = *rgb;
        }
    }
    let options = WriteOptions::of(&Settings::default(), None);
    write_image(path, &film, &options).unwrap_or_else(|e| panic!("{e}"));
}
