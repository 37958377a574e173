//! Pictures of the worst frames.

use super::record::Told;
use crate::judging::{Failure, Picture, Pictures, Verdict};
use crate::making::Label;
use image::{Rgb, RgbImage};
use std::path::Path;

/// Pixels of the picture a pixel of the frame.
const ENLARGED: u32 = 3;
/// White columns between panels.
const GAP: u32 = 6;
/// Errors are shown this many times as large, about grey.
const AMPLIFIED: f32 = 8.0;

/// Writes the frame that breaks the contract most: inferred, traced, truth, then the amplified errors of
/// both.
pub fn save(path: &Path, verdict: &Verdict) -> Result<(), Failure> {
    let worst = verdict.worst_tile().map(|(frame, _)| frame);
    let Some(p) = verdict.pictures.iter().find(|p| Some(p.frame) == worst) else { return Ok(()) };
    Ok(image_of(p).save(path)?)
}

fn image_of(p: &Pictures) -> RgbImage {
    let plain = |picture: &Picture| picture.clone();
    let error = |picture: &Picture| {
        let mut change = picture.change(&p.truth);
        change.steps.iter_mut().flatten().for_each(|x| *x = 128.0 + AMPLIFIED * *x);
        change
    };
    let panels = [
        plain(&p.inferred),
        plain(&p.traced),
        plain(&p.truth),
        error(&p.inferred),
        error(&p.traced),
    ];
    let (w, h) = (p.truth.width as u32 * ENLARGED, p.truth.height as u32 * ENLARGED);
    let mut image = RgbImage::from_pixel(panels.len() as u32 * (w + GAP) - GAP, h, Rgb([255; 3]));
    for (k, panel) in (0..).zip(&panels) {
        for (x, y) in (0..w).flat_map(|x| (0..h).map(move |y| (x, y))) {
            let index = (y / ENLARGED) as usize * panel.width + (x / ENLARGED) as usize;
            let pixel = panel.steps[index].map(|v| v.round() as u8);
            image.put_pixel(k * (w + GAP) + x, y, Rgb(pixel));
        }
    }
    image
}

/// Pictures of all scenes side by side, a small one each.
#[derive(Default)]
pub struct Sheet {
    pictures: Vec<Picture>,
}

/// Pictures in a row of the sheet.
const COLUMNS: usize = 5;

impl Sheet {
    /// Adds a scene's truth.
    pub fn add(&mut self, verdict: &Verdict) {
        self.pictures.extend(verdict.pictures.last().map(|p| p.truth.clone()));
    }

    /// Writes the sheet, in the order of the scenes.
    pub fn save(&self, path: &Path) -> Result<(), Failure> {
        let Some(first) = self.pictures.first() else { return Ok(()) };
        let (w, h) = (first.width + GAP as usize, first.height + GAP as usize);
        let rows = self.pictures.len().div_ceil(COLUMNS);
        let mut image =
            RgbImage::from_pixel((COLUMNS * w) as u32, (rows * h) as u32, Rgb([255; 3]));
        for (k, picture) in self.pictures.iter().enumerate() {
            for (i, pixel) in picture.steps.iter().enumerate() {
                let (x, y) = (i % picture.width, i / picture.width);
                let place = ((k % COLUMNS * w + x) as u32, (k / COLUMNS * h + y) as u32);
                image.put_pixel(place.0, place.1, Rgb(pixel.map(|v| v.round() as u8)));
            }
        }
        Ok(image.save(path)?)
    }
}

/// Prints where the pictures of the ten worst scenes are.
#[allow(clippy::print_stdout, reason = "a program for people")]
pub fn name_the_worst(told: &[Told], folder: &Path) {
    let mut order: Vec<&Told> = told.iter().collect();
    order.sort_by(|a, b| b.tile_excess().total_cmp(&a.tile_excess()));
    println!(
        "\nworst scenes: inferred | traced | truth | errors of inferred and of traced, 8 times"
    );
    for t in order.iter().take(10) {
        let Label { index, name, folder: own, .. } = &t.label;
        println!("{index} {name}: {}", folder.join(own).join("panels.png").display());
    }
}
