//! Images that materials show or take numbers from, with their mip levels.

mod point_row;
mod wrap;

pub use point_row::PointRow;
pub use wrap::Wrap;

use crate::math::{DAffine2, DVec2, DVec3, Rgb, Vec2, Vec3, bulk, srgb_decode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;
use wide::f32x4;

/// Index into `Scene::textures`.
pub type TextureId = u32;

/// An image and smaller copies of it, down to a single texel (mip levels; Williams, 1983). Row 0 is at the top.
///
/// Each texel of a level is the mean of what it covers of the level before: of colours in linear RGB, of data as they stand.
/// The levels take a third of the memory of the image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// The file it came from.
    pub name: String,
    /// The image itself first; each half as wide and high as the one before, rounded down.
    levels: Vec<TextureLevel>,
}

/// One mip level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TextureLevel {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` texels, row by row.
    texels: Texels,
}

/// Texels as they lie in memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Texels {
    /// sRGB codes of 8 bits, 3 bytes a texel.
    Srgb(#[serde(with = "bulk")] Vec<[u8; 3]>),
    /// Linear RGB, 12 bytes a texel.
    Linear(#[serde(with = "bulk")] Vec<Rgb>),
    /// Shares of 255, no colour; a byte a texel.
    Data8(#[serde(with = "bulk")] Vec<u8>),
    /// Shares of 65535, no colour; 2 bytes a texel.
    Data16(#[serde(with = "bulk")] Vec<u16>),
    /// Three shares of 255 each, no colours; 3 bytes a texel.
    Vectors8(#[serde(with = "bulk")] Vec<[u8; 3]>),
    /// Three shares of 65535 each; 6 bytes a texel.
    Vectors16(#[serde(with = "bulk")] Vec<[u16; 3]>),
}

/// How a material lays an image on a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TextureMap {
    /// The image: index into `Scene::textures`, or into `Scene::masks` where it is a mask.
    pub image: u32,
    /// What is seen beyond the image's edges at its sides, and above and below.
    pub wrap: [Wrap; 2],
    /// The set of the mesh's texture coordinates that it lies by, from 0. An exact sphere has the same in every set.
    pub uv_set: u8,
    /// From the surface's texture coordinates to the image's, of which `(0, 0)` is the lower left corner and
    /// `(1, 1)` the upper right one.
    pub transform: DAffine2,
}

impl TextureMap {
    /// The image where the texture coordinates put it, repeated.
    pub fn of(image: u32) -> Self {
        Self { image, wrap: [Wrap::Repeat; 2], uv_set: 0, transform: DAffine2::IDENTITY }
    }

    /// The image's coordinates at the surface's texture coordinates `uv`; where the image repeats, less whole
    /// repetitions, lest f32 rounds the rest away.
    pub fn place(&self, uv: Vec2) -> Vec2 {
        self.wrapped(self.transform.transform_point2(uv.as_dvec2()))
    }

    /// The image's coordinates `uv`; where the image repeats, less whole repetitions.
    pub(super) fn wrapped(&self, uv: DVec2) -> Vec2 {
        let near = |x: f64, wrap: Wrap| match wrap {
            Wrap::Repeat if x.abs() > 1.0 => x - x.floor(),
            Wrap::Mirror if x.abs() > 1.0 => x - 2.0 * (0.5 * x).floor(),
            Wrap::Repeat | Wrap::Mirror | Wrap::Clamp => x,
        };
        Vec2::new(near(uv.x, self.wrap[0]) as f32, near(uv.y, self.wrap[1]) as f32)
    }
}

/// Linear values of the sRGB codes of 8 bits, rounded once.
pub(super) static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_decode(code as f64 / 255.0) as f32));

/// What shares of 8 bits are divided by, and those of 16.
const FULL8: f32 = 255.0;
const FULL16: f32 = 65_535.0;

/// The linear values between which a code is the nearest: from `BETWEEN[code - 1]` to `BETWEEN[code]`.
static BETWEEN: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb_decode((code as f64 + 0.5) / 255.0) as f32));

