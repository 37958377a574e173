//! Where a pixel's light comes from.

use serde::{Deserialize, Serialize};

/// How the shadow part of a pixel's light came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[repr(u8)]
pub enum Provenance {
    /// There was nothing to infer: sky, emitters, surfaces that no kept light reaches.
    #[default]
    Background,
    /// A shadow ray was traced for it, in some sample.
    Traced,
    /// Inferred from earlier frames.
    Earlier,
    /// Inferred from later frames.
    Later,
    /// Inferred from both.
    Both,
}

/// A pixel's provenance, with what gave most.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PixelSource {
    /// How it came about.
    pub provenance: Provenance,
    /// The reference frame that gave most; 0 where nothing was inferred, and for a frame of another
    /// shot, which counts as earlier.
    pub frame: u32,
    /// Weighted mean distance to the samples that gave it, in footprints of a pixel. Under policy
    /// colour by how much the distances of the two entries differ, a share.
    pub distance: f32,
}

impl PixelSource {
    /// Takes in another surface point of the pixel: one traced point makes the pixel traced.
    pub fn join(&mut self, other: &Self) {
        use Provenance::{Background, Both, Traced};
        self.provenance = match (self.provenance, other.provenance) {
            (Background, p) | (p, Background) => p,
            (Traced, _) | (_, Traced) => Traced,
            (a, b) if a == b => a,
            _ => Both,
        };
        if self.provenance == Traced {
            (self.frame, self.distance) = (0, 0.0);
        } else if self.frame == 0 {
            (self.frame, self.distance) = (other.frame, other.distance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(provenance: Provenance, frame: u32) -> PixelSource {
        PixelSource { provenance, frame, distance: 0.5 }
    }

    #[test]
    fn one_traced_point_makes_a_pixel_traced_in_any_order() {
        let points = [
            source(Provenance::Earlier, 1),
            source(Provenance::Traced, 0),
            source(Provenance::Later, 9),
        ];
        for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
            let mut pixel = PixelSource::default();
            order.iter().for_each(|i| pixel.join(&points[*i]));
            assert_eq!(pixel.provenance, Provenance::Traced);
            assert_eq!(pixel.frame, 0);
        }
    }

    #[test]
    fn earlier_and_later_make_both() {
        let mut pixel = source(Provenance::Earlier, 1);
        pixel.join(&source(Provenance::Later, 9));
        assert_eq!((pixel.provenance, pixel.frame), (Provenance::Both, 1));
    }
}
