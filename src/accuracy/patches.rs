//! Patches of frames at their full size, from which the errors of whole frames are estimated.
//!
//! A smaller picture of a frame would not do: a larger part of it is edges.

use super::context::TrialContext;
use super::draw::{DrawSeed, draw};
use super::effort::Effort;
use super::errors::displayed_rgb;
use crate::error::{Error, Result};
use crate::film::{Encoding, Image};
use crate::math::Rgb;
use crate::sampling::mix;
use crate::scene::{Policy, Settings};
use crate::shade::Renderer;
use rayon::prelude::*;

/// Largest ratio of the edges of a frame and of the picture that its contrast is measured on.
const SCALE: f64 = 4.0;

/// Square patches of some frames, with their weights.
#[derive(Debug, Clone)]
pub struct Patches {
    edge: u32,
    frames: Vec<FramePatches>,
}

/// A frame's patches.
#[derive(Debug, Clone, Default)]
struct FramePatches {
    frame: u32,
    corners: Vec<(u32, u32)>,
    /// Weight of each patch in the frame's mean.
    weights: Vec<f64>,
    /// Probability of each patch not to be drawn.
    unsure: Vec<f64>,
}

/// Contrast of a picture: for each pixel the square of the largest difference of any channel from any of its
/// eight neighbours.
#[derive(Debug, Clone, PartialEq)]
struct Contrast {
    width: u32,
    height: u32,
    each: Vec<f32>,
}

/// For each frame the images of its patches, as displayed.
pub type PatchImages = Vec<Vec<Image>>;

/// `seen` rounded to 8 bits.
pub fn rounded(seen: &PatchImages) -> PatchImages {
    let mut seen = seen.clone();
    for rgb in seen.iter_mut().flatten().flat_map(|image| &mut image.rgb) {
        *rgb = (*rgb * 255.0).round() / 255.0;
    }
    seen
}

impl Patches {
    /// Patches of `edge` x `edge` pixels of each of `frames`, with about `pixels` pixels of a frame in all:
    /// one at a random place in each cell of a grid.
    pub fn grid(settings: &Settings, frames: &[u32], edge: u32, pixels: u32, seed: u64) -> Self {
        let edge = edge.min(settings.width).min(settings.height);
        let draw = |frame: &u32| {
            let corners = places(settings, edge, pixels, mix(seed ^ u64::from(*frame)));
            let weights = vec![1.0 / corners.len() as f64; corners.len()];
            let unsure = vec![1.0; corners.len()];
            FramePatches { frame: *frame, corners, weights, unsure }
        };
        Self { edge, frames: frames.iter().map(draw).collect() }
    }

    /// Single pixels of each of `frames`, as many as `effort` says. Most of a frame's error lies in a few
    /// pixels at edges of bright things, so pixels are drawn by their contrast in a picture of one sample
    /// a pixel. The picture is smaller than a large frame, and larger than a small one, in which specks
    /// would fall between the samples.
    ///
    /// # Errors
    /// As [`TrialContext::trace`].
    pub fn by_contrast(
        context: &TrialContext,
        frames: &[u32],
        effort: Effort,
        seed: u64,
    ) -> Result<Self> {
        let mut settings = one_sample(context.base);
        let scale = effort.picture / (f64::from(settings.width) * f64::from(settings.height));
        let (shrink, enlarge) = match scale < 1.0 {
            true => ((1.0 / scale).sqrt().floor().min(SCALE) as u32, 1),
            false => (1, scale.sqrt().round().min(SCALE) as u32),
        };
        let edge = |length: u32| (length / shrink).max(1) * enlarge;
        (settings.width, settings.height) = (edge(settings.width), edge(settings.height));
        let picture = |frame| {
            let image = context.trace(&settings, context.intersector, frame)?.0;
            Ok(Contrast::of(&image).reduced(enlarge))
        };
        Self::drawn(context.base, frames, &picture, effort.pixels, seed)
    }

    /// `count` single pixels of each of `frames`, drawn by the contrast of the frame that `image` gives.
    ///
    /// # Errors
    /// Any that `image` gives.
    pub fn by_contrast_of(
        settings: &Settings,
        frames: &[u32],
        image: &dyn Fn(u32) -> Result<Image>,
        count: u32,
        seed: u64,
    ) -> Result<Self> {
        let contrast = |frame| Ok(Contrast::of(&image(frame)?));
        Self::drawn(settings, frames, &contrast, count, seed)
    }

