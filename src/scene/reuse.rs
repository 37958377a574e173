//! How much of a frame may come from other frames.

use serde::{Deserialize, Serialize};

/// Settings of reuse between frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReuseSettings {
    /// What frames reuse of one another.
    pub policy: Policy,
    /// Frames from one key frame to the next.
    pub segment: u32,
    /// By how much inferred pixels may be off even where traced ones are more accurate, display steps of 1/255:
    /// root mean square over a tile of 32 x 32 pixels.
    pub tolerance: f32,
    /// Share of the pixels of an in-between frame that are estimated and also traced, to measure the error of
    /// estimates. Frames that are inferred from key frames alone have more.
    pub probes: f32,
    /// Colour policy: cached colours agree within this, linear colour difference in any channel.
    pub colour_epsilon: f32,
    /// Colour policy: cached distances agree within this, a share of the distance.
    pub distance_epsilon: f32,
}

impl Default for ReuseSettings {
    fn default() -> Self {
        Self {
            policy: Policy::Surface,
            segment: 128,
            tolerance: 0.25,
            probes: 0.01,
            colour_epsilon: 0.02,
            distance_epsilon: 0.02,
        }
    }
}

impl ReuseSettings {
    /// The distance that maps paint as the farthest: footprints of a pixel under policy surface, a
    /// share of the distance under policy colour.
    pub fn farthest(&self) -> f32 {
        match self.policy {
            Policy::Colour => self.distance_epsilon.max(1e-6),
            Policy::Surface | Policy::Off => 2.0,
        }
    }
}

/// What frames reuse of one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Shadowing at surface points, with evidence.
    Surface,
    /// Colours of pixels.
    Colour,
    /// Nothing: every frame is traced.
    Off,
}
