//! Risk of an estimate: a figure for how far it could be off, from the samples around the point.
//!
//! The risk does not predict the error. It is a scale on which estimates are sorted; the errors that probes find
//! decide up to which risk they may be used ([`super::evidence`]).

use crate::math::srgb_encode;

/// Differences of ratios below this count as none, display steps.
const CALM: f32 = 0.25;
/// Steps of the scale, each half an octave of the risk.
pub const STEPS: usize = 24;
/// Half an octave of the risk in its third power.
const HALF_OCTAVE_CUBED: f32 = 2.828_427;
/// Number of steps of all scales. Points seen directly have two scales: one for differences that noise can explain,
/// and one for detail, which noise cannot explain. Points seen in mirrors and through glass have two more. Where brighter
/// lights of the point are left out there are as many again.
pub const LEVELS: usize = 8 * STEPS;
/// A risk above this many standard deviations of tracing's noise is detail, not noise.
const MOST_OF_NOISE: f32 = 6.0;

/// The features of an estimate from which its risk is computed, all lights together. Differences are in display steps, NaN
/// where too few samples are known.
#[derive(Debug, Clone, Copy)]
pub struct Features {
    /// Largest difference between a tap's ratio and the mean of two samples on opposite sides of it: a mean of taps
    /// misses such a bend.
    pub bend: f32,
    /// Largest difference between a tap's ratio and those of the 5 x 5 samples about it.
    pub wide: f32,
    /// Largest `wide` among the 5 x 5 samples about a tap.
    pub far: f32,
    /// Variance of a trace with the taps' ratios if its rays were independent; the real rays are spread
    /// over the light and have less. Squares of a display step.
    pub variance: f32,
    /// Radiance without shadows, exposure applied; takes the place of features that are not known.
    pub unshadowed: f32,
    /// Whether the taps surround the point.
    pub is_whole: bool,
    /// Whether a camera ray ends at the point, not one from a mirror or glass.
    pub is_direct: bool,
    /// Whether brighter lights of the point are left out.
    pub is_part: bool,
}

impl Features {
    /// The features of no light.
    pub fn none(is_direct: bool) -> Self {
        let (bend, wide, far, variance, unshadowed) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let (is_whole, is_part) = (true, false);
        Self { bend, wide, far, variance, unshadowed, is_whole, is_direct, is_part }
    }

    /// Adds further lights of the same point.
    pub fn add(&mut self, other: &Self) {
        self.bend += other.bend;
        self.wide += other.wide;
        self.far += other.far;
        self.variance += other.variance;
        self.unshadowed += other.unshadowed;
        self.is_whole &= other.is_whole;
    }

    /// The level of risk, below [`LEVELS`].
    pub fn level(&self) -> u8 {
        let cubed = self.risk_cubed();
        let mut step = 0;
        let mut limit = CALM * CALM * CALM * HALF_OCTAVE_CUBED;
        while step + 1 < STEPS && cubed >= limit {
            limit *= HALF_OCTAVE_CUBED;
            step += 1;
        }
        let of_noise = (MOST_OF_NOISE * self.variance.sqrt()).max(CALM);
        let is_detail = cubed > of_noise * of_noise * of_noise;
        let [part, indirect, detail] = [self.is_part, !self.is_direct, is_detail].map(usize::from);
        let scale = 4 * part + 2 * indirect + detail;
        (scale * STEPS + step) as u8
    }

    /// Third power of the risk, which is the geometric mean of bend and both contrasts, and twice that where the
    /// taps lie on one side of the point.
    fn risk_cubed(&self) -> f32 {
        let Self { bend, wide, far, .. } = *self;
        let is_known = !(bend + wide + far).is_nan();
        // What is not known may be as large as the light: from full to none. NaN is all that can be shown.
        let most = if is_known { 0.0 } else { shown(self.unshadowed).min(255.0) };
        let or = |x: f32, most: f32| if x.is_nan() { most } else { x }.max(CALM);
        let apart = if self.is_whole { 1.0 } else { 8.0 };
        apart * or(bend, 0.5 * most) * or(wide, most) * or(far, most)
    }
}