    fn drawn(
        settings: &Settings,
        frames: &[u32],
        contrast: &dyn Fn(u32) -> Result<Contrast>,
        count: u32,
        seed: u64,
    ) -> Result<Self> {
        let (width, height) = (settings.width, settings.height);
        let draw = |frame: &u32| {
            let contrast = contrast(*frame)?;
            let seed = DrawSeed { seed, frame: *frame, number: 0 };
            let among = 0..contrast.each.len() as u32;
            let mut drawn = FramePatches { frame: *frame, ..FramePatches::default() };
            for d in draw(&contrast.each, among, f64::from(count), seed) {
                // One pixel of those that a pixel of the small picture stands for.
                let random = mix(mix(seed.seed ^ u64::from(*frame)) ^ u64::from(d.index));
                let within = |k: u32, of: u32, length: u32, random: u64| {
                    let at = |k: u32| (u64::from(length) * u64::from(k) / u64::from(of)) as u32;
                    let (from, to) = (at(k), at(k + 1).max(at(k) + 1));
                    (from + (random % u64::from(to - from)) as u32, to - from)
                };
                let (column, row) = (d.index % contrast.width, d.index / contrast.width);
                let (x, columns) = within(column, contrast.width, width, random);
                let (y, rows) = within(row, contrast.height, height, random >> 32);
                let stands_for = f64::from(columns * rows);
                drawn.corners.push((x, y));
                drawn.weights.push(d.weight * stands_for / (f64::from(width) * f64::from(height)));
                drawn.unsure.push((1.0 - 1.0 / (d.weight * stands_for)).max(0.0));
            }
            Ok(drawn)
        };
        Ok(Self { edge: 1, frames: frames.iter().map(draw).collect::<Result<_>>()? })
    }

    /// For each frame the weighted mean of a figure of its patches, and its standard error. A patch that
    /// was sure to be drawn adds nothing to that (Horvitz and Thompson, 1952).
    pub fn means(&self, seen: &[Vec<f64>]) -> Vec<(f64, f64)> {
        let of = |(drawn, figures): (&FramePatches, &Vec<f64>)| {
            let parts: Vec<f64> = drawn.weights.iter().zip(figures).map(|(w, x)| w * x).collect();
            let sum: f64 = parts.iter().sum();
            let open = || parts.iter().zip(&drawn.unsure);
            let (all, each) = open().fold((0.0, 0.0), |(n, s), (x, u)| (n + u, s + u * x));
            let middle = each / f64::max(all, 1e-300);
            let variance: f64 = open().map(|(x, u)| u * (x - middle) * (x - middle)).sum();
            (sum, variance.sqrt())
        };
        self.frames.iter().zip(seen).map(of).collect()
    }

    /// Traces the patches under `settings`.
    ///
    /// # Errors
    /// [`Error::Stopped`]; errors of the camera's move.
    pub fn trace(&self, context: &TrialContext, settings: &Settings) -> Result<PatchImages> {
        let renderer = Renderer::new(context.scene, settings, context.intersector);
        let one = |FramePatches { frame, corners, .. }: &FramePatches| {
            let camera = context.shot.camera(*frame, settings.width, settings.height)?;
            let places: Vec<(u32, u32)> = corners.iter().flat_map(|c| self.pixels(*c)).collect();
            let trace = || renderer.render_scattered(&camera, *frame, &places, context.stop);
            let (rgb, _) = context.pool.install(trace).ok_or(Error::Stopped)?;
            Ok(self.cut(&displayed_rgb(&rgb, settings)))
        };
        self.frames.iter().map(one).collect()
    }

    /// The patches, cut from the whole frames that `image` gives as displayed.
    ///
    /// # Errors
    /// Any that `image` gives.
    pub fn of_images(&self, image: &dyn Fn(u32) -> Result<Image>) -> Result<PatchImages> {
        let one = |FramePatches { frame, corners, .. }: &FramePatches| {
            let image = image(*frame)?;
            let at = |(x, y): (u32, u32)| image.rgb[(y * image.width + x) as usize];
            let rgb: Vec<Rgb> = corners.iter().flat_map(|c| self.pixels(*c)).map(at).collect();
            Ok(self.cut(&rgb))
        };
        self.frames.iter().map(one).collect()
    }

    fn pixels(&self, (x, y): (u32, u32)) -> impl Iterator<Item = (u32, u32)> + use<> {
        let edge = self.edge;
        (0..edge * edge).map(move |i| (x + i % edge, y + i / edge))
    }

    fn cut(&self, rgb: &[Rgb]) -> Vec<Image> {
        let (width, height) = (self.edge, self.edge);
        let image =
            |rgb: &[Rgb]| Image { width, height, rgb: rgb.to_vec(), encoding: Encoding::Srgb };
        rgb.chunks((self.edge * self.edge) as usize).map(image).collect()
    }
}

