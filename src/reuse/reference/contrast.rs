//! How ratios change from pixel to pixel of a frame. Each pass over a row compares all its pixels
//! with the pixels at one fixed offset, so that the compiler can use vector instructions: products and sums are not fused, so
//! every processor finds the same.

use super::{Contrast, NONE};
use crate::inference::{NO_LIGHT, SAME_SURFACE, SurfacePoint};
use pulp::Arch;
use rayon::prelude::*;

/// Largest distance, in pixels, of the neighbours that a pixel is compared with.
const REACH: usize = 2;
/// Number of neighbours in the 3 x 3 pixels around one.
const NEAR: usize = 8;
/// Number of neighbours in the 5 x 5 pixels around one.
const ALL: usize = 24;
/// Offsets of the neighbours, row by row, those of the 3 x 3 pixels first; opposite neighbours are as far from
/// either end of their group.
const AROUND: [[usize; 2]; ALL] = around();

/// Directions at right angles to one another: along rows and columns, and both diagonals. A bit for each of the first
/// four of [`AROUND`].
const CROSSES: [u32; 2] = [0b1010, 0b0101];
/// For each of the eight nearest neighbours the one behind it, twice as far away.
const BEHIND: [usize; NEAR] = behind();

const fn behind() -> [usize; NEAR] {
    let mut all = [0; NEAR];
    let mut at = 0;
    while at < NEAR * ALL {
        let (k, other) = (at / ALL, at % ALL);
        let [[x, y], [u, v]] = [AROUND[k], AROUND[other]];
        if 2 * x == u + REACH && 2 * y == v + REACH {
            all[k] = other;
        }
        at += 1;
    }
    all
}

/// Columns and rows from the upper left neighbour, at [0, 0], to each neighbour.
const fn around() -> [[usize; 2]; ALL] {
    let mut places = [[0; 2]; ALL];
    let (mut near, mut wide) = (0, NEAR);
    let mut at = 0;
    while at <= ALL {
        let (x, y) = (at % (2 * REACH + 1), at / (2 * REACH + 1));
        let is_near = x.abs_diff(REACH) <= 1 && y.abs_diff(REACH) <= 1;
        if x == REACH && y == REACH {
        } else if is_near {
            places[near] = [x, y];
            near += 1;
        } else {
            places[wide] = [x, y];
            wide += 1;
        }
        at += 1;
    }
    places
}

/// A figure for each pixel, with a margin of unknown figures.
struct Image<T> {
    stride: usize,
    values: Vec<T>,
}

impl<T: Copy + Sync> Image<T> {
    /// The figure `of(i)` for pixel `i` of `pixels`; `none` where that is `None`, and in the margin.
    fn of(pixels: usize, width: usize, none: T, of: impl Fn(usize) -> Option<T>) -> Self {
        let stride = width + 2 * REACH;
        let mut values = vec![none; stride * (pixels / width + 2 * REACH)];
        for y in 0..pixels / width {
            let row = &mut values[(y + REACH) * stride + REACH..][..width];
            row.iter_mut().zip(y * width..).for_each(|(out, i)| *out = of(i).unwrap_or(none));
        }
        Self { stride, values }
    }

    /// The figures at some pixels, row by row, of an image of this size; `none` elsewhere.
    fn of_some(
        [width, height]: [usize; 2],
        none: T,
        some: impl Iterator<Item = (usize, T)>,
    ) -> Self {
        let stride = width + 2 * REACH;
        let mut values = vec![none; stride * (height + 2 * REACH)];
        some.for_each(|(i, value)| {
            values[(i / width + REACH) * stride + REACH + i % width] = value;
        });
        Self { stride, values }
    }

    /// Row `y` of the image, shifted by an offset of [`AROUND`].
    fn row(&self, y: usize, [right, down]: [usize; 2]) -> &[T] {
        let width = self.stride - 2 * REACH;
        &self.values[(y + down) * self.stride + right..][..width]
    }

    fn own(&self, y: usize) -> &[T] {
        self.row(y, [REACH; 2])
    }
}