impl Texture {
    /// A texture of `width · height` sRGB codes, row by row, and its mip levels. These are rounded to codes too.
    ///
    /// # Panics
    /// Where there are not `width · height` texels, or none, or more than 2²³ along an edge.
    pub fn from_srgb(name: impl Into<String>, size: [u32; 2], texels: Vec<[u8; 3]>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Srgb(texels)))
    }

    /// The same of linear RGB, whose mip levels are not rounded.
    ///
    /// # Panics
    /// As [`from_srgb`](Self::from_srgb).
    pub fn from_linear(name: impl Into<String>, size: [u32; 2], texels: Vec<Rgb>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Linear(texels)))
    }

    /// A texture of numbers from 0 to 1, as shares of 255. A lookup gives a grey of them.
    ///
    /// # Panics
    /// As [`from_srgb`](Self::from_srgb).
    pub fn from_data8(name: impl Into<String>, size: [u32; 2], texels: Vec<u8>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Data8(texels)))
    }

    /// The same as shares of 65535.
    ///
    /// # Panics
    /// As [`from_srgb`](Self::from_srgb).
    pub fn from_data16(name: impl Into<String>, size: [u32; 2], texels: Vec<u16>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Data16(texels)))
    }

    /// A texture of three numbers from 0 to 1 a texel, no colours, as shares of 255.
    ///
    /// # Panics
    /// As [`from_srgb`](Self::from_srgb).
    pub fn from_vectors8(name: impl Into<String>, size: [u32; 2], texels: Vec<[u8; 3]>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Vectors8(texels)))
    }

    /// The same as shares of 65535.
    ///
    /// # Panics
    /// As [`from_srgb`](Self::from_srgb).
    pub fn from_vectors16(name: impl Into<String>, size: [u32; 2], texels: Vec<[u16; 3]>) -> Self {
        Self::with_levels(name.into(), TextureLevel::new(size, Texels::Vectors16(texels)))
    }

    /// Whether nearly all texels, as they stand, are unit vectors nearer to blue than to red and green, as those of normal maps
    /// are and colours are not.
    pub fn looks_like_normals(&self) -> bool {
        // A grey of such a length, and what is nearly one, is as far along red and green.
        self.are_mostly(|v| (v.length() - 1.0).abs() < 0.1 && v.z > v.x.max(v.y) + 0.1)
    }

    /// The same of maps that may be steep: unit vectors on the side of blue, but no greys.
    pub fn may_be_normals(&self) -> bool {
        let is_grey = |v: Vec3| (v - Vec3::splat(v.z)).abs().max_element() < 0.1;
        self.are_mostly(|v| (v.length() - 1.0).abs() < 0.1 && v.z > 0.0 && !is_grey(v))
    }

    /// Whether nearly all texels, as they stand, are the shares of vectors that pass.
    fn are_mostly(&self, passes: impl Fn(Vec3) -> bool + Sync) -> bool {
        let is_normal = |shares: Rgb| passes(shares * 2.0 - Rgb::ONE);
        let eight = |c: &[u8; 3]| is_normal(Rgb::from_array(c.map(f32::from)) / FULL8);
        let (normals, all) = match &self.levels[0].texels {
            Texels::Srgb(codes) | Texels::Vectors8(codes) => {
                (codes.par_iter().filter(|c| eight(c)).count(), codes.len())
            }
            Texels::Vectors16(codes) => {
                let sixteen = |c: &[u16; 3]| is_normal(Rgb::from_array(c.map(f32::from)) / FULL16);
                (codes.par_iter().filter(|c| sixteen(c)).count(), codes.len())
            }
            Texels::Linear(values) => {
                (values.par_iter().filter(|c| is_normal(**c)).count(), values.len())
            }
            Texels::Data8(_) | Texels::Data16(_) => (0, 1),
        };
        10 * normals > 9 * all
    }

    fn with_levels(name: String, image: TextureLevel) -> Self {
        let mut levels = vec![image];
        while let Some(next) = levels.last().and_then(TextureLevel::halved) {
            levels.push(next);
        }
        Self { name, levels }
    }

    /// The mip levels, the image itself first.
    pub fn levels(&self) -> &[TextureLevel] {
        &self.levels
    }

    /// The mean of what is seen at some points in level number `level` and, by `fraction`, in the next one.
    pub fn mean(&self, wrap: [Wrap; 2], at: PointRow, (level, fraction): (usize, f32)) -> Rgb {
        let fine = &self.levels[level];
        let coarse = self.levels.get(level + 1).unwrap_or(fine);
        let three = |[x, y, z]: [f32; 3]| f32x4::from([x, y, z, 0.0]);
        // Told apart once, lest each texel asks what it is. Shares are divided once, too.
        let (mean, full) = match (&fine.texels, &coarse.texels) {
            (Texels::Srgb(a), Texels::Srgb(b)) => {
                let table: &[f32; 256] = &LINEAR;
                let linear = |[r, g, b]: &[u8; 3]| three([r, g, b].map(|c| table[usize::from(*c)]));
                (at.mean([(fine, a), (coarse, b)], linear, wrap, fraction), 1.0)
            }
            (Texels::Linear(a), Texels::Linear(b)) => {
                let linear = |value: &Rgb| three(value.to_array());
                (at.mean([(fine, a), (coarse, b)], linear, wrap, fraction), 1.0)
            }
            (Texels::Data8(a), Texels::Data8(b)) => {
                let share = |code: &u8| f32x4::splat((*code).into());
                (at.mean([(fine, a), (coarse, b)], share, wrap, fraction), FULL8)
            }
            (Texels::Data16(a), Texels::Data16(b)) => {
                let share = |code: &u16| f32x4::splat((*code).into());
                (at.mean([(fine, a), (coarse, b)], share, wrap, fraction), FULL16)
            }
            (Texels::Vectors8(a), Texels::Vectors8(b)) => {
                let shares = |codes: &[u8; 3]| three(codes.map(f32::from));
                (at.mean([(fine, a), (coarse, b)], shares, wrap, fraction), FULL8)
            }
            (Texels::Vectors16(a), Texels::Vectors16(b)) => {
                let shares = |codes: &[u16; 3]| three(codes.map(f32::from));
                (at.mean([(fine, a), (coarse, b)], shares, wrap, fraction), FULL16)
            }
            _ => unreachable!("levels of one image are of one kind"),
        };
        let [red, green, blue, _] = mean.to_array();
        Rgb::new(red, green, blue) / full
    }

    /// Bytes of all texels.
    pub fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| level.bytes().len() as u64).sum()
    }

    /// What the texels are, in a word.
    pub fn kind(&self) -> &'static str {
        match self.levels[0].texels {
            Texels::Srgb(_) => "sRGB codes",
            Texels::Linear(_) => "linear",
            Texels::Data8(_) => "data of 8 bits",
            Texels::Data16(_) => "data of 16 bits",
            Texels::Vectors8(_) => "vectors of 8 bits",
            Texels::Vectors16(_) => "vectors of 16 bits",
        }
    }

    /// Bytes of the texels of the image itself, from which all else follows; their layout is that of the memory.
    pub fn image_bytes(&self) -> &[u8] {
        self.levels[0].bytes()
    }
}