impl Contrast {
    fn of(image: &Image) -> Self {
        let (width, height) = (image.width as usize, image.height as usize);
        let of = |i: usize| {
            let (x, y) = (i % width, i / width);
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let near = rows.flat_map(|row| &image.rgb[row * width..][columns.clone()]);
            let apart = near.map(|c| (*c - image.rgb[i]).abs().max_element()).fold(0.0, f32::max);
            apart * apart
        };
        let each = (0..image.rgb.len()).into_par_iter().map(of).collect();
        Self { width: image.width, height: image.height, each }
    }

    /// The means over squares of `edge` x `edge` pixels; `edge` divides width and height.
    fn reduced(&self, edge: u32) -> Self {
        if edge == 1 {
            return self.clone();
        }
        let (width, height) = (self.width / edge, self.height / edge);
        let mean = |i: u32| {
            let (x, y) = (i % width * edge, i / width * edge);
            let row = |y: u32| {
                let from = (y * self.width + x) as usize;
                self.each[from..from + edge as usize].iter().sum::<f32>()
            };
            (y..y + edge).map(row).sum::<f32>() / (edge * edge) as f32
        };
        Self { width, height, each: (0..width * height).map(mean).collect() }
    }
}

fn places(settings: &Settings, edge: u32, pixels: u32, seed: u64) -> Vec<(u32, u32)> {
    let (width, height) = (settings.width, settings.height);
    let wanted = f64::from(pixels) / f64::from(edge * edge);
    let columns = (wanted * f64::from(width) / f64::from(height)).sqrt().round() as u32;
    let columns = columns.clamp(1, width / edge);
    let rows = ((wanted / f64::from(columns)).round() as u32).clamp(1, height / edge);
    let place = |k: u32, cells: u32, length: u32, random: u64| {
        let (from, to) = (length * k / cells, length * (k + 1) / cells);
        from + (random % u64::from(to - from - edge + 1)) as u32
    };
    let cells = (0..rows * columns).map(|cell| {
        let random = mix(seed ^ u64::from(cell));
        let x = place(cell % columns, columns, width, random);
        (x, place(cell / columns, rows, height, random >> 32))
    });
    cells.collect()
}

/// `base` with one sample of everything, and every frame traced.
pub(super) fn one_sample(base: &Settings) -> Settings {
    let mut settings = base.clone();
    (settings.spp, settings.shadow_samples, settings.sky_samples) = (1, 1, 1);
    settings.reuse.policy = Policy::Off;
    settings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contrast_is_at_an_edge_and_on_both_its_sides() {
        let rgb = (0..20).map(|i| Rgb::splat(if i % 5 < 2 { 0.0 } else { 0.5 })).collect();
        let image = Image { width: 5, height: 4, rgb, encoding: Encoding::Srgb };
        for (i, contrast) in Contrast::of(&image).each.into_iter().enumerate() {
            assert_eq!(contrast, if [1, 2].contains(&(i % 5)) { 0.25 } else { 0.0 }, "{i}");
        }
    }

    #[test]
    fn a_larger_picture_is_reduced_to_means() {
        let each = (0..24).map(|i| if i == 9 { 1.0 } else { 0.0 }).collect();
        let reduced = Contrast { width: 6, height: 4, each }.reduced(2);
        // Pixel 9 lies in column 3 and row 1: the second square of the first row.
        let moved = Contrast { width: 3, height: 2, each: vec![0.0, 0.25, 0.0, 0.0, 0.0, 0.0] };
        assert_eq!(reduced, moved);
    }

    #[test]
    fn patches_lie_in_the_picture_apart_and_are_as_many_as_wanted() {
        for (width, height, edge, pixels) in
            [(640, 360, 1, 3000), (37, 91, 8, 2000), (16, 9, 1, 3000), (5, 7, 64, 100)]
        {
            let settings = Settings { width, height, ..Settings::default() };
            let patches = Patches::grid(&settings, &[1, 9], edge, pixels, 3);
            let FramePatches { corners, weights, .. } = &patches.frames[0];
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let all = || corners.iter().flat_map(|c| patches.pixels(*c));
            assert!(all().all(|(x, y)| x < width && y < height), "{width}x{height}");
            let distinct: std::collections::BTreeSet<_> = all().collect();
            assert_eq!(distinct.len(), all().count(), "{width}x{height}");
            let most = f64::from(pixels.min(width * height));
            assert!(distinct.len() as f64 > 0.4 * most, "{} of {most}", distinct.len());
        }
    }
}
