//! What adds up to a frame's squared error, and by which powers of the samples it falls.
//!
//! Squared errors of independent causes add. So a traced frame's is foretold, in squares of a display
//! step, by
//!
//! ```text
//! camera · n^-a  +  n^-p · (shadow · s^-q + sky · k^-q)  +  what samples do not mend
//! ```
//!
//! with n camera samples, s shadow and k sky samples each. A frame between takes over ratios, so its
//! light's part is `kept` of the traced one's, plus a floor.

use super::fit::fit;
use serde::{Deserialize, Serialize};

/// Samples a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Samples {
    /// Camera samples.
    pub spp: u32,
    /// Shadow samples of each, per light.
    pub shadow: u32,
    /// Sky samples of each.
    pub sky: u32,
}

/// The powers that all frames of a move share.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Powers {
    camera: f64,
    /// Of the light's part, with the camera samples.
    light: f64,
    /// Of the light's part, with the samples of each.
    samples: f64,
}

/// A frame's amplitudes: squared error at one sample of everything, display steps.
type Amplitudes = [f64; 3];

/// The law of a move's traced frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Law {
    powers: Powers,
    frames: Vec<Amplitudes>,
    /// Root mean square of what the law misses the measurements by, as a share of them.
    pub misfit: f64,
}

/// What a frame's error is made of, squares of a display step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parts {
    /// Edges, textures, mirrored edges.
    pub camera: f64,
    /// Noise of area lights and sky.
    pub light: f64,
}

/// A measured error: samples, and for each frame the mean squared difference from the reference.
pub type Point = (Samples, Vec<f64>);

impl Powers {
    fn regressors(&self, s: Samples) -> Amplitudes {
        let n = f64::from(s.spp);
        let light = n.powf(-self.light);
        let each = |count: u32| light * f64::from(count.max(1)).powf(-self.samples);
        [n.powf(-self.camera), each(s.shadow), each(s.sky)]
    }
}

impl Law {
    /// The law that comes nearest to `points`, as shares of them. `reference` are the samples of what
    /// they were held against, whose own error is part of every difference.
    pub fn of(points: &[Point], reference: Samples) -> Self {
        let frames = points.first().map_or(0, |(_, errors)| errors.len());
        let mut best = Self {
            powers: Powers { camera: 1.0, light: 1.0, samples: 1.0 },
            frames: vec![[0.0; 3]; frames],
            misfit: f64::INFINITY,
        };
        for camera in grid(0.5, 2.0) {
            for light in grid(0.5, 1.6) {
                for samples in grid(0.5, 2.0) {
                    let law = Self::with(Powers { camera, light, samples }, points, reference);
                    if law.misfit < best.misfit {
                        best = law;
                    }
                }
            }
        }
        best
    }

    fn with(powers: Powers, points: &[Point], reference: Samples) -> Self {
        let own = powers.regressors(reference);
        let rows = points.iter().map(|(samples, _)| {
            let mut row = powers.regressors(*samples);
            row.iter_mut().zip(own).for_each(|(x, own)| *x += own);
            row
        });
        let rows: Vec<Amplitudes> = rows.collect();
        let count = points.first().map_or(0, |(_, errors)| errors.len());
        let (mut frames, mut squares) = (Vec::new(), 0.0);
        for frame in 0..count {
            let measured: Vec<f64> = points.iter().map(|(_, errors)| errors[frame]).collect();
            let (amplitudes, misfit) = fit(&rows, &measured);
            frames.push(amplitudes);
            squares += misfit * misfit;
        }
        Self { powers, frames, misfit: (squares / count.max(1) as f64).sqrt() }
    }

    /// For each frame looked at, what its error is made of.
    pub fn parts(&self, samples: Samples) -> impl Iterator<Item = Parts> + '_ {
        let [n, shadow, sky] = self.powers.regressors(samples);
        self.frames.iter().map(move |[camera, by_shadow, by_sky]| Parts {
            camera: camera * n,
            light: by_shadow * shadow + by_sky * sky,
        })
    }

    /// The law of frames whose errors are all `factor` times as large.
    pub fn times(&self, factor: f64) -> Self {
        let mut law = self.clone();
        law.frames.iter_mut().flatten().for_each(|amplitude| *amplitude *= factor);
        law
    }
}

fn grid(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let steps = ((to - from) / 0.1_f64).round() as u32;
    (0..=steps).map(move |k| from + 0.1 * f64::from(k))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFERENCE: Samples = Samples { spp: 128, shadow: 16, sky: 16 };

    fn truth(s: Samples, scale: f64) -> f64 {
        let (n, m, k) = (f64::from(s.spp), f64::from(s.shadow), f64::from(s.sky));
        let light = n.powf(-1.1) * (7.0 * m.powf(-1.4) + 3.0 * k.powf(-1.4));
        scale * (20.0 * n.powf(-1.3) + light)
    }

    /// From errors of up to 16 samples, each off by up to 5 %, those of up to 64 are foretold.
    #[test]
    fn a_short_sweep_foretells_settings_that_were_not_in_it() {
        let point = |(i, (spp, shadow, sky)): (usize, (u32, u32, u32))| {
            let s = Samples { spp, shadow, sky };
            let off = 1.0 + 0.05 * [1.0, -1.0, 0.3, -0.6][i % 4];
            let error = |scale: f64| (truth(s, scale) + truth(REFERENCE, scale)) * off;
            (s, vec![error(1.0), error(2.0)])
        };
        let design =
            [(1, 1, 1), (4, 1, 1), (16, 1, 1), (4, 16, 1), (4, 1, 16), (4, 4, 4), (16, 16, 16)];
        let points: Vec<Point> = design.into_iter().enumerate().map(point).collect();
        let law = Law::of(&points, REFERENCE);
        assert!(law.misfit < 0.05, "{law:?}");
        for (spp, shadow, sky) in [(2, 2, 8), (8, 32, 4), (32, 4, 4), (64, 64, 64)] {
            let s = Samples { spp, shadow, sky };
            for (parts, scale) in law.parts(s).zip([1.0, 2.0]) {
                let ratio = (parts.camera + parts.light) / truth(s, scale);
                assert!((0.8..1.25).contains(&ratio), "{s:?}: {ratio}");
            }
        }
        let twice: Vec<Parts> = law.times(2.0).parts(REFERENCE).collect();
        let once: Vec<Parts> = law.parts(REFERENCE).collect();
        assert!((twice[0].camera / once[0].camera - 2.0).abs() < 1e-12);
    }

    #[test]
    fn an_effect_that_is_not_there_has_no_part() {
        let point = |spp: u32, shadow: u32| {
            let s = Samples { spp, shadow, sky: 1 };
            (s, vec![9.0 / f64::from(spp) + 9.0 / 128.0])
        };
        let points = [point(1, 1), point(4, 1), point(16, 1), point(4, 16), point(16, 16)];
        let law = Law::of(&points, REFERENCE);
        for parts in law.parts(Samples { spp: 8, shadow: 1, sky: 1 }) {
            assert!(parts.light < 0.02 && (parts.camera - 9.0 / 8.0).abs() < 0.02, "{parts:?}");
        }
    }
}