impl TextureLevel {
    fn new([width, height]: [u32; 2], texels: Texels) -> Self {
        let count = match &texels {
            Texels::Srgb(codes) => codes.len(),
            Texels::Linear(values) => values.len(),
            Texels::Data8(values) => values.len(),
            Texels::Data16(values) => values.len(),
            Texels::Vectors8(values) => values.len(),
            Texels::Vectors16(values) => values.len(),
        };
        assert_eq!(count, width as usize * height as usize, "texels of a texture");
        assert!(count > 0, "a texture without texels");
        assert!(width.max(height) <= 1 << 23, "texels along an edge of a texture");
        Self { width, height, texels }
    }

    /// The texel in `column` and `row`, linear RGB or a grey of data.
    ///
    /// # Panics
    /// Outside of the level.
    pub fn texel(&self, column: usize, row: usize) -> Rgb {
        self.linear(row * self.width as usize + column)
    }

    /// The texels in two columns and two rows, row by row, linear RGB or greys of data.
    ///
    /// # Panics
    /// Outside of the level.
    pub fn four(&self, [left, right]: [usize; 2], rows: [usize; 2]) -> [Rgb; 4] {
        let [upper, lower] = rows.map(|row| row * self.width as usize);
        [upper + left, upper + right, lower + left, lower + right].map(|at| self.linear(at))
    }

