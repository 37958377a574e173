//! The lights of a frame.

use super::light::LightSampler;
use crate::stats::RayKind;

/// A light that shines in this frame.
pub(super) struct LightSource {
    pub sampler: LightSampler,
    /// Its number among the scene's lights, the sky last.
    pub number: u32,
    /// Shadow rays of one camera sample.
    pub samples: u32,
    /// Shadow rays of one camera sample that are cast before: where these find the same all around, there are no
    /// others. As many as `samples` if there are none.
    pub pilots: u32,
    /// What its shadow rays count as.
    pub rays: RayKind,
    /// The channel of its ratio, if that is kept; where lights are selected, every point has channels of its own.
    pub channel: Option<u16>,
    /// Whether its ratio is kept.
    pub is_kept: bool,
}

impl LightSource {
    /// Whether it is the sky.
    pub fn is_sky(&self) -> bool {
        self.rays == RayKind::ShadowSky
    }

    /// Whether its samples are drawn at random: a delta light has one.
    pub fn is_sampled(&self) -> bool {
        self.rays != RayKind::ShadowDelta
    }
}
