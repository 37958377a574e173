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
    /// Whether Embree's code has fused multiply-add, which rounds once instead of twice: on x86 only its code for AVX2
    /// and AVX-512 has.
    pub fn fuses(&self) -> bool {
        #[cfg(target_arch = "x86_64")]
        return match self.isa {
            Some(isa) => matches!(isa, "avx2" | "avx512"),
            None => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
        };
        #[cfg(not(target_arch = "x86_64"))]
        true
    }

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

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;

    #[test]
    fn code_for_processors_before_avx2_does_not_fuse() {
        let fuses = |isa| {
            let quality = Quality::Medium;
            BuildOptions { threads: 1, isa: Some(isa), robust: true, quality, compact: false }
                .fuses()
        };
        let sets = ["sse2", "sse4.2", "avx", "avx2", "avx512"];
        assert_eq!(sets.map(fuses), [false, false, false, true, true]);
    }
}
