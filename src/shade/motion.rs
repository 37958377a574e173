//! Motion vectors: where what a pixel shows stood in the frame before.
//!
//! Computed from the records of a finished film, not while it is traced: frames with the same camera
//! share one tracing, but not the camera before them.

use super::pixels::{film_sampler, lens_positions, offsets_of};
use super::{Renderer, pixel_filter};
use crate::film::Film;
use crate::inference::SAMPLES_TOGETHER;
use crate::math::Vec2;
use crate::scene::Camera;
use rayon::prelude::*;

impl Renderer<'_> {
    /// Fills in [`GBuffer::motion`](crate::film::GBuffer::motion) of a film seen by `camera`, on the
    /// current rayon pool: zero without a `previous` camera. Both in world space. Pixels outside of
    /// the crop have none, and a film without records is left as it is.
    pub fn note_motion(&self, camera: &Camera, previous: Option<&Camera>, film: &mut Film) {
        let width = film.width.max(1) as usize;
        let Some(gbuffer) = &mut film.gbuffer else { return };
        let Some(previous) = previous else { return gbuffer.motion.fill(Vec2::ZERO) };
        let is_wanted = |x: u32, y: u32| {
            let inside =
                |c: &crate::scene::Rect| (c.x0..c.x1).contains(&x) && (c.y0..c.y1).contains(&y);
            self.settings.crop.as_ref().is_none_or(inside)
        };
        let rows = gbuffer.motion.par_chunks_mut(width).zip(gbuffer.depth.par_chunks(width));
        rows.enumerate().for_each(|(y, (motion, depth))| {
            let y = y as u32;
            for ((x, out), depth) in (0..).zip(motion).zip(depth) {
                let moved = is_wanted(x, y)
                    .then(|| displacement(camera, previous, &self.nearest(camera, x, y), *depth));
                *out = moved.flatten().unwrap_or_default();
            }
        });
    }

    /// The camera sample nearest the pixel's middle, the one that is recorded.
    fn nearest(&self, camera: &Camera, x: u32, y: u32) -> CameraSample {
        let filter = pixel_filter(self.settings.filter);
        let sampler = film_sampler(self.settings.seed, x, y);
        let mut best = (f64::INFINITY, [0.0; 2], 0);
        // Samples that only some pixels take are not recorded.
        let (spp, most) = (self.settings.spp, self.settings.most_camera_samples());
        for first in (0..spp).step_by(SAMPLES_TOGETHER as usize) {
            let chunk = first..first.saturating_add(SAMPLES_TOGETHER).min(spp);
            for (sample, [dx, dy]) in (first..).zip(offsets_of(most, &filter, &sampler, chunk)) {
                let distance = dx * dx + dy * dy;
                if distance < best.0 {
                    best = (distance, [dx, dy], sample);
                }
            }
        }
        let (_, [dx, dy], sample) = best;
        let mut lens = [0.5; 2];
        if camera.lens.is_sampled() {
            lens_positions(&sampler, sample..sample + 1).for_each(|u| lens = u);
        }
        CameraSample { image: (f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy), lens }
    }
}

/// A camera sample of a pixel.
struct CameraSample {
    /// Image point, pixels.
    image: (f64, f64),
    /// Where its ray passes the lens, in the unit square.
    lens: [f64; 2],
}

/// Where what `camera` sees with `sample`, `depth` along its view axis, stood in `previous`'s image, less
/// where it stands; y up. `None` behind `previous`. Both are what the lenses' middles see.
fn displacement(
    camera: &Camera,
    previous: &Camera,
    sample: &CameraSample,
    depth: f32,
) -> Option<Vec2> {
    let (x, y) = sample.image;
    let (offset, direction) = camera.through_lens(x, y, sample.lens);
    let direction = direction.normalize();
    let (to, from) = if depth.is_finite() {
        let to = offset + direction * (f64::from(depth) / direction.dot(camera.forward));
        (to, to + (camera.eye - previous.eye))
    } else {
        (direction, direction)
    };
    // Projected twice, so that a camera that stands still gives zero, not a rounding error.
    let (now, then) = (camera.project_from_eye(to)?, previous.project_from_eye(from)?);
    let moved = Vec2::new((then.0 - now.0) as f32, (now.1 - then.1) as f32);
    moved.is_finite().then_some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;
    use crate::scene::Pose;

    fn camera(x: f64, towards: DVec3) -> Camera {
        let eye = DVec3::new(x, 0.0, 0.0);
        let pose = Pose { eye, target: eye + towards, up: DVec3::Y, roll_degrees: 0.0 };
        Camera::new(&pose, 60.0, 64, 48).expect("a camera")
    }

    fn seen(image: (f64, f64)) -> CameraSample {
        CameraSample { image, lens: [0.5; 2] }
    }

    #[test]
    fn a_camera_that_stands_still_moves_nothing_at_all() {
        let still = camera(3.7, DVec3::new(0.3, 0.1, -1.0));
        for (i, depth) in [1e-6, 0.3, 7.0, 1e20, f32::INFINITY].into_iter().enumerate() {
            let at = (3.1 + 11.0 * i as f64, 40.3 - 7.0 * i as f64);
            assert_eq!(displacement(&still, &still, &seen(at), depth), Some(Vec2::ZERO));
        }
    }

    #[test]
    fn a_shift_moves_what_is_near_and_leaves_the_sky() {
        // From x = 0 to x = 0.5: what lies at depth d moved left by 0.5/d, so it stood to the right.
        let (now, then) = (camera(0.5, -DVec3::Z), camera(0.0, -DVec3::Z));
        let focal = 24.0 / 30f64.to_radians().tan();
        for depth in [1.0, 4.0f32] {
            let moved = displacement(&now, &then, &seen((20.5, 11.5)), depth).expect("in front");
            let expected = focal * 0.5 / f64::from(depth);
            assert!((f64::from(moved.x) - expected).abs() < 1e-4 && moved.y.abs() < 1e-5);
        }
        let sky = displacement(&now, &then, &seen((20.5, 11.5)), f32::INFINITY);
        assert_eq!(sky, Some(Vec2::ZERO));
    }

    #[test]
    fn a_tilt_upwards_moves_the_sky_down_since_then() {
        // The middle of the image looks up by 0.1; in the frame before that stood above the middle.
        let tilted = DVec3::new(0.0, 0.1f64.sin(), -(0.1f64.cos()));
        let (now, then) = (camera(0.0, tilted), camera(0.0, -DVec3::Z));
        let moved =
            displacement(&now, &then, &seen((32.0, 24.0)), f32::INFINITY).expect("in front");
        let expected = 24.0 / 30f64.to_radians().tan() * 0.1f64.tan();
        assert!((f64::from(moved.y) - expected).abs() < 1e-4 && moved.x.abs() < 1e-5, "{moved}");
        let behind = camera(0.0, DVec3::Z);
        assert_eq!(displacement(&now, &behind, &seen((32.0, 24.0)), 3.0), None);
    }
}