/// For each of `points` the contrasts in each of `channels`. Only the points that pixels see directly have known
/// ones; `slots` has their numbers, in rows of `width` pixels. `lights` has the light of each ratio; none where each
/// channel has the same light everywhere.
pub(super) fn contrasts(
    points: &[SurfacePoint],
    (ratios, lights): (&[f32], &[u32]),
    slots: &[u32],
    (width, channels): (usize, usize),
) -> Vec<Contrast> {
    let mut contrasts = vec![Contrast::UNKNOWN; ratios.len()];
    if points.is_empty() {
        return contrasts;
    }
    let own = |i: usize| (slots[i] != NONE).then_some(slots[i] as usize);
    let same = same_surface(points, slots.len(), width, own);
    let mut buffers = Buffers::default();
    if lights.is_empty() {
        let all = Part { first: [0, 0], size: [width, slots.len() / width] };
        for channel in 0..channels {
            let ratio = |i| own(i).map(|own| ratios[own * channels + channel]);
            let known = Image::of(slots.len(), width, f32::NAN, ratio);
            buffers.fill(&known, (&same, width), &all);
            for (i, own) in (0..slots.len()).filter_map(|i| Some((i, own(i)?))) {
                contrasts[own * channels + channel] = buffers.at(i);
            }
        }
        return contrasts;
    }
    let shines = |at: &usize| lights[*at] != NO_LIGHT && !ratios[*at].is_nan();
    let of_pixel = |i: usize| own(i).map(|own| (own * channels..(own + 1) * channels, i));
    let all = (0..slots.len()).filter_map(of_pixel);
    let all = all.flat_map(|(own, i)| own.filter(shines).map(move |at| (lights[at], i, at)));
    let mut all: Vec<(u32, usize, usize)> = all.collect();
    all.sort_by_key(|(light, _, _)| *light);
    // Each light by itself, in the part of the image where its ratio is known.
    for of_light in all.chunk_by(|a, b| a.0 == b.0) {
        let part = Part::around(of_light.iter().map(|(_, i, _)| [i % width, i / width]));
        let known = of_light.iter().map(|(_, i, at)| (part.index(*i, width), ratios[*at]));
        let known = Image::of_some(part.size, f32::NAN, known);
        buffers.fill(&known, (&same, width), &part);
        for (_, i, at) in of_light {
            contrasts[*at] = buffers.at(part.index(*i, width));
        }
    }
    contrasts
}

/// A rectangle of an image.
struct Part {
    /// Its first column and row.
    first: [usize; 2],
    /// Its columns and rows.
    size: [usize; 2],
}

impl Part {
    /// The smallest one with all `places`, columns and rows.
    fn around(places: impl Iterator<Item = [usize; 2]>) -> Self {
        let (mut first, mut last) = ([usize::MAX; 2], [0; 2]);
        for place in places {
            for axis in [0, 1] {
                first[axis] = first[axis].min(place[axis]);
                last[axis] = last[axis].max(place[axis]);
            }
        }
        Self { first, size: [0, 1].map(|axis| last[axis] + 1 - first[axis]) }
    }

    /// The place in the part, row by row, of pixel `i` of an image of this `width`.
    fn index(&self, i: usize, width: usize) -> usize {
        let [x, y] = self.first;
        (i / width - y) * self.size[0] + i % width - x
    }

    /// The rows of `image`, which has this `width`, within the part.
    fn rows<'i, T: Sync>(
        &self,
        image: &'i [T],
        width: usize,
    ) -> impl IndexedParallelIterator<Item = &'i [T]> {
        let Self { first: [x, y], size: [columns, rows] } = *self;
        let rows = image[y * width..(y + rows) * width].par_chunks(width);
        rows.map(move |row| &row[x..x + columns])
    }
}

/// Contrasts of one light in a part of the image.
#[derive(Default)]
struct Buffers {
    bend: Vec<f32>,
    wide: Vec<f32>,
    far: Vec<f32>,
}

impl Buffers {
    fn fill(&mut self, known: &Image<f32>, (same, width): (&[u32], usize), part: &Part) {
        let Self { bend, wide, far } = self;
        let [columns, rows] = part.size;
        for buffer in [&mut *bend, wide, far] {
            buffer.resize(columns * rows, 0.0);
        }
        let rows = bend.par_chunks_mut(columns).zip(wide.par_chunks_mut(columns));
        let rows = rows.zip(part.rows(same, width)).enumerate();
        let lanes = Arch::new();
        rows.for_each(|(y, ((bend, wide), same))| {
            lanes.dispatch(|| near_row(known, y, same, bend, wide));
        });
        let known = Image::of(wide.len(), columns, f32::NAN, |i| Some(wide[i]));
        let rows = far.par_chunks_mut(columns).zip(part.rows(same, width)).enumerate();
        rows.for_each(|(y, (far, same))| lanes.dispatch(|| far_row(&known, y, same, far)));
    }

    fn at(&self, i: usize) -> Contrast {
        Contrast { bend: self.bend[i], wide: self.wide[i], far: self.far[i] }
    }
}

