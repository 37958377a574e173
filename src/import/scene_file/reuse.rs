//! `[reuse]`: what frames take over from one another.

use super::at::At;
use super::number::{Amount, Int, Share, Steps};
use super::region::Region;
use super::report::Source;
use super::settings::shortest;
use crate::error::Result;
use crate::math::Bounds3;
use crate::scene::{Policy, ReuseSettings, limits};
use schemars::JsonSchema;
use serde::Deserialize;

/// What frames reuse of one another. The command line's options of the same names take precedence.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct Reuse {
    /// What is reused: shadowing at surface points, as far as measured errors allow ("surface"), the colours
    /// of pixels ("colour"), or nothing, so that every frame is traced ("off").
    policy: Policy,
    /// Frames from one key frame to the next.
    segment: Int<1, { limits::MAX_SEGMENT as i64 }>,
    /// By how much inferred pixels may be off even where traced ones are more accurate, display steps of 1/255:
    /// root mean square over any tile of 32 x 32 pixels. Less is more accurate and slower.
    tolerance: Steps,
    /// Share of the pixels of an in-between frame that are estimated and also traced: the errors found decide
    /// what is inferred.
    probes: Share,
    /// Colour policy: cached colours agree within this linear difference.
    colour_epsilon: Amount,
    /// Colour policy: cached distances agree within this share of the distance.
    distance_epsilon: Amount,
    /// Boxes in which light is traced in every frame.
    traced: Vec<At<Region>>,
}

impl Default for Reuse {
    fn default() -> Self {
        let r = ReuseSettings::default();
        Self {
            policy: r.policy,
            segment: Int::clamped(r.segment.into()),
            tolerance: Steps(shortest(r.tolerance)),
            probes: Share(shortest(r.probes)),
            colour_epsilon: Amount(shortest(r.colour_epsilon)),
            distance_epsilon: Amount(shortest(r.distance_epsilon)),
            traced: Vec::new(),
        }
    }
}

impl Reuse {
    /// The boxes of `traced`, world space.
    ///
    /// Errors: `min` not below `max` on an axis.
    pub fn regions(&self, source: &Source) -> Result<Vec<Bounds3>> {
        self.traced.iter().map(|region| region.bounds(source)).collect()
    }

    /// As scene data.
    pub fn build(&self) -> ReuseSettings {
        ReuseSettings {
            policy: self.policy,
            segment: self.segment.u32(),
            tolerance: self.tolerance.0 as f32,
            probes: self.probes.0 as f32,
            colour_epsilon: self.colour_epsilon.0 as f32,
            distance_epsilon: self.distance_epsilon.0 as f32,
        }
    }
}
