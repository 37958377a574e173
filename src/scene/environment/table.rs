//! The radiance of an environment in cells of latitude and longitude, and samples of it.
//!
//! Takes any environment; gives one mean radiance for each cell, by which diffuse points are lit, and directions by
//! importance. Samples stand for what is brighter than the mean alone, since samples by the cosine find the rest as well
//! (MIS compensation; Karlík, Šik, Vévoda, Skřivan and Křivánek, 2019). All directions are in the environment's own axes.

use super::EnvironmentRadiance;
use crate::math::Vec2;
use crate::math::{DVec3, Rgb, bulk};
use crate::sampling::GridDistribution;
use crate::scene::{PRIMARIES, Texture, Wrap};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

/// Cells of environments without texels of their own: columns and rows.
const SMOOTH: [usize; 2] = [512, 256];
/// Fewest cells.
const LEAST: [usize; 2] = [256, 128];
/// Most cells: finer images light by means of several texels.
const MOST: [usize; 2] = [2048, 1024];
/// Colours that differ by no more than this share of their brightness count as one.
const SAME_COLOUR: f32 = 1e-4;

/// Radiance by direction, constant in each cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RadianceTable {
    width: usize,
    height: usize,
    /// Mean of each cell, row by row from the zenith down.
    #[serde(with = "bulk")]
    radiance: Vec<Rgb>,
    /// Cosine to the zenith of each edge between rows.
    #[serde(with = "bulk")]
    edges: Vec<f64>,
    /// Cells by what of their light is above the mean; `None` of a sky that is the same all round.
    distribution: Option<GridDistribution>,
    /// Mean brightness, all round.
    mean: f64,
    /// Brightness above the mean, over all solid angles.
    excess: f64,
    tints: Vec<Rgb>,
}

/// How bright a colour counts: blue as much as green, since each primary has a ratio of its own.
pub fn brightness(colour: Rgb) -> f64 {
    f64::from(colour.element_sum()) / 3.0
}

/// The direction at the share `u` of the circle of longitude, of cosine `y` to the zenith. Half of the circle is -z, a quarter
/// further +x.
fn direction(u: f64, y: f64) -> DVec3 {
    let level = ((1.0 - y) * (1.0 + y)).max(0.0).sqrt();
    let (sin, cos) = libm::sincos(TAU * (u - 0.5));
    DVec3::new(level * sin, y, -level * cos)
}

/// Where an image shows the unit direction `dir`: shares of its width from the left and of its height from the top.
pub fn image_place(dir: DVec3) -> [f64; 2] {
    let u = libm::atan2(dir.x, -dir.z) * (0.5 * FRAC_1_PI) + 0.5;
    [u, libm::acos(dir.y.clamp(-1.0, 1.0)) * FRAC_1_PI]
}

impl RadianceTable {
    pub(super) fn of(radiance: &EnvironmentRadiance, strength: f32) -> Self {
        let [width, height] = match radiance {
            EnvironmentRadiance::Image(texture) => {
                let level = &texture.levels()[level_for(texture)];
                [LEAST[0].max(level.width as usize), LEAST[1].max(level.height as usize)]
            }
            EnvironmentRadiance::Gradient(_) | EnvironmentRadiance::Daylight(_) => SMOOTH,
        };
        let edges: Vec<f64> =
            (0..=height).map(|row| libm::cos(PI * row as f64 / height as f64)).collect();
        let texels = (0..height).into_par_iter().flat_map_iter(|row| {
            // Two places each way: of texels as large as cells they have the exact mean.
            let rows = [0.25, 0.75].map(|at| {
                let y = edges[row] + (edges[row + 1] - edges[row]) * at;
                (y, (row as f64 + at) / height as f64)
            });
            (0..width).map(move |column| {
                let mut sum = Rgb::ZERO;
                for (y, v) in rows {
                    for at in [0.25, 0.75] {
                        let u = (column as f64 + at) / width as f64;
                        sum += match radiance {
                            EnvironmentRadiance::Image(texture) => bilinear(texture, [u, v]),
                            EnvironmentRadiance::Gradient(sky) => sky.radiance(direction(u, y)),
                            EnvironmentRadiance::Daylight(sky) => sky.radiance(direction(u, y)),
                        };
                    }
                }
                sum * (0.25 * strength)
            })
        });
        let radiance = texels.collect();
        let unfinished = Self {
            width,
            height,
            radiance,
            edges,
            distribution: None,
            mean: 0.0,
            excess: 0.0,
            tints: Vec::new(),
        };
        unfinished.with_importance()
    }

