//! Check rays: a few shadow rays that an estimate must not contradict before it is used.
//!
//! Estimates of a level of risk may be accurate on average and still be far off at a point whose shadow no
//! sample hit. A fraction of the rays that tracing would take finds such a point.

use super::lookup::steps_per_radiance;
use crate::inference::LookupBatch;

/// An estimate is contradicted when it is off from the mean of its check rays by more than so many standard
/// deviations that this mean would have if the estimate were right.
const MOST_DEVIATIONS: f32 = 2.0;

/// Whether the check rays of point `at` agree with its estimates, all lights up to order `most` together. A difference of up
/// to `tolerance` display steps always agrees.
pub fn agrees(
    batch: &LookupBatch,
    (at, channels): (usize, usize),
    most: u32,
    tolerance: f32,
) -> bool {
    let LookupBatch { unshadowed, estimates, checked, .. } = batch;
    let own = at * channels..(at + 1) * channels;
    let Some(checked) = checked.get(own.clone()) else { return false };
    let lights = unshadowed[own.clone()].iter().zip(&estimates[own]).zip(checked);
    let lights = lights.filter(|((_, estimate), _)| !estimate.ratio.is_nan());
    let (mut estimated, mut further, mut variance, mut rays) = (0.0, 0.0, 0.0, 0);
    for ((unshadowed, estimate), checked) in lights {
        estimated += unshadowed * estimate.ratio;
        if checked.rays > 0 && estimate.order <= most {
            rays += checked.rays;
            further += unshadowed * (checked.ratio - estimate.ratio);
            // A tail's ratio may be above 1, where no ray is blocked.
            let of_ray = (estimate.ratio * (1.0 - estimate.ratio)).max(0.0);
            variance += unshadowed * unshadowed * of_ray / checked.rays as f32;
        }
    }
    let steps = steps_per_radiance(estimated);
    let limit = MOST_DEVIATIONS * MOST_DEVIATIONS * steps * steps * variance;
    rays > 0 && steps * steps * further * further <= limit.max(tolerance * tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{Checked, Estimate, SurfacePoint};
    use crate::math::{DVec3, Vec3};

    /// Whether the estimate `ratio` of a light of radiance 0.5 agrees with `open` unoccluded rays of `rays`.
    fn does_agree(ratio: f32, open: u32, rays: u32) -> bool {
        let (p, n, geom_id, footprint) = (DVec3::ZERO, Vec3::Y, 0, 1.0);
        let point = SurfacePoint { p, n, geom_id, footprint, cos: 1.0, direct: true, samples: 1 };
        let checked = Checked { ratio: open as f32 / rays.max(1) as f32, rays };
        let batch = LookupBatch {
            points: vec![point],
            unshadowed: vec![0.5],
            estimates: vec![Estimate { ratio, level: 0, order: 0 }],
            checked: vec![checked],
            ..LookupBatch::default()
        };
        agrees(&batch, (0, 1), 0, 0.25)
    }

    #[test]
    fn full_light_and_full_shadow_are_contradicted_by_one_ray() {
        assert!(does_agree(1.0, 8, 8) && does_agree(0.0, 0, 8));
        assert!(!does_agree(1.0, 7, 8) && !does_agree(0.0, 1, 8));
    }

    #[test]
    fn half_shadow_is_contradicted_by_many() {
        assert!(does_agree(0.5, 4, 8) && does_agree(0.5, 2, 8) && does_agree(0.5, 6, 8));
        assert!(!does_agree(0.5, 0, 8) && !does_agree(0.5, 8, 8));
    }

    #[test]
    fn a_point_without_check_rays_does_not_agree() {
        assert!(!does_agree(1.0, 0, 0));
    }

    #[test]
    fn a_difference_below_the_tolerance_agrees() {
        assert!(does_agree(1.0, 4095, 4096));
    }
}
