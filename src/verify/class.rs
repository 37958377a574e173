//! Classes of differences between two answers.

use super::Kind;
use serde::Serialize;

/// Width of the band at an edge in which f32 rays may go either way: ulp (2⁻²³) of the largest
/// scene-space coordinate of ray origin and triangle, measured across the ray.
pub const BAND_ULPS: f64 = 4.0;

/// Why two answers differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    /// Another triangle at the same place: coincident, or so near that the order of the two is beyond the distance in f32.
    /// Explained.
    Tie,
    /// A ray that passes within [`BAND_ULPS`] beside this one has the intersector's answer. Explained.
    EdgeBand,
    /// The hit lies within [`BAND_ULPS`] of the ray's own start or end. Explained.
    RayEnd,
    /// The ray slipped past a vertex, within the rounding of Embree's edge functions, onto the outside of something behind.
    /// Embree's robust mode allows that, and the second try does not notice it. (It would notice the hit of an inside, or a
    /// miss.) Explained, up to a limit: [`super::PAST_VERTEX_LIMIT`].
    PastVertex,
    /// The same at a vertex of a mesh that is not closed: a ray through its one side need not meet a back behind, so there
    /// is no second try. Explained, up to a limit: [`super::OPEN_VERTEX_LIMIT`].
    PastOpenVertex,
    /// The ray slipped past a triangle that is seen edge on: two of its edges, or all, lie within the rounding of their
    /// edge functions. A second try may slip past it too. Explained, up to a limit: [`super::EDGE_ON_LIMIT`].
    PastEdgeOn,
    /// A hit that is not on its triangle.
    Phantom,
    /// A hit that the product does not have, or has something behind it for.
    Missed,
    /// The right triangle at the wrong distance.
    WrongDistance,
    /// Not occluded, though it is.
    ShadowLeak,
    /// Occluded by nothing.
    FalseShadow,
}

impl Class {
    /// All classes.
    pub const ALL: [Self; 11] = [
        Self::Tie,
        Self::EdgeBand,
        Self::RayEnd,
        Self::PastVertex,
        Self::PastOpenVertex,
        Self::PastEdgeOn,
        Self::Phantom,
        Self::Missed,
        Self::WrongDistance,
        Self::ShadowLeak,
        Self::FalseShadow,
    ];

    /// Whether such a difference is no fault of the product.
    pub fn is_explained(self) -> bool {
        let past = matches!(self, Self::PastVertex | Self::PastOpenVertex | Self::PastEdgeOn);
        past || matches!(self, Self::Tie | Self::EdgeBand | Self::RayEnd)
    }

    /// Whether rays of `kind` can show it.
    pub fn befalls(self, kind: Kind) -> bool {
        match self {
            Self::EdgeBand | Self::RayEnd => true,
            Self::ShadowLeak | Self::FalseShadow => kind == Kind::Shadow,
            _ => kind != Kind::Shadow,
        }
    }
}

/// One difference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Its class.
    pub class: Class,
    /// How far from no difference, in ulp: a phantom's distance from its triangle, a missed hit's
    /// from the nearest edge (a false shadow's is infinite), along the ray for ties and distances.
    pub ulps: f64,
}
