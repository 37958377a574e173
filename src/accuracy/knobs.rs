//! What can be turned, and what belongs together.

use crate::scene::Settings;
use serde::{Deserialize, Serialize};

/// Knobs that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// What frames take over from one another.
    Reuse,
    /// Camera, shadow and sky samples.
    Samples,
    /// Bounces and cut-off.
    Specular,
    /// The rules that make hits trustworthy.
    Intersection,
    /// How Embree builds its tree.
    Tree,
    /// Embree against the oracle, on a crop.
    Oracle,
    /// Frames and checkpoints on disk.
    Writing,
    /// Samples and reuse together.
    Combinations,
}

impl Group {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Reuse,
        Self::Samples,
        Self::Specular,
        Self::Intersection,
        Self::Tree,
        Self::Oracle,
        Self::Writing,
        Self::Combinations,
    ];
}

/// What a candidate turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// Nothing: what the others are compared with.
    Default,
    /// What frames take over.
    Policy,
    /// What error is not seen.
    Tolerance,
    /// Frames from key frame to key frame.
    Segment,
    /// Share of the pixels that is probed.
    Probes,
    /// Camera samples.
    CameraSamples,
    /// Shadow samples.
    ShadowSamples,
    /// Sky samples.
    SkySamples,
    /// Bounces.
    Bounces,
    /// Cut-off of dim branches.
    CutOff,
    /// Which hits are computed again in f64.
    Recheck,
    /// Second tries.
    Retry,
    /// Embree's robust mode.
    Robust,
    /// Where new rays start.
    SpawnOffset,
    /// The scene about its own centre.
    Recentre,
    /// All rules about single rays at once.
    AllRules,
    /// Work put into Embree's tree.
    BuildQuality,
    /// A smaller tree.
    Compact,
    /// Several at once.
    Combination,
}

impl Knob {
    /// Its group; `None` of the default.
    pub fn group(self) -> Option<Group> {
        Some(match self {
            Self::Default => return None,
            Self::Policy | Self::Tolerance | Self::Segment | Self::Probes => Group::Reuse,
            Self::CameraSamples | Self::ShadowSamples | Self::SkySamples => Group::Samples,
            Self::Bounces | Self::CutOff => Group::Specular,
            Self::Recheck
            | Self::Retry
            | Self::Robust
            | Self::SpawnOffset
            | Self::Recentre
            | Self::AllRules => Group::Intersection,
            Self::BuildQuality | Self::Compact => Group::Tree,
            Self::Combination => Group::Combinations,
        })
    }

    /// Its name at the head of a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "Default",
            Self::Policy => "Reuse policy",
            Self::Tolerance => "Tolerance of reuse",
            Self::Segment => "Frames per segment",
            Self::Probes => "Probes",
            Self::CameraSamples => "Camera samples",
            Self::ShadowSamples => "Shadow samples",
            Self::SkySamples => "Sky samples",
            Self::Bounces => "Bounces",
            Self::CutOff => "Cut-off",
            Self::Recheck => "Recheck in f64",
            Self::Retry => "Second tries",
            Self::Robust => "Embree's robust mode",
            Self::SpawnOffset => "Offset of new rays",
            Self::Recentre => "Recentring",
            Self::AllRules => "All rules at once",
            Self::BuildQuality => "Quality of Embree's tree",
            Self::Compact => "Compact tree",
            Self::Combination => "Combinations",
        }
    }

    /// Whether it trades error for time, so that its settings may be recommended. Rules of
    /// intersection guard against rare wrong pixels, which no mean error shows, and another tree changes
    /// next to none.
    pub fn is_ranked(self) -> bool {
        !matches!(self.group(), Some(Group::Intersection | Group::Tree))
    }
}

/// A setting that is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What it turns.
    pub knob: Knob,
    /// The options that turn it, as the command line has them; empty for the default.
    pub options: String,
    /// All settings.
    pub settings: Settings,
}