    fn with_importance(mut self) -> Self {
        let sum = |of: &dyn Fn(usize) -> f64| -> f64 { (0..self.radiance.len()).map(of).sum() };
        let bright = |cell: usize| brightness(self.radiance[cell]) * self.solid_angle(cell);
        let mean = sum(&bright) / (4.0 * PI);
        // Rounding alone is no contrast.
        let above = |colour: Rgb| {
            let above = brightness(colour) - mean;
            if above > 1e-5 * mean { above } else { 0.0 }
        };
        let weights: Vec<f64> = (0..self.radiance.len())
            .map(|cell| above(self.radiance[cell]) * self.solid_angle(cell))
            .collect();
        let distribution = GridDistribution::new(self.width, &weights);
        self.excess = weights.iter().sum();
        (self.mean, self.distribution) = (mean, distribution);
        self.tints = tints(&self.radiance);
        self
    }

    /// Solid angle of a cell.
    pub(crate) fn solid_angle(&self, cell: usize) -> f64 {
        let row = cell / self.width;
        TAU / self.width as f64 * (self.edges[row] - self.edges[row + 1])
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Cosine to the zenith of each edge between rows, from the zenith down.
    pub(super) fn edges(&self) -> &[f64] {
        &self.edges
    }

    /// The cell that the unit direction `dir` lies in.
    pub fn cell(&self, dir: DVec3) -> usize {
        let [u, v] = image_place(dir);
        let column = ((u * self.width as f64) as usize).min(self.width - 1);
        let row = ((v * self.height as f64) as usize).min(self.height - 1);
        row * self.width + column
    }

    /// Mean radiance of a cell.
    pub fn radiance(&self, cell: usize) -> Rgb {
        self.radiance[cell]
    }

    /// Density of [`sample`](Self::sample) in a cell, per steradian.
    pub fn pdf(&self, cell: usize) -> f64 {
        match self.distribution {
            Some(_) => self.above_mean(cell) / self.excess,
            None => 0.0,
        }
    }

    /// By how much a cell is brighter than the mean.
    pub(super) fn above_mean(&self, cell: usize) -> f64 {
        let above = brightness(self.radiance[cell]) - self.mean;
        if above > 1e-5 * self.mean { above } else { 0.0 }
    }

    /// Whether any cell is brighter than the mean.
    pub fn has_contrast(&self) -> bool {
        self.distribution.is_some()
    }

    /// A unit direction for `u` in the unit square, by importance, and its cell; even over the solid angle of the cell.
    /// `None` of a sky that is the same all round.
    pub fn sample(&self, u: [f64; 2]) -> Option<(DVec3, usize)> {
        let (cell, [x, y]) = self.distribution.as_ref()?.sample(u);
        let (row, column) = (cell / self.width, cell % self.width);
        let cos = self.edges[row] + (self.edges[row + 1] - self.edges[row]) * y;
        Some((direction((column as f64 + x) / self.width as f64, cos), cell))
    }

    /// The colours that make up the light of every direction: one, where all have the same, else the three primaries.
    pub fn tints(&self) -> &[Rgb] {
        &self.tints
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        self.mean == 0.0
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> u64 {
        let own = size_of_val(&self.radiance[..]) + size_of_val(&self.edges[..]);
        own as u64 + self.distribution.as_ref().map_or(0, GridDistribution::bytes)
    }
}

/// The colour of all `cells` if it is one, else the three primaries.
fn tints(cells: &[Rgb]) -> Vec<Rgb> {
    let sum: DVec3 = cells.iter().map(|cell| cell.as_dvec3()).sum();
    let colour = sum.as_vec3() / (sum.max_element() as f32).max(f32::MIN_POSITIVE);
    let is_same = |cell: &Rgb| {
        let part = cell.max_element();
        (*cell - colour * part).abs().max_element() <= SAME_COLOUR * part
    };
    match cells.iter().all(is_same) {
        true => vec![colour],
        false => PRIMARIES.to_vec(),
    }
}

/// The first mip level that has no more texels than cells can be.
fn level_for(texture: &Texture) -> usize {
    let fits = |width: u32, height: u32| width as usize <= MOST[0] && height as usize <= MOST[1];
    let levels = texture.levels();
    levels.iter().position(|level| fits(level.width, level.height)).unwrap_or(levels.len() - 1)
}

/// What the image shows at a place ([`image_place`]), in the level that cells are made of.
fn bilinear(texture: &Texture, [u, v]: [f64; 2]) -> Rgb {
    let level = &texture.levels()[level_for(texture)];
    let place = Vec2::new(u as f32, v as f32);
    let (x0, x1, fx) = Wrap::Repeat.two_texels(place.x, level.width);
    let (y0, y1, fy) = Wrap::Clamp.two_texels(place.y, level.height);
    let [a, b, c, d] = level.four([x0, x1], [y0, y1]);
    a.lerp(b, fx).lerp(c.lerp(d, fx), fy)
}
