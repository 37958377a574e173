//! How Embree builds its scene.

use embree4_sys as sys;

/// How Embree builds its scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BuildOptions<'a> {
    /// Threads for the build.
    pub threads: usize,
    /// Instruction set ("avx2"), or `None` for the machine's best.
    pub isa: Option<&'a str>,
    /// ROBUST traversal.
    pub robust: bool,
    /// Work put into the tree.
    pub quality: Quality,
    /// A smaller tree, slower to trace.
    pub compact: bool,
}

/// How much work goes into the tree (Embree's `RTCBuildQuality`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Quality {
    /// Morton order.
    Low,
    /// Surface area heuristic.
    #[default]
    Medium,
    /// Surface area heuristic with spatial splits.
    High,
}

impl BuildOptions<'_> {
    pub(super) fn flags(&self) -> sys::RTCSceneFlags {
        let flag = |is_set, flag| if is_set { flag } else { sys::RTC_SCENE_FLAG_NONE };
        flag(self.robust, sys::RTC_SCENE_FLAG_ROBUST)
            | flag(self.compact, sys::RTC_SCENE_FLAG_COMPACT)
    }

    pub(super) fn build_quality(&self) -> sys::RTCBuildQuality {
        match self.quality {
            Quality::Low => sys::RTC_BUILD_QUALITY_LOW,
            Quality::Medium => sys::RTC_BUILD_QUALITY_MEDIUM,
            Quality::High => sys::RTC_BUILD_QUALITY_HIGH,
        }
    }
}
