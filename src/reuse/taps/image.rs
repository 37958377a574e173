//! The image of a point in a reference, and the samples around it.

use super::{Place, References, TOGETHER, Taps4};
use crate::inference::SurfacePoint;
use crate::reuse::reference::Reference;
use wide::f32x4;

/// Number of references that are searched for every point.
pub(in crate::reuse) const ALWAYS: usize = 2;

/// Largest area of a sample on the surface, as a multiple of the point's own area.
const COARSEST: f64 = 6.0;
/// Samples lie within two footprints, and further where the reference sees the surface at a grazing angle, down to
/// this cosine.
const GRAZING: f32 = 0.3;

/// The image of a point in a reference.
#[derive(Clone, Copy)]
pub(super) struct Image {
    /// Position between the middles of the four pixels around the image, from 0 to 1; likewise `fy`.
    fx: f32,
    fy: f32,
    /// Edge of a pixel on the surface, scene units.
    footprint: f32,
    /// Largest distance of samples that count, footprints.
    reach: f32,
    /// The samples of the four pixels; `NONE` where a pixel has none.
    samples: [u32; 4],
}

/// A point's images in the references that are searched for every point.
type Images = [Option<Image>; ALWAYS];

impl References<'_> {
    /// Finds the samples about each of `points` for which `is_wanted` holds, in the references that are searched
    /// for every point.
    ///
    /// Makes two passes over all points: most of a lookup's time is waiting for memory, and independent
    /// reads are waited for together.
    pub(in crate::reuse) fn find(
        &self,
        points: &[SurfacePoint],
        is_wanted: impl Fn(usize) -> bool,
        found: &mut [[Option<Taps4>; ALWAYS]],
    ) {
        let mut images: [Images; TOGETHER] = [[None; ALWAYS]; TOGETHER];
        for (k, reference) in self.0.iter().take(ALWAYS).enumerate() {
            for (i, point) in points.iter().enumerate() {
                images[i][k] = is_wanted(i).then(|| self.image(reference, point)).flatten();
            }
        }
        for ((point, images), found) in points.iter().zip(&images).zip(found) {
            let place = Place::of(point);
            for (k, (image, found)) in images.iter().zip(found).enumerate() {
                *found = image.as_ref().and_then(|image| self.screen_taps(k, &place, image));
            }
        }
    }

    /// The image of the point in the reference, if the reference samples finely enough there.
    pub(super) fn image(&self, reference: &Reference, point: &SurfacePoint) -> Option<Image> {
        let view = &reference.view;
        let to = point.p - view.eye;
        let depth = to.dot(view.forward);
        let per_depth = 1.0 / depth;
        let x = view.middle[0] + to.dot(view.right) * per_depth;
        let y = view.middle[1] - to.dot(view.up) * per_depth;
        let [width, height] = view.size;
        // NaN is nowhere.
        let is_seen = x >= -1.0 && y >= -1.0 && x < f64::from(width) && y < f64::from(height);
        if !(is_seen && depth > 0.0) {
            return None;
        }
        let to = to.as_vec3();
        let cos = (-point.n.dot(to) / to.length()).max(0.02);
        let footprint = depth * view.pixel_size;
        let own = f64::from(point.footprint);
        let own_cos = if point.direct { f64::from(point.cos).max(0.02) } else { 1.0 };
        if footprint * footprint * own_cos > COARSEST * own * own * f64::from(cos) {
            return None;
        }
        // One up, so that rounding towards zero is rounding down.
        let (left, top) = ((x + 1.0) as i32 - 1, (y + 1.0) as i32 - 1);
        let seen_at = |dx, dy| reference.seen_at(left + dx, top + dy);
        let samples = [seen_at(0, 0), seen_at(1, 0), seen_at(0, 1), seen_at(1, 1)];
        let reach = 2.0 / cos.max(GRAZING);
        let (fx, fy) = ((x - f64::from(left)) as f32, (y - f64::from(top)) as f32);
        Some(Image { fx, fy, footprint: footprint as f32, reach, samples })
    }

    /// The four samples around a point's image in a reference.
    pub(super) fn screen_taps(&self, number: usize, place: &Place, image: &Image) -> Option<Taps4> {
        let Image { fx, fy, footprint, reach, samples } = *image;
        let reference = self.0[number];
        let near = place.near(reference, &samples, (footprint, reach));
        let across = f32x4::from([1.0 - fx, fx, 1.0 - fx, fx]);
        let down = f32x4::from([1.0 - fy, 1.0 - fy, fy, fy]);
        let weight = across * down * near.alike * near.alike;
        Taps4::new(number as u32, samples, weight, &near)
    }
}
