//! Pictures in display steps.

use super::Failure;
use std::path::Path;
use tweenray::math::Rgb;
use tweenray::output::{Display, read_image};

/// Side of a tile, pixels.
pub const SIDE: usize = 32;

/// A frame as a display shows it: 0 to 255 a channel, not rounded.
#[derive(Clone)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub steps: Vec<[f32; 3]>,
}

impl Picture {
    /// Reads an exr file as `display` shows it.
    ///
    /// # Errors
    /// Where it cannot be read.
    pub fn read(path: &Path, display: &Display) -> Result<Self, Failure> {
        let image = read_image(path)?;
        let code = |c: &Rgb| display.code(*c).map(|x| (255.0 * x) as f32);
        Ok(Self {
            width: image.width as usize,
            height: image.height as usize,
            steps: image.rgb.iter().map(code).collect(),
        })
    }

    /// The mean of pictures of one size.
    pub fn mean(pictures: &[Self]) -> Self {
        let mut sum = pictures[0].clone();
        for (i, pixel) in sum.steps.iter_mut().enumerate() {
            for (k, channel) in pixel.iter_mut().enumerate() {
                let all: f32 = pictures.iter().map(|p| p.steps[i][k]).sum();
                *channel = all / pictures.len() as f32;
            }
        }
        sum
    }

    /// Each pixel's squared difference to `truth`, the mean of its channels.
    pub fn squares(&self, truth: &Self) -> Vec<f64> {
        let of = |(a, b): (&[f32; 3], &[f32; 3])| {
            (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>() / 3.0
        };
        self.steps.iter().zip(&truth.steps).map(of).collect()
    }

    /// The change from `before`, pixel by pixel.
    pub fn change(&self, before: &Self) -> Self {
        let minus = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|k| a[k] - b[k]);
        let steps = self.steps.iter().zip(&before.steps).map(minus).collect();
        Self { width: self.width, height: self.height, steps }
    }

    /// The whole tiles: column and row of each, and its pixels' indices.
    pub fn tiles(&self) -> impl Iterator<Item = ([usize; 2], Vec<usize>)> {
        let (width, columns, rows) = (self.width, self.width / SIDE, self.height / SIDE);
        (0..columns * rows).map(move |i| {
            let (x, y) = (i % columns, i / columns);
            let pixels = (0..SIDE * SIDE)
                .map(|k| (y * SIDE + k / SIDE) * width + x * SIDE + k % SIDE)
                .collect();
            ([x, y], pixels)
        })
    }
}