    /// What the level shows at the image's coordinates `uv`, between the middles of four texels.
    pub fn bilinear(&self, wrap: [Wrap; 2], uv: Vec2) -> Rgb {
        let (left, right, x) = wrap[0].two_texels(uv.x, self.width);
        let (upper, lower, y) = wrap[1].two_texels(1.0 - uv.y, self.height);
        let [a, b, c, d] = self.four([left, right], [upper, lower]);
        a.lerp(b, x).lerp(c.lerp(d, x), y)
    }

    /// Texel number `at`, linear RGB or a grey of data.
    fn linear(&self, at: usize) -> Rgb {
        match &self.texels {
            Texels::Srgb(codes) => Rgb::from_array(codes[at].map(|c| LINEAR[usize::from(c)])),
            Texels::Linear(values) => values[at],
            Texels::Data8(values) => Rgb::splat(f32::from(values[at])) / FULL8,
            Texels::Data16(values) => Rgb::splat(f32::from(values[at])) / FULL16,
            Texels::Vectors8(values) => Rgb::from_array(values[at].map(f32::from)) / FULL8,
            Texels::Vectors16(values) => Rgb::from_array(values[at].map(f32::from)) / FULL16,
        }
    }

    fn bytes(&self) -> &[u8] {
        match &self.texels {
            Texels::Srgb(codes) => bytemuck::cast_slice(codes),
            Texels::Linear(values) => bytemuck::cast_slice(values),
            Texels::Data8(values) => values,
            Texels::Data16(values) => bytemuck::cast_slice(values),
            Texels::Vectors8(values) => bytemuck::cast_slice(values),
            Texels::Vectors16(values) => bytemuck::cast_slice(values),
        }
    }

    /// The next level; `None` after a single texel.
    fn halved(&self) -> Option<Self> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (columns, rows) = (Covered::of(self.width), Covered::of(self.height));
        let size = [columns.count, rows.count];
        let mean = |place: usize| {
            let (column, row) = (place % size[0], place / size[0]);
            let across = |y: usize| -> DVec3 {
                columns.parts(column).map(|(x, part)| self.texel(x, y).as_dvec3() * part).sum()
            };
            rows.parts(row).map(|(y, part)| across(y) * part).sum::<DVec3>().as_vec3()
        };
        let means = (0..size[0] * size[1]).into_par_iter().map(mean);
        let texels = match self.texels {
            Texels::Srgb(_) => Texels::Srgb(means.map(|mean| mean.to_array().map(code)).collect()),
            Texels::Linear(_) => Texels::Linear(means.collect()),
            Texels::Data8(_) => {
                Texels::Data8(means.map(|mean| rounded(mean.x, FULL8) as u8).collect())
            }
            Texels::Vectors8(_) => {
                let code = |mean: Vec3| mean.to_array().map(|c| rounded(c, FULL8) as u8);
                Texels::Vectors8(means.map(code).collect())
            }
            Texels::Vectors16(_) => {
                let code = |mean: Vec3| mean.to_array().map(|c| rounded(c, FULL16) as u16);
                Texels::Vectors16(means.map(code).collect())
            }
            Texels::Data16(_) => {
                Texels::Data16(means.map(|mean| rounded(mean.x, FULL16) as u16).collect())
            }
        };
        Some(Self::new(size.map(|n| n as u32), texels))
    }
}

/// Which texels of a row each texel of a row half as long covers.
struct Covered {
    /// Texels of the longer row over those of the shorter one: 2, but for odd numbers.
    ratio: f64,
    from: usize,
    /// Texels of the shorter row.
    count: usize,
}

