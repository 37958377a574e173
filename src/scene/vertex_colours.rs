//! Vertex colours: a reflectance for each vertex, interpolated over the triangles.

use super::texture::LINEAR;
use crate::math::{Rgb, bulk, srgb_decode};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Colours within this of a code of 8 bits, in units of a code, are kept as that code: text of three or four digits is.
const NEAR_A_CODE: f32 = 0.02;

/// Colours of a mesh's vertices, in their order. Reflectances: linear RGB in `[0, 1]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VertexColours(Stored);

/// Colours as they lie in memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Stored {
    /// sRGB codes of 8 bits, 3 bytes a vertex.
    Srgb(#[serde(with = "bulk")] Vec<[u8; 3]>),
    /// Linear RGB, 12 bytes a vertex.
    Linear(#[serde(with = "bulk")] Vec<Rgb>),
}

impl VertexColours {
    /// Colours given as shares of the largest sRGB code, from 0 to 1; what lies outside counts as the nearer end.
    /// They are kept in 8 bits where that moves none of them by more than a fiftieth of a code.
    pub fn from_encoded(shares: &[[f32; 3]]) -> Self {
        let codes = |c: f32| 255.0 * c.clamp(0.0, 1.0);
        let is_code = |c: f32| (codes(c) - codes(c).round()).abs() <= NEAR_A_CODE;
        let linear = |c: f32| srgb_decode(f64::from(c.clamp(0.0, 1.0))) as f32;
        if shares.par_iter().all(|c| c.iter().all(|c| is_code(*c))) {
            let code = |c: &[f32; 3]| c.map(|c| codes(c).round() as u8);
            Self(Stored::Srgb(shares.par_iter().map(code).collect()))
        } else {
            let colour = |c: &[f32; 3]| Rgb::from_array(c.map(linear));
            Self(Stored::Linear(shares.par_iter().map(colour).collect()))
        }
    }

    /// Colours in linear RGB, each channel in `[0, 1]`.
    pub fn from_linear(colours: Vec<Rgb>) -> Self {
        Self(Stored::Linear(colours))
    }

    /// How many vertices have one.
    pub fn count(&self) -> usize {
        match &self.0 {
            Stored::Srgb(codes) => codes.len(),
            Stored::Linear(colours) => colours.len(),
        }
    }

    /// The sRGB codes, if that is how the colours are kept.
    pub fn codes(&self) -> Option<&[[u8; 3]]> {
        match &self.0 {
            Stored::Srgb(codes) => Some(codes),
            Stored::Linear(_) => None,
        }
    }

    /// The colour of a vertex, linear RGB.
    ///
    /// # Panics
    /// Where there is no such vertex.
    #[inline]
    pub fn of_vertex(&self, vertex: u32) -> Rgb {
        match &self.0 {
            Stored::Srgb(codes) => {
                let [r, g, b] = codes[vertex as usize].map(|c| LINEAR[c as usize]);
                Rgb::new(r, g, b)
            }
            Stored::Linear(colours) => colours[vertex as usize],
        }
    }

    /// The colour where the vertices of `triangle` have these weights, which add up to 1; linear RGB.
    ///
    /// # Panics
    /// Where there is no such vertex.
    pub fn between(&self, triangle: [u32; 3], weights: [f64; 3]) -> Rgb {
        let [a, b, c] = triangle.map(|vertex| self.of_vertex(vertex));
        let [wa, wb, wc] = weights.map(|weight| weight as f32);
        a * wa + b * wb + c * wc
    }

    /// The colours as they lie in memory.
    pub fn bytes(&self) -> &[u8] {
        match &self.0 {
            Stored::Srgb(codes) => bytemuck::cast_slice(codes),
            Stored::Linear(colours) => bytemuck::cast_slice(colours),
        }
    }

    /// Whether each channel lies in `[0, 1]`.
    pub fn are_reflectances(&self) -> bool {
        let is_share = |c: f32| (0.0..=1.0).contains(&c);
        match &self.0 {
            Stored::Srgb(_) => true,
            Stored::Linear(colours) => {
                colours.iter().all(|c| c.to_array().map(is_share) == [true; 3])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_8_bits_take_3_bytes_and_are_decoded_as_textures_are() {
        // As written with six digits, with four, and as bytes.
        let shares = [[0.498_039, 0.0, 1.0], [0.2, 0.2039, 127.0 / 255.0]];
        let colours = VertexColours::from_encoded(&shares);
        assert_eq!(colours.codes(), Some(&[[127, 0, 255], [51, 52, 127]][..]));
        assert_eq!((colours.count(), colours.bytes().len()), (2, 6));
        assert_eq!(colours.of_vertex(0).x, srgb_decode(127.0 / 255.0) as f32);
    }

    #[test]
    fn finer_colours_are_kept_in_f32_and_what_lies_outside_is_cut() {
        let colours = VertexColours::from_encoded(&[[0.5, -3.0, 1.5]]);
        assert_eq!((colours.codes(), colours.bytes().len()), (None, 12));
        assert_eq!(colours.of_vertex(0), Rgb::new(srgb_decode(0.5) as f32, 0.0, 1.0));
        assert!(colours.are_reflectances());
        assert!(!VertexColours::from_linear(vec![Rgb::NAN]).are_reflectances());
        assert!(!VertexColours::from_linear(vec![Rgb::splat(1.01)]).are_reflectances());
    }

    #[test]
    fn colours_are_mixed_as_light() {
        let colours = VertexColours::from_encoded(&[[0.0; 3], [1.0; 3], [1.0, 0.0, 0.0]]);
        let mixed = colours.between([0, 1, 2], [0.5, 0.25, 0.25]);
        assert_eq!(mixed, Rgb::new(0.5, 0.25, 0.25));
    }
}
