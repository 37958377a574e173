//! A range of camera samples against uniform ones that take as many rays.

use super::contract::{FLOOR, mean};
use super::job::Spent;
use super::measure::Pictures;
use super::{Failure, Picture};

/// Rays a frame and mean squared error, in squares of a display step, over the judged in-between frames.
#[derive(Debug, Clone, Copy)]
struct Cost {
    rays: f64,
    mse: f64,
}

impl Cost {
    /// Of the frames of `job`, whose squared errors `squares` gives.
    fn of(
        job: &Spent,
        frames: &[&Pictures],
        squares: impl Fn(&Pictures) -> Result<Vec<f64>, Failure>,
    ) -> Result<Self, Failure> {
        let mut sum = Self { rays: 0.0, mse: 0.0 };
        for p in frames {
            sum.rays += job.rays(p.frame) / frames.len() as f64;
            sum.mse += mean(squares(p)?.into_iter()) / frames.len() as f64;
        }
        Ok(sum)
    }

    /// The error of uniform samples with these rays: between two known numbers of samples, and beyond them, its
    /// logarithm is linear in that of the rays.
    fn at_rays(uniform: &[Self], rays: f64) -> f64 {
        let at = uniform.partition_point(|u| u.rays < rays).clamp(1, uniform.len() - 1);
        let (low, high) = (uniform[at - 1], uniform[at]);
        let tiny = 1e-9;
        let share = (rays / low.rays).ln() / (high.rays / low.rays).ln().max(tiny);
        (low.mse + tiny) * ((high.mse + tiny) / (low.mse + tiny)).powf(share)
    }
}

/// RMSE of the range and of uniform samples with as many rays, display steps: inferred, then traced.
#[derive(Debug, Clone, Copy)]
pub struct EqualRays {
    pub range: [f64; 2],
    pub uniform: [f64; 2],
}

impl EqualRays {
    /// Compares the jobs that infer and trace with moves that `render`, given policy and samples, makes.
    ///
    /// # Errors
    /// Where a render fails or its files cannot be read.
    pub fn new(
        jobs: [&Spent; 2],
        frames: &[&Pictures],
        [least, most]: [usize; 2],
        render: impl Fn(&'static str, usize) -> Result<Spent, Failure>,
    ) -> Result<Self, Failure> {
        let own: [fn(&Pictures) -> &Picture; 2] = [|p| &p.inferred, |p| &p.traced];
        let mut all = Self { range: [0.0; 2], uniform: [0.0; 2] };
        for (k, policy) in ["surface", "off"].into_iter().enumerate() {
            let range = Cost::of(jobs[k], frames, |p| Ok(own[k](p).squares(&p.truth)))?;
            let mut uniform: Vec<Cost> = Vec::new();
            let counts = std::iter::successors(Some(least), |n| Some(2 * n));
            for spp in counts.take_while(|n| *n < 2 * most) {
                let job = render(policy, spp)?;
                let squares = |p: &Pictures| Ok(job.frame(p.frame)?.squares(&p.truth));
                uniform.push(Cost::of(&job, frames, squares)?);
                job.remove_frames()?;
                // More samples cannot be needed.
                if uniform.len() > 1 && uniform.last().is_some_and(|u| u.rays > range.rays) {
                    break;
                }
            }
            all.range[k] = range.mse.sqrt();
            all.uniform[k] = Cost::at_rays(&uniform, range.rays).sqrt();
        }
        Ok(all)
    }

    /// By how many decibels the range is nearer to the truth, inferred and traced; 0 where nobody could see either
    /// error.
    pub fn gains(&self) -> [f64; 2] {
        std::array::from_fn(|k| {
            let (range, uniform) = (self.range[k], self.uniform[k]);
            match range.max(uniform) > FLOOR {
                true => 20.0 * (uniform / range.max(1e-6)).log10(),
                false => 0.0,
            }
        })
    }
}