impl Covered {
    fn of(count: u32) -> Self {
        let to = (count / 2).max(1);
        let ratio = f64::from(count) / f64::from(to);
        Self { ratio, from: count as usize, count: to as usize }
    }

    /// The texels that number `at` covers, each with its part of the whole.
    fn parts(&self, at: usize) -> impl Iterator<Item = (usize, f64)> {
        let (start, end) = (at as f64 * self.ratio, (at + 1) as f64 * self.ratio);
        let ratio = self.ratio;
        (start as usize..self.from.min(end.ceil() as usize)).filter_map(move |x| {
            let covered = end.min(x as f64 + 1.0) - start.max(x as f64);
            (covered > 0.0).then_some((x, covered / ratio))
        })
    }
}

/// The sRGB code nearest to a linear value.
fn code(linear: f32) -> u8 {
    BETWEEN.partition_point(|bound| *bound <= linear) as u8
}

/// A share of `full` as the nearest whole number.
fn rounded(share: f32, full: f32) -> f32 {
    (share * full).round().clamp(0.0, full)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::srgb_encode;

    #[test]
    fn codes_are_the_nearest() {
        for c in 0..=255u8 {
            assert_eq!(code(LINEAR[c as usize]), c);
        }
        for i in 0..=10_000 {
            let linear = i as f32 / 10_000.0;
            let exact = 255.0 * srgb_encode(f64::from(linear));
            assert!((f64::from(code(linear)) - exact).abs() < 0.500_1, "{linear}");
        }
    }

    #[test]
    fn normals_are_told_from_greys_and_pale_colours() {
        let looks = |texel: [u8; 3]| {
            Texture::from_vectors8("t", [2, 2], vec![texel; 4]).looks_like_normals()
        };
        // Even, tilted by 45 degrees, and the steepest that count.
        assert!(looks([128, 128, 255]) && looks([218, 128, 218 + 14]) && looks([128, 60, 235]));
        for grey in 0..=255 {
            assert!(!looks([grey; 3]), "{grey}");
        }
        assert!(!looks([200, 200, 208]) && !looks([210, 200, 200]) && !looks([0, 128, 128]));
        let may =
            |texel: [u8; 3]| Texture::from_vectors8("t", [2, 2], vec![texel; 4]).may_be_normals();
        // Slopes of 0.9 and 2.
        assert!(may([43, 128, 222]) && may([213, 128, 222]) && may([242, 128, 184]));
        assert!((0..=255).all(|grey| !may([grey; 3])) && !may([200, 200, 208]));
    }

    #[test]
    fn every_level_has_the_mean_of_the_image() {
        for size in [[1, 1], [4, 4], [5, 3], [1, 7], [64, 10], [33, 17]] {
            let count = size[0] * size[1];
            let value = |i: u32| Rgb::new(((i * 37) % 11) as f32, ((i * 53) % 7) as f32, 1.0);
            let texture = Texture::from_linear("t", size, (0..count).map(value).collect());
            let mean = |level: &TextureLevel| {
                let rows = 0..level.height as usize;
                let sum: DVec3 = rows
                    .flat_map(|y| (0..level.width as usize).map(move |x| (x, y)))
                    .map(|(x, y)| level.texel(x, y).as_dvec3())
                    .sum();
                sum / f64::from(level.width * level.height)
            };
            let wanted = mean(&texture.levels[0]);
            for level in &texture.levels {
                assert!((mean(level) - wanted).abs().max_element() < 1e-5, "{size:?}");
                assert!(level.texel(0, 0).z == 1.0, "what is the same everywhere stays it");
            }
            let last = texture.levels.last().expect("a level");
            assert_eq!((last.width, last.height), (1, 1));
        }
    }

    /// A texture of every kind, of texels without a pattern.
    fn of_every_kind(size: [u32; 2]) -> [Texture; 6] {
        let count = size[0] * size[1];
        let code = |i: u32, part: u32| ((3 * i + part).wrapping_mul(0x9e37_79b9) >> 16) as u16;
        let three = |i: u32| [0, 1, 2].map(|part| code(i, part));
        let three8 = |i: u32| three(i).map(|code| code as u8);
        [
            Texture::from_srgb("t", size, (0..count).map(three8).collect()),
            Texture::from_linear(
                "t",
                size,
                (0..count).map(|i| Rgb::from_array(three(i).map(f32::from)) / FULL16).collect(),
            ),
            Texture::from_data8("t", size, (0..count).map(|i| code(i, 0) as u8).collect()),
            Texture::from_data16("t", size, (0..count).map(|i| code(i, 0)).collect()),
            Texture::from_vectors8("t", size, (0..count).map(three8).collect()),
            Texture::from_vectors16("t", size, (0..count).map(three).collect()),
        ]
    }

    #[test]
    fn the_mean_of_a_row_is_that_of_its_points() {
        let (first, step) = (Vec2::new(-0.63, 0.91), Vec2::new(0.217, 0.344));
        let wraps = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
        for texture in of_every_kind([5, 3]) {
            for (k, count) in (1..=9).enumerate() {
                let wrap = [wraps[k % 3], wraps[(k + 1) % 3]];
                for fraction in [0.0, 0.3, 1.0] {
                    let point = |i: u32| {
                        let at = |level: usize| {
                            texture.levels[level].bilinear(wrap, first + step * i as f32)
                        };
                        at(0).lerp(at(1), fraction)
                    };
                    let wanted = (0..count).map(point).sum::<Rgb>() / count as f32;
                    let row = PointRow { first, step, count };
                    let found = texture.mean(wrap, row, (0, fraction));
                    let off = (found - wanted).abs().max_element();
                    assert!(off < 1e-6, "{} {count} {fraction}: {found} {wanted}", texture.kind());
                }
            }
        }
    }

    /// Metal by an image of ones is no plastic at all, and asks for no light of plastic.
    #[test]
    fn the_mean_of_ones_is_one() {
        let ones = [
            Texture::from_data8("t", [2, 2], vec![255; 4]),
            Texture::from_data16("t", [2, 2], vec![65_535; 4]),
            Texture::from_vectors8("t", [2, 2], vec![[255; 3]; 4]),
            Texture::from_vectors16("t", [2, 2], vec![[65_535; 3]; 4]),
            Texture::from_srgb("t", [2, 2], vec![[255; 3]; 4]),
        ];
        for count in 1..=16 {
            let row = PointRow { first: Vec2::splat(0.1), step: Vec2::splat(0.37), count };
            for fraction in (0..1000).map(|i| (i as f32 / 1000.0).powi(2)) {
                for texture in &ones {
                    let mean = texture.mean([Wrap::Repeat; 2], row, (0, fraction));
                    assert_eq!(mean, Rgb::ONE, "{} {count} {fraction}", texture.kind());
                }
            }
        }
    }

    #[test]
    fn data_are_averaged_as_they_stand() {
        let texture = Texture::from_data8("t", [2, 1], vec![0, 255]);
        assert_eq!((texture.levels[0].texel(1, 0), texture.bytes()), (Rgb::ONE, 3));
        assert_eq!(texture.levels[1].texels, Texels::Data8(vec![128]));
        let texture = Texture::from_data16("t", [1, 2], vec![100, 65_535]);
        assert_eq!(texture.levels[0].texel(0, 0), Rgb::splat(100.0 / 65_535.0));
        assert_eq!(texture.levels[1].texels, Texels::Data16(vec![32_818]));
    }

    #[test]
    fn codes_are_averaged_as_light() {
        // Half of the light of black and white is code 188, not 128.
        let texture = Texture::from_srgb("t", [2, 1], vec![[0; 3], [255; 3]]);
        assert_eq!(texture.levels.len(), 2);
        assert_eq!(texture.levels[1].texels, Texels::Srgb(vec![[188; 3]]));
        assert_eq!(texture.bytes(), 9);
    }
}
