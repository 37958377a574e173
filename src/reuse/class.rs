//! Classes of estimates: what a lookup can say about its own answer, without any claim how good it is.
//!
//! Whether a class may be used is decided by what probes of it find ([`super::evidence`]).

/// Largest difference that shows as nothing, display steps.
const CALM: f32 = 0.25;
/// Limits of the bins of the contrast, display steps.
const CONTRAST: [f32; 3] = [2.0, 8.0, 32.0];
/// Limits of the bins of the bend, display steps.
const BEND: [f32; 4] = [CALM, 1.0, 4.0, 16.0];

/// Bins of contrast, bend, and the two other features.
const BINS: [u8; 4] = [7, 6, 2, 2];
/// The bins of what is not known.
const UNKNOWN_CONTRAST: u8 = BINS[0] - 1;
const UNKNOWN_BEND: u8 = BINS[1] - 1;

/// How many classes there are.
pub const CLASSES: usize = {
    let [a, b, c, d] = BINS;
    a as usize * b as usize * c as usize * d as usize
};

/// What a lookup sees of a light at a point. Where too few samples are known, NaN.
#[derive(Debug, Clone, Copy)]
pub struct Features {
    /// Standard deviation of the taps' ratios, display steps.
    pub spread: f32,
    /// By how much a tap's ratio is off the mean of those on opposite sides of it, at most, display
    /// steps: what bends there is what a mean of taps misses.
    pub bend: f32,
    /// Largest difference between a tap's ratio and those of the 5 x 5 samples about it, display steps.
    pub wide: f32,
    /// The same of the 9 x 9 samples.
    pub far: f32,
    /// Whether the taps surround the point.
    pub is_whole: bool,
    /// Whether a camera ray ends at the point, not one from a mirror or glass.
    pub is_direct: bool,
}

impl Features {
    /// The class, below [`CLASSES`].
    pub fn class(&self) -> u8 {
        let bend = if self.bend.is_nan() { UNKNOWN_BEND } else { bin(&BEND, self.bend) };
        let bins = [self.contrast(), bend, u8::from(!self.is_whole), u8::from(!self.is_direct)];
        BINS.iter().zip(bins).fold(0, |class, (count, bin)| class * count + bin)
    }

    fn contrast(&self) -> u8 {
        match (self.far.max(self.spread), self.wide.max(self.spread)) {
            _ if self.wide.is_nan() => UNKNOWN_CONTRAST,
            (far, _) if far <= CALM => 0,
            (_, wide) if wide <= CALM => 1,
            (_, wide) => 2 + bin(&CONTRAST, wide),
        }
    }
}

/// The family of a class: classes that differ in the contrast alone, if that is known. Where a class
/// has few probes, its family stands in.
pub fn family(class: u8) -> u8 {
    let [_, bends, wholes, directs] = BINS;
    let of_contrast = bends * wholes * directs;
    let is_unknown = class / of_contrast == UNKNOWN_CONTRAST;
    class % of_contrast + if is_unknown { of_contrast } else { 0 }
}

/// Whether estimates of `class` are of points seen directly.
pub fn is_direct(class: u8) -> bool {
    class % BINS[3] == 0
}

/// A squared error that a class may hide, squares of a display step: as large as its contrast.
pub fn hidden_error(class: u8) -> f64 {
    let [_, bends, wholes, directs] = BINS;
    let contrast = class / (bends * wholes * directs);
    let steps = [CALM, 1.0, CONTRAST[0], CONTRAST[1], CONTRAST[2], 2.0 * CONTRAST[2], CONTRAST[2]];
    let steps = f64::from(steps[usize::from(contrast)]);
    steps * steps
}

/// Number of the bin between `limits` that `x` lies in.
fn bin(limits: &[f32], x: f32) -> u8 {
    limits.iter().filter(|limit| x > **limit).count() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    const CALMEST: Features =
        Features { spread: 0.0, bend: 0.0, wide: 0.0, far: 0.0, is_whole: true, is_direct: true };

    #[test]
    fn each_feature_makes_a_class_of_its_own() {
        let all = [
            CALMEST,
            Features { spread: 1.0, ..CALMEST },
            Features { far: 9.0, ..CALMEST },
            Features { wide: 3.0, far: 3.0, ..CALMEST },
            Features { wide: 9.0, far: 9.0, ..CALMEST },
            Features { wide: 99.0, far: 99.0, ..CALMEST },
            Features { wide: f32::NAN, ..CALMEST },
            Features { bend: 0.5, ..CALMEST },
            Features { bend: 3.0, ..CALMEST },
            Features { bend: 9.0, ..CALMEST },
            Features { bend: 99.0, ..CALMEST },
            Features { bend: f32::NAN, ..CALMEST },
            Features { is_whole: false, ..CALMEST },
            Features { is_direct: false, ..CALMEST },
        ];
        let classes: std::collections::BTreeSet<u8> = all.iter().map(Features::class).collect();
        assert_eq!(classes.len(), all.len());
        assert!(classes.iter().all(|class| usize::from(*class) < CLASSES));
    }

    #[test]
    fn a_family_differs_in_contrast_alone() {
        let of = |features: Features| family(features.class());
        assert_eq!(of(CALMEST), of(Features { wide: 9.0, far: 9.0, ..CALMEST }));
        let others = [
            Features { wide: f32::NAN, ..CALMEST },
            Features { bend: 0.5, ..CALMEST },
            Features { is_whole: false, ..CALMEST },
            Features { is_direct: false, ..CALMEST },
        ];
        assert!(others.iter().all(|other| of(*other) != of(CALMEST)));
    }
}