/// For each pixel a bit for each neighbour of [`AROUND`] that shows the same surface, then one for each of the first
/// four directions in which either nearest neighbour shows another mesh, or none; `own` is the number of the pixel's point.
fn same_surface(
    points: &[SurfacePoint],
    pixels: usize,
    width: usize,
    own: impl Fn(usize) -> Option<usize>,
) -> Vec<u32> {
    let mesh = Image::of(pixels, width, NONE, |i| own(i).map(|own| points[own].geom_id));
    let normal = [0, 1, 2]
        .map(|axis| Image::of(pixels, width, 0.0, |i| own(i).map(|own| points[own].n[axis])));
    let mut same = vec![0; pixels];
    let lanes = Arch::new();
    same.par_chunks_mut(width).enumerate().for_each(|(y, same)| {
        lanes.dispatch(|| same_row(&mesh, &normal, y, same));
    });
    same
}

/// The neighbours that show the same surface as the pixels of row `y`, by their meshes and normals.
#[inline(always)] // Into what is compiled for the processor's lanes.
fn same_row(mesh: &Image<u32>, normal: &[Image<f32>; 3], y: usize, same: &mut [u32]) {
    let [nx, ny, nz] = [&normal[0], &normal[1], &normal[2]].map(|n| n.own(y));
    let own = mesh.own(y);
    for (k, place) in AROUND.into_iter().enumerate() {
        let [ox, oy, oz] = [&normal[0], &normal[1], &normal[2]].map(|n| n.row(y, place));
        let other = mesh.row(y, place);
        for (x, same) in same.iter_mut().enumerate() {
            let cos = nx[x] * ox[x] + ny[x] * oy[x] + nz[x] * oz[x];
            *same |= u32::from((own[x] == other[x]) & (cos > SAME_SURFACE)) << k;
        }
        if k < NEAR {
            let direction = ALL + k.min(NEAR - 1 - k);
            let edge = |x: usize| u32::from(own[x] != other[x]) << direction;
            same.iter_mut().enumerate().for_each(|(x, same)| *same |= edge(x));
        }
    }
}

/// Bend and contrast of the pixels of row `y` of the `known` ratios; NaN where too few are known.
#[inline(always)]
fn near_row(known: &Image<f32>, y: usize, same: &[u32], bend: &mut [f32], wide: &mut [f32]) {
    let own = known.own(y);
    bend.fill(f32::NEG_INFINITY);
    for (k, place) in AROUND.into_iter().enumerate().take(NEAR / 2) {
        let opposite = NEAR - 1 - k;
        let (a, b) = (known.row(y, place), known.row(y, AROUND[opposite]));
        let both = 1 << k | 1 << opposite;
        for (x, bend) in bend.iter_mut().enumerate() {
            let off = 0.5 * (a[x] + b[x] - 2.0 * own[x]).abs();
            let is_more = (same[x] & both == both) & (off > *bend);
            *bend = if is_more { off } else { *bend };
        }
    }
    let mut count = vec![0; own.len()];
    wide.fill(0.0);
    for (k, place) in AROUND.into_iter().enumerate() {
        let other = known.row(y, place);
        for (x, (wide, count)) in wide.iter_mut().zip(&mut count).enumerate() {
            let apart = (other[x] - own[x]).abs();
            let is_known = (same[x] >> k & 1 == 1) & (apart >= 0.0);
            *count += u32::from(is_known);
            *wide = if is_known & (apart > *wide) { apart } else { *wide };
        }
    }
    for ((bend, wide), count) in bend.iter_mut().zip(wide).zip(count) {
        *bend = if *bend >= 0.0 { *bend } else { f32::NAN };
        *wide = if 2 * count >= ALL as u32 { *wide } else { f32::NAN };
    }
    // Along a stripe of shadow nothing bends, which tells nothing of what is across.
    for (x, bend) in bend.iter_mut().enumerate() {
        let edges = same[x] >> ALL;
        if CROSSES.iter().all(|cross| edges & cross != 0) && !bend.is_nan() {
            *bend = bend.max(across((known, y), same[x], x).unwrap_or(0.0));
        }
    }
}

/// The least bend of pixel `x` of row `y` in the directions that have an edge in `same`, from two neighbours in line on
/// one side; `None` where no such two are known.
fn across((known, y): (&Image<f32>, usize), same: u32, x: usize) -> Option<f32> {
    let own = known.own(y)[x];
    let at = |k: usize| {
        let ratio = known.row(y, AROUND[k])[x];
        (same >> k & 1 == 1 && !ratio.is_nan()).then_some(ratio)
    };
    let sides = (0..NEAR).filter(|k| same >> (ALL + k.min(&(NEAR - 1 - k))) & 1 == 1);
    let bends = sides.filter_map(|k| Some(0.5 * (own + at(BEHIND[k])? - 2.0 * at(k)?).abs()));
    bends.reduce(f32::min)
}

