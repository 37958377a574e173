//! The mean of what an image shows at points side by side.

use super::{TextureLevel, Wrap};
use crate::math::Vec2;
use wide::f32x4;

/// Points of an image side by side.
#[derive(Debug, Clone, Copy)]
pub struct PointRow {
    /// The image's coordinates of the first.
    pub first: Vec2,
    /// From each to the next.
    pub step: Vec2,
    /// How many.
    pub count: u32,
}

/// Four points in one mip level.
struct Four<'l, T> {
    texels: &'l [T],
    /// Texels of a row.
    width: usize,
    /// Rows of the upper and of the lower texels around each point.
    rows: [[i32; 4]; 2],
    /// Columns of the left and of the right ones.
    columns: [[i32; 4]; 2],
    /// How far each point is from the left and from the upper ones.
    apart: [[f32; 4]; 2],
}

impl PointRow {
    /// The mean of what a mip level and, by `fraction`, the next one show between the middles of four texels, of which
    /// `decode` gives red, green and blue.
    pub(super) fn mean<T>(
        self,
        levels: [(&TextureLevel, &[T]); 2],
        decode: impl Fn(&T) -> f32x4 + Copy,
        wrap: [Wrap; 2],
        fraction: f32,
    ) -> f32x4 {
        // Lest both shares, rounded, are more or less than 1 together: what is 1 in both levels is exactly 1.
        let fraction = 1.0 - (1.0 - fraction);
        let mut sum = f32x4::ZERO;
        for from in (0..self.count).step_by(4) {
            let number = f32x4::from([0.0, 1.0, 2.0, 3.0]) + from as f32;
            let [x, y] = [(self.first.x, self.step.x), (self.first.y, self.step.y)]
                .map(|(first, step)| number * step + first);
            // Down the image's columns from the top.
            let inside = [wrap[0].inside(x), wrap[1].inside(1.0 - y)];
            let fine = Four::of(levels[0], wrap, inside);
            let lanes = 0..4.min(self.count - from) as usize;
            if fraction == 0.0 {
                lanes.for_each(|lane| sum += fine.bilinear(lane, decode));
            } else {
                let coarse = Four::of(levels[1], wrap, inside);
                for lane in lanes {
                    let (fine, coarse) =
                        (fine.bilinear(lane, decode), coarse.bilinear(lane, decode));
                    sum += lerp(fine, coarse, fraction);
                }
            }
        }
        sum / self.count as f32
    }
}

impl<'l, T> Four<'l, T> {
    #[inline(always)] // Up to 8 times in a lookup.
    fn of(
        (level, texels): (&'l TextureLevel, &'l [T]),
        wrap: [Wrap; 2],
        [x, y]: [f32x4; 2],
    ) -> Self {
        let columns = wrap[0].between(x, level.width);
        let rows = wrap[1].between(y, level.height);
        Self {
            texels,
            width: level.width as usize,
            rows: [rows.first, rows.second],
            columns: [columns.first, columns.second],
            apart: [columns.apart, rows.apart],
        }
    }

    #[inline(always)] // Up to 32 times in a lookup.
    fn bilinear(&self, lane: usize, decode: impl Fn(&T) -> f32x4) -> f32x4 {
        let Self { texels, width, columns: [left, right], rows: [upper, lower], apart: [x, y] } =
            self;
        let (left, right) = (left[lane] as usize, right[lane] as usize);
        let across = |row: i32| {
            let start = row as usize * width;
            lerp(decode(&texels[start + left]), decode(&texels[start + right]), x[lane])
        };
        lerp(across(upper[lane]), across(lower[lane]), y[lane])
    }
}

#[inline(always)] // Up to 112 times in a lookup.
fn lerp(a: f32x4, b: f32x4, share: f32) -> f32x4 {
    a * (1.0 - share) + b * share
}
