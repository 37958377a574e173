//! Where the light of a pixel or of a surface point comes from.

use serde::{Deserialize, Serialize};

/// How the shadow part of the light came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[repr(u8)]
pub enum ProvenanceKind {
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

/// Where the shadow part of a pixel's light, or of a surface point's, comes from.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// How the light came about.
    pub kind: ProvenanceKind,
    /// Number of the reference frame that gave most; 0 where nothing was inferred, and for a frame of another
    /// shot, which counts as earlier.
    pub frame: u32,
    /// Weighted mean distance to the samples that gave the light, in footprints of a pixel. Under policy
    /// colour the difference between the distances of the two entries, as a share of the nearer one.
    pub distance: f32,
}

impl Provenance {
    /// Whether the light was inferred from other frames.
    pub fn is_inferred(&self) -> bool {
        use ProvenanceKind::{Both, Earlier, Later};
        matches!(self.kind, Earlier | Later | Both)
    }

    /// Takes in another surface point of the pixel: one traced point makes the pixel traced.
    pub fn join(&mut self, other: &Self) {
        use ProvenanceKind::{Background, Both, Traced};
        self.kind = match (self.kind, other.kind) {
            (Background, p) | (p, Background) => p,
            (Traced, _) | (_, Traced) => Traced,
            (a, b) if a == b => a,
            _ => Both,
        };
        if self.kind == Traced {
            (self.frame, self.distance) = (0, 0.0);
        } else if self.frame == 0 {
            (self.frame, self.distance) = (other.frame, other.distance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(kind: ProvenanceKind, frame: u32) -> Provenance {
        Provenance { kind, frame, distance: 0.5 }
    }

    #[test]
    fn one_traced_point_makes_a_pixel_traced_in_any_order() {
        let points = [
            source(ProvenanceKind::Earlier, 1),
            source(ProvenanceKind::Traced, 0),
            source(ProvenanceKind::Later, 9),
        ];
        for order in [[0, 1, 2], [2, 1, 0], [1, 0, 2]] {
            let mut pixel = Provenance::default();
            order.iter().for_each(|i| pixel.join(&points[*i]));
            assert_eq!(pixel.kind, ProvenanceKind::Traced);
            assert_eq!(pixel.frame, 0);
        }
    }

    #[test]
    fn earlier_and_later_make_both() {
        let mut pixel = source(ProvenanceKind::Earlier, 1);
        pixel.join(&source(ProvenanceKind::Later, 9));
        assert_eq!((pixel.kind, pixel.frame), (ProvenanceKind::Both, 1));
    }
}