/// `radiance` in display steps.
pub fn shown(radiance: f32) -> f32 {
    (255.0 * srgb_encode(f64::from(radiance.clamp(0.0, 1.0)))) as f32
}

/// Whether `level` is one of points that camera rays end at, not rays from mirrors or glass.
pub fn is_direct(level: u8) -> bool {
    usize::from(level) / (2 * STEPS) % 2 == 0
}

/// Whether `level` is one of some of a point's lights, not of all.
pub fn is_part(level: u8) -> bool {
    usize::from(level) >= LEVELS / 2
}

/// The level as risky as `level` of some of a point's lights, or of all.
pub fn of_lights(level: u8, is_part: bool) -> u8 {
    let half = (LEVELS / 2) as u8;
    level % half + if is_part { half } else { 0 }
}

/// The middle of the risks of `level`, display steps.
pub fn risk_of(level: usize) -> f64 {
    let step = (level % STEPS) as f64;
    f64::from(CALM) * (0.5 * (step + 0.5)).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As noisy as can be.
    const CALMEST: Features = Features {
        bend: 0.0,
        wide: 0.0,
        far: 0.0,
        variance: f32::INFINITY,
        unshadowed: 0.5,
        is_whole: true,
        is_direct: true,
        is_part: false,
    };

    #[test]
    fn each_feature_raises_the_risk() {
        assert_eq!(CALMEST.level(), 0);
        let features = Features { bend: 1.0, wide: 2.0, far: 4.0, ..CALMEST };
        // The geometric mean is 2: three octaves above the calm.
        assert_eq!(features.level(), 6);
        let riskier = [
            Features { bend: 4.0, ..features },
            Features { wide: 8.0, ..features },
            Features { far: 16.0, ..features },
            Features { bend: f32::NAN, ..features },
            Features { wide: f32::NAN, ..features },
            Features { far: f32::NAN, ..features },
            Features { is_whole: false, ..features },
        ];
        assert!(riskier.iter().all(|r| r.level() > 6 && usize::from(r.level()) < STEPS));
        let specular = Features { is_direct: false, ..features };
        assert_eq!(usize::from(specular.level()), 2 * STEPS + 6);
    }

    #[test]
    fn detail_has_a_scale_of_its_own() {
        let even = |risk| Features { bend: risk, wide: risk, far: risk, variance: 1.0, ..CALMEST };
        let scale = |features: Features| usize::from(features.level()) / STEPS;
        assert_eq!([5.9, 6.1].map(|risk| scale(even(risk))), [0, 1]);
        let specular = |risk| Features { is_direct: false, ..even(risk) };
        assert_eq!([5.9, 6.1].map(|risk| scale(specular(risk))), [2, 3]);
        assert!(is_direct(even(6.1).level()) && !is_direct(specular(5.9).level()));
        // Where nothing differs there is nothing to tell apart.
        assert_eq!(Features { variance: 0.0, ..even(0.0) }.level(), 0);
    }

    #[test]
    fn the_scale_has_two_ends() {
        let most = Features { bend: 1e9, wide: 1e9, far: 1e9, variance: 0.0, ..CALMEST };
        let most = Features { is_direct: false, is_part: true, ..most };
        assert_eq!(usize::from(most.level()), LEVELS - 1);
        assert_eq!(of_lights((LEVELS - 1) as u8, false), (LEVELS / 2 - 1) as u8);
        assert!(is_part(most.level()) && !is_direct(most.level()));
        let infinite = Features { bend: f32::INFINITY, ..CALMEST };
        assert_eq!(usize::from(infinite.level()), STEPS - 1);
    }

    #[test]
    fn the_risk_of_a_level_lies_in_that_level() {
        for step in 0..STEPS {
            let risk = risk_of(step) as f32;
            let even = Features { bend: risk, wide: risk, far: risk, ..CALMEST };
            assert_eq!(usize::from(even.level()), step);
        }
    }
}