/// For each pixel of row `y` the largest known contrast among itself and its neighbours.
#[inline(always)]
fn far_row(wide: &Image<f32>, y: usize, same: &[u32], far: &mut [f32]) {
    far.copy_from_slice(wide.own(y));
    for (k, place) in AROUND.into_iter().enumerate() {
        let other = wide.row(y, place);
        for (x, far) in far.iter_mut().enumerate() {
            let is_more =
                (same[x] >> k & 1 == 1) & (other[x] >= 0.0) & ((other[x] > *far) | far.is_nan());
            *far = if is_more { other[x] } else { *far };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Vec3};

    /// Contrasts of 9 x 9 pixels of one plane, but for those that `is_other`.
    fn of(
        ratio: impl Fn(usize, usize) -> f32,
        is_other: impl Fn(usize, usize) -> bool,
    ) -> Vec<Contrast> {
        let places = (0..81).map(|i| (i % 9, i / 9));
        let point = |(x, y)| SurfacePoint {
            p: DVec3::new(x as f64, y as f64, 0.0),
            n: Vec3::Z,
            geom_id: u32::from(is_other(x, y)),
            footprint: 1.0,
            cos: 1.0,
            direct: true,
            samples: 1,
        };
        let points: Vec<SurfacePoint> = places.clone().map(point).collect();
        let ratios: Vec<f32> = places.map(|(x, y)| ratio(x, y)).collect();
        let slots: Vec<u32> = (0..81).collect();
        contrasts(&points, (&ratios, &[]), &slots, (9, 1))
    }

    const MIDDLE: usize = 4 * 9 + 4;

    #[test]
    fn each_neighbour_occurs_once_and_opposite_ones_match() {
        for (k, [x, y]) in AROUND.into_iter().enumerate() {
            assert!(x <= 4 && y <= 4 && [x, y] != [2, 2]);
            assert_eq!(AROUND.iter().filter(|place| **place == [x, y]).count(), 1);
            if k < NEAR {
                assert_eq!(AROUND[NEAR - 1 - k], [4 - x, 4 - y]);
            }
        }
    }

    #[test]
    fn a_slope_has_a_contrast_and_no_bend() {
        let own = of(|x, _| 0.125 * x as f32, |_, _| false)[MIDDLE];
        assert_eq!(own, Contrast { bend: 0.0, wide: 0.25, far: 0.25 });
    }

    #[test]
    fn a_single_pixel_bends_and_is_seen_from_four_pixels_away() {
        let found = of(|x, y| if (x, y) == (4, 4) { 1.0 } else { 0.0 }, |_, _| false);
        assert_eq!(found[MIDDLE], Contrast { bend: 1.0, wide: 1.0, far: 1.0 });
        assert_eq!(found[MIDDLE + 1].bend, 0.5);
        assert_eq!(found[MIDDLE + 2], Contrast { bend: 0.0, wide: 1.0, far: 1.0 });
        assert_eq!((found[MIDDLE - 4].wide, found[MIDDLE - 4].far), (0.0, 1.0));
    }

    /// Beside a picket no pair of opposite neighbours lies across the stripes of shadow.
    #[test]
    fn what_bends_across_a_stripe_counts_from_one_side() {
        let bend = |ratio: fn(usize) -> f32| of(|x, _| ratio(x), |x, _| x == 3)[MIDDLE].bend;
        assert_eq!(bend(|x| 0.125 * x as f32), 0.0);
        assert_eq!(bend(|x| if x == 5 { 1.0 } else { 0.5 }), 0.5);
        // Only two pixels lie beside one another.
        let between = |ratio: fn(usize) -> f32| of(|x, _| ratio(x), |x, _| x % 3 == 0)[MIDDLE].bend;
        assert_eq!(between(|x| 0.125 * x as f32), 0.0);
        // Both the row and the column are known.
        let corner = of(|x, _| if x == 5 { 1.0 } else { 0.5 }, |x, y| x == 3 && y != 4);
        assert_eq!(corner[MIDDLE].bend, 0.25);
    }

    #[test]
    fn another_surface_does_not_count() {
        let found = of(|x, _| if x > 4 { 1.0 } else { 0.0 }, |x, _| x > 4);
        assert_eq!(found[MIDDLE], Contrast { bend: 0.0, wide: 0.0, far: 0.0 });
        // Fewer than half of the pixels around the corner are there.
        assert!(found[0].wide.is_nan() && found[0].bend.is_nan());
    }

    #[test]
    fn unknown_ratios_make_no_contrast() {
        let found = of(|x, y| if (x, y) == (5, 4) { f32::NAN } else { 0.5 }, |_, _| false);
        assert_eq!(found[MIDDLE], Contrast { bend: 0.0, wide: 0.0, far: 0.0 });
        assert!(found[MIDDLE + 1].wide.is_nan() && found[MIDDLE + 1].bend.is_nan());
    }
}
