//! A sky that changes with the height above the horizon alone.

use crate::math::{DVec3, Rgb};
use serde::{Deserialize, Serialize};

/// Radiance between that of zenith, horizon and ground, linear in the sine of the height above the horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkyGradient {
    /// Radiance straight above.
    pub zenith: Rgb,
    /// Radiance at the horizon.
    pub horizon: Rgb,
    /// Radiance straight below.
    pub ground: Rgb,
}

impl SkyGradient {
    /// Radiance along the unit direction `dir`, +y up.
    pub fn radiance(&self, dir: DVec3) -> Rgb {
        let end = if dir.y < 0.0 { self.ground } else { self.zenith };
        self.horizon.lerp(end, dir.y.abs().min(1.0) as f32)
    }
}
