//! How much of a frame may come from other frames.

use serde::{Deserialize, Serialize};

/// What a frame takes over from others, and with how much care.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReuseSettings {
    /// What is taken over.
    pub policy: Policy,
    /// Frames from one key frame to the next.
    pub segment: u32,
    /// By how much samples that stand for one another may disagree beyond their noise, display steps
    /// of 1/255; `None` for one step, and less where traced frames are more exact than that.
    pub tolerance: Option<f32>,
    /// Share of an in-between frame's cost that goes into tracing inferred pixels again, to measure
    /// how far off they are.
    pub audit: f32,
    /// Root mean square error of inferred pixels above which they are traced where that is better,
    /// display steps of 1/255; `None` for no bound.
    pub max_rmse: Option<f32>,
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
            tolerance: None,
            audit: 0.03,
            max_rmse: None,
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

/// What frames take over from one another.
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
