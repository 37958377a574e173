//! The knobs that a sweep turns, and their groups.

use crate::scene::Settings;
use serde::{Deserialize, Serialize};

/// Knobs that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Reuse of light between frames.
    Reuse,
    /// Camera, shadow and sky samples.
    Samples,
    /// Bounces and cut-off.
    Specular,
    /// Rules of intersection.
    Intersection,
    /// How Embree builds its tree.
    Tree,
    /// Embree against the oracle, on a crop.
    Oracle,
    /// Frames and checkpoints on disk.
    Writing,
    /// Samples and reuse together.
    Combinations,
    /// A denoiser, behind frames of few samples.
    Denoiser,
}

impl Group {
    /// All groups.
    pub const ALL: [Self; 9] = [
        Self::Reuse,
        Self::Samples,
        Self::Specular,
        Self::Intersection,
        Self::Tree,
        Self::Oracle,
        Self::Writing,
        Self::Combinations,
        Self::Denoiser,
    ];
}

/// A setting that a candidate changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knob {
    /// No knob: the setting that the others are compared with.
    Default,
    /// Reuse policy.
    Policy,
    /// Tolerance of reuse.
    Tolerance,
    /// Frames from key frame to key frame.
    Segment,
    /// Share of an in-between frame's pixels that are probes.
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
    /// Which hits are computed again in f64 (the recheck).
    Recheck,
    /// Second tries of rays that miss near a triangle.
    Retry,
    /// Embree's robust mode.
    Robust,
    /// Offset of new rays from the surface that they leave.
    SpawnOffset,
    /// Recentring of the scene.
    Recentre,
    /// All rules of intersection about single rays at once.
    AllRules,
    /// Work put into Embree's tree.
    BuildQuality,
    /// A smaller tree.
    Compact,
    /// Several knobs at once.
    Combination,
    /// Denoised frames.
    Denoiser,
}

impl Knob {
    /// The knob's group; `None` for the default.
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
            Self::Denoiser => Group::Denoiser,
        })
    }

    /// The knob's name at the head of a sentence.
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
            Self::Denoiser => "Denoiser",
        }
    }

    /// The name of the setting of these options.
    pub(super) fn name_of(self, options: &str) -> String {
        let options = if options.is_empty() { "default" } else { options };
        format!("{options}{}", if self.is_denoised() { ", denoised" } else { "" })
    }

    /// Whether frames are denoised.
    pub fn is_denoised(self) -> bool {
        self == Self::Denoiser
    }

    /// Whether the knob trades error for time, so that its settings may be recommended. Rules of
    /// intersection guard against rare wrong pixels, which no mean error shows; another tree changes next
    /// to no pixel; fewer probes save time and vouch for less; a denoiser is another program.
    pub fn is_ranked(self) -> bool {
        let group = self.group();
        self != Self::Probes
            && !matches!(group, Some(Group::Intersection | Group::Tree | Group::Denoiser))
    }
}

/// A setting that is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The option, or group of options, in which it differs from the default.
    pub knob: Knob,
    /// Command-line options of the setting; empty for the default.
    pub options: String,
    /// The complete settings that it is rendered with: the default's, changed by `options`.
    pub settings: Settings,
}

impl Candidate {
    /// The setting's name.
    pub fn name(&self) -> String {
        self.knob.name_of(&self.options)
    }
}
