//! Alpha masks: where a surface is, and where it has holes.
//!
//! A mask holds numbers as the image's file stores them, in 8 bits, and only whether they reach a half
//! matters. Not done: partial cover. A surface is there, or it is not.

use super::{Corners, Mesh, TextureMap, Wrap};
use crate::math::{Vec2, bulk};
use serde::{Deserialize, Serialize};

/// Index into `Scene::masks`.
pub type MaskId = u32;

/// Half of full alpha. No texel has it: whole numbers lie above or below.
const HALF: f32 = 127.5;

/// An image's alpha: 0 is a hole, 255 a surface. Row 0 at the top.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct AlphaMask {
    /// The file it came from.
    pub name: String,
    /// Columns, at least one.
    pub width: u32,
    /// Rows, at least one.
    pub height: u32,
    /// `width · height` texels, row by row.
    #[serde(with = "bulk")]
    pub texels: Vec<u8>,
}

impl AlphaMask {
    /// Whether the surface is there at `uv`, of which (0, 0) is the lower left corner of the image: whether the alpha
    /// between the middles of the four texels around it, bilinear, is at least a half.
    pub fn is_there(&self, wrap: [Wrap; 2], uv: Vec2) -> bool {
        let (x0, x1, fx) = wrap[0].two_texels(uv.x, self.width);
        let (y0, y1, fy) = wrap[1].two_texels(1.0 - uv.y, self.height);
        let at = |x: usize, y: usize| f32::from(self.texels[y * self.width as usize + x]);
        let between = |a: f32, b: f32, share: f32| a + (b - a) * share;
        let upper = between(at(x0, y0), at(x1, y0), fx);
        let lower = between(at(x0, y1), at(x1, y1), fx);
        between(upper, lower, fy) >= HALF
    }

    /// Whether it has as many texels as its size says, and any.
    pub fn is_whole(&self) -> bool {
        let pixels = u64::from(self.width) * u64::from(self.height);
        pixels > 0 && pixels == self.texels.len() as u64
    }
}

/// A mask as it lies on a surface.
#[derive(Debug, Clone, Copy)]
pub struct LaidMask<'s> {
    pub(super) mask: &'s AlphaMask,
    pub(super) map: &'s TextureMap,
}

impl LaidMask<'_> {
    /// The texture coordinates of `mesh` by which the mask lies on it, if the mesh has them.
    pub fn uvs<'m>(&self, mesh: &'m Mesh) -> Option<&'m Corners<Vec2>> {
        mesh.uv_set(self.map.uv_set)
    }

    /// Texels of the mask in an `area` of the surface's texture coordinates.
    pub(super) fn texels(&self, area: f64) -> f64 {
        let of_image = area * self.map.transform.matrix2.determinant().abs();
        of_image * f64::from(self.mask.width) * f64::from(self.mask.height)
    }

    /// Whether the surface is there at its texture coordinates `uv`.
    pub fn is_there(&self, uv: Vec2) -> bool {
        self.mask.is_there(self.map.wrap, self.map.place(uv))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine2, DVec2};

    fn mask(width: u32, texels: &[u8]) -> AlphaMask {
        let height = texels.len() as u32 / width;
        AlphaMask { name: "mask".into(), width, height, texels: texels.to_vec() }
    }

    #[test]
    fn below_a_half_is_a_hole() {
        for (texel, there) in [(0, false), (127, false), (128, true), (255, true)] {
            assert_eq!(
                mask(1, &[texel]).is_there([Wrap::Repeat; 2], Vec2::new(0.3, 0.6)),
                there,
                "{texel}"
            );
        }
    }

    #[test]
    fn a_checker_is_cut_along_the_edges_of_its_texels() {
        // Upper row: hole, surface.
        let checker = mask(2, &[0, 255, 255, 0]);
        for i in 0..100 {
            for j in 0..100 {
                let (u, v) = ((i as f32 + 0.5) / 100.0, (j as f32 + 0.5) / 100.0);
                let there = (u < 0.5) == (v < 0.5);
                assert_eq!(checker.is_there([Wrap::Repeat; 2], Vec2::new(u, v)), there, "{u} {v}");
            }
        }
    }

    #[test]
    fn a_slope_is_cut_where_it_reaches_a_half() {
        // Texel middles at 0.25 and 0.75: 100 and 200, so a half is reached at 0.25 + 0.5 · 27.5 / 100.
        let slope = mask(2, &[100, 200]);
        let edge = 0.25 + 0.5 * 0.275;
        assert!(!slope.is_there([Wrap::Repeat; 2], Vec2::new(edge - 1e-5, 0.5)));
        assert!(slope.is_there([Wrap::Repeat; 2], Vec2::new(edge + 1e-5, 0.5)));
    }

    #[test]
    fn coordinates_repeat_and_never_leave_the_image() {
        let checker = mask(2, &[0, 255, 255, 0]);
        for whole in [-3.0, -1.0, 0.0, 1.0, 7.0] {
            assert!(checker.is_there([Wrap::Repeat; 2], Vec2::new(whole + 0.25, 0.25 - whole)));
            assert!(!checker.is_there([Wrap::Repeat; 2], Vec2::new(whole + 0.25, 0.75 - whole)));
        }
        for bad in [1e30, -1e30, 8_388_607.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e-30] {
            // No panic is what counts.
            let _ = checker.is_there([Wrap::Repeat; 2], Vec2::new(bad, bad));
        }
    }

    #[test]
    fn a_mask_lies_as_its_map_says() {
        let checker = mask(2, &[0, 255, 255, 0]);
        let transform = DAffine2::from_scale(DVec2::new(4.0, 1.0));
        let map = TextureMap { transform, ..TextureMap::of(0) };
        let laid = LaidMask { mask: &checker, map: &map };
        // Texels are an eighth wide.
        for (u, there) in [(0.06, true), (0.19, false), (0.31, true), (0.94, false)] {
            assert_eq!(laid.is_there(Vec2::new(u, 0.25)), there, "{u}");
        }
        let clamped = TextureMap { wrap: [Wrap::Clamp; 2], ..map };
        let laid = LaidMask { mask: &checker, map: &clamped };
        assert!(!laid.is_there(Vec2::new(0.31, 0.25)));
    }

    #[test]
    fn a_mask_is_whole_with_as_many_texels_as_its_size_says() {
        assert!(mask(2, &[0, 1, 2, 3]).is_whole());
        let with = |width, height, texels: usize| AlphaMask {
            name: String::new(),
            width,
            height,
            texels: vec![0; texels],
        };
        assert!(!with(2, 2, 3).is_whole() && !with(0, 2, 0).is_whole());
        assert!(!with(1 << 31, 4, 0).is_whole());
    }
}
