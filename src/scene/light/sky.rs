//! The sky.

use crate::math::Rgb;
use serde::{Deserialize, Serialize};

/// The light of rays that hit nothing, and how it lights surfaces.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sky {
    /// Constant background radiance.
    pub radiance: Rgb,
    /// Whether that radiance lights diffuse surfaces through occluded sky rays.
    pub lights: bool,
    /// Plain ambient term: each diffuse hit gets `albedo · ambient`, without any ray.
    pub ambient: Rgb,
}

impl Default for Sky {
    fn default() -> Self {
        Self { radiance: Rgb::ZERO, lights: true, ambient: Rgb::ZERO }
    }
}
