//! Separable convolution of single-channel images with edges repeated outwards.

use rayon::prelude::*;

/// One channel of an image, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` values.
    pub data: Vec<f32>,
}

impl Plane {
    /// The plane with `f` applied to every index.
    pub fn from_fn(width: usize, height: usize, f: impl Fn(usize) -> f32 + Sync) -> Self {
        let data = (0..width * height).into_par_iter().map(&f).collect();
        Self { width, height, data }
    }

    /// Correlates the plane with `kernel_x` along rows and `kernel_y` along columns. Both have an
    /// odd number of weights; the middle one is the pixel's own. The borders' values go on
    /// outwards.
    pub fn filtered(&self, kernel_x: &[f32], kernel_y: &[f32]) -> Self {
        self.filtered_x(kernel_x).filtered_y(kernel_y)
    }

    /// The pass along rows of [`Plane::filtered`].
    pub fn filtered_x(&self, kernel: &[f32]) -> Self {
        let (width, radius) = (self.width, kernel.len() / 2);
        let mut out = self.blank();
        let rows = out.data.par_chunks_mut(width).zip(self.data.par_chunks(width));
        rows.for_each_init(
            || vec![0f32; width + 2 * radius],
            |padded, (out, row)| {
                padded[..radius].fill(row[0]);
                padded[radius..radius + width].copy_from_slice(row);
                padded[radius + width..].fill(row[width - 1]);
                for (k, weight) in kernel.iter().enumerate() {
                    add_scaled(out, *weight, &padded[k..k + width]);
                }
            },
        );
        out
    }

    /// The pass along columns of [`Plane::filtered`].
    pub fn filtered_y(&self, kernel: &[f32]) -> Self {
        let (width, radius) = (self.width, kernel.len() / 2);
        let mut out = self.blank();
        out.data.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            for (k, weight) in kernel.iter().enumerate() {
                let source = (y + k).saturating_sub(radius).min(self.height - 1);
                add_scaled(out, *weight, &self.data[source * width..][..width]);
            }
        });
        out
    }

    fn blank(&self) -> Self {
        Self { data: vec![0.0; self.data.len()], ..*self }
    }
}

/// `out += weight · row`, element by element.
fn add_scaled(out: &mut [f32], weight: f32, row: &[f32]) {
    for (o, r) in out.iter_mut().zip(row) {
        *o += weight * r;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_sum_written_out() {
        let plane = Plane::from_fn(9, 7, |i| ((i * 37) % 11) as f32);
        let (kx, ky) = ([0.5, -1.0, 2.0, 0.25, 3.0], [1.0, -2.0, 0.5]);
        let got = plane.filtered(&kx, &ky);
        for y in 0..7i32 {
            for x in 0..9i32 {
                let mut sum = 0.0;
                for (j, wy) in ky.iter().enumerate() {
                    for (i, wx) in kx.iter().enumerate() {
                        let xx = (x + i as i32 - 2).clamp(0, 8);
                        let yy = (y + j as i32 - 1).clamp(0, 6);
                        sum += wx * wy * plane.data[(yy * 9 + xx) as usize];
                    }
                }
                assert!((got.data[(y * 9 + x) as usize] - sum).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_kernel_wider_than_the_plane_is_fine() {
        let plane = Plane::from_fn(2, 1, |_| 3.0);
        let kernel = [0.2; 5];
        for v in plane.filtered(&kernel, &kernel).data {
            assert!((v - 3.0).abs() < 1e-5);
        }
    }
}
