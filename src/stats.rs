//! Counts that travel upwards: rays by kind. Plain sums, so that merging is order-free.

use serde::{Deserialize, Serialize};
use std::ops::AddAssign;

/// Rays cast, by kind. `retry` and `invalid` count inside the other kinds' rays, not beside them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RayCounts {
    /// Camera rays.
    pub camera: u64,
    /// Rays reflected by mirrors.
    pub mirror: u64,
    /// Rays reflected or refracted by glass.
    pub glass: u64,
    /// Shadow rays to area lights.
    pub shadow_area: u64,
    /// Shadow rays to point and directional lights.
    pub shadow_delta: u64,
    /// Shadow rays to the sky.
    pub shadow_sky: u64,
    /// Second tries after a miss inside the bounds.
    pub retry: u64,
    /// Rays refused before tracing (NaN, infinite, zero direction).
    pub invalid: u64,
}

impl RayCounts {
    /// All rays that were traced, second tries included.
    pub fn total(&self) -> u64 {
        self.camera
            + self.mirror
            + self.glass
            + self.shadow_area
            + self.shadow_delta
            + self.shadow_sky
            + self.retry
    }
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, o: Self) {
        self.camera += o.camera;
        self.mirror += o.mirror;
        self.glass += o.glass;
        self.shadow_area += o.shadow_area;
        self.shadow_delta += o.shadow_delta;
        self.shadow_sky += o.shadow_sky;
        self.retry += o.retry;
        self.invalid += o.invalid;
    }
}
