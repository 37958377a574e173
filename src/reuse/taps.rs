//! The samples around a point in each reference: found by where the point is seen, or by place.

use super::index::{Cells, level_of};
use super::lookup::Lookup;
use super::reference::{NONE, Reference, Sample};
use crate::inference::SurfacePoint;
use crate::math::Vec3;

/// Samples that one point's answer is made of, at most.
const MOST_TAPS: usize = 24;
/// Levels of the index that are asked: a point's own, the finer and the coarser one.
const LEVELS: usize = 3;
/// References that are asked about every point.
pub(super) const ALWAYS: usize = 2;

/// A sample that lies on the point's surface.
#[derive(Clone, Copy)]
pub(super) struct Tap {
    pub reference: u32,
    pub sample: u32,
    /// Of 1 that a whole reference gives.
    pub weight: f32,
    /// Weight in means: more alike than the weights, since that averages more of tracing's noise.
    pub share: f32,
    /// From the point to the sample, footprints.
    pub apart: Vec3,
}

/// The samples about a point.
pub(super) struct Taps {
    list: [Tap; MOST_TAPS],
    len: usize,
    pub weight: f64,
}

impl Taps {
    /// None yet.
    pub fn new() -> Self {
        let none = Tap { reference: 0, sample: 0, weight: 0.0, share: 0.0, apart: Vec3::ZERO };
        Self { list: [none; MOST_TAPS], len: 0, weight: 0.0 }
    }

    fn clear(&mut self) {
        self.len = 0;
        self.weight = 0.0;
    }

    fn push(&mut self, reference: u32, sample: u32, weight: f32, apart: Vec3) {
        if self.len < MOST_TAPS && weight > 0.0 {
            // To the power of 3/4.
            let share = weight.sqrt() * weight.sqrt().sqrt();
            self.list[self.len] = Tap { reference, sample, weight, share, apart };
            self.len += 1;
            self.weight += f64::from(weight);
        }
    }

    pub fn iter(&self) -> impl Iterator<Item = &Tap> {
        self.list[..self.len].iter()
    }
}

/// Where a point is seen in a reference.
#[derive(Clone, Copy)]
pub(super) struct Image {
    /// Between the middles of the four pixels around it, pixels.
    fx: f32,
    fy: f32,
    /// A pixel's edge there, scene units.
    footprint: f32,
    /// How far away samples count, footprints.
    reach: f32,
    /// The samples of the four pixels; [`NONE`] where there is none, or one of another mesh.
    samples: [u32; 4],
}

/// A point's images in the references that are asked about every point.
pub(super) type Images = [Option<Image>; ALWAYS];

impl Lookup<'_> {
    /// Finds the images of those of `points` that `is_wanted` wants.
    ///
    /// In two passes, each over all points: most of a lookup's time is waiting for memory, and reads
    /// that do not depend on one another are waited for together.
    pub(super) fn find_images(
        &self,
        points: &[SurfacePoint],
        is_wanted: impl Fn(usize) -> bool,
        images: &mut [Images],
    ) {
        for (k, reference) in self.references.iter().take(ALWAYS).enumerate() {
            for (i, point) in points.iter().enumerate() {
                let wanted = is_wanted(i).then(|| self.image(reference, point));
                images[i][k] = wanted.flatten();
            }
        }
        for (k, reference) in self.references.iter().take(ALWAYS).enumerate() {
            for (images, point) in images.iter_mut().zip(points) {
                images[k].iter_mut().for_each(|image| image.keep_mesh(reference, point.geom_id));
            }
        }
    }

    /// Gathers the samples about `point`, whose `images` are found, in `taps`.
    pub(super) fn gather(&self, point: &SurfacePoint, images: &Images, taps: &mut Taps) {
        taps.clear();
        for (number, reference) in self.references.iter().enumerate() {
            let image = match images.get(number) {
                Some(image) => *image,
                None if taps.weight >= self.evidence.enough_weight => break,
                None => self.image(reference, point),
            };
            if let Some(image) = image {
                self.screen_taps((number as u32, reference), point, &image, taps);
            }
        }
        if !point.direct && taps.weight < self.evidence.enough_weight {
            let own = level_of(point.footprint);
            let cells =
                [own, own - 1, own + 1].map(|level| Cells::around(level, point.geom_id, point.p));
            for (number, reference) in self.references.iter().enumerate() {
                if taps.weight >= self.evidence.enough_weight {
                    break;
                }
                self.index_taps((number as u32, reference), point, &cells, taps);
            }
        }
    }

    /// Where the point is seen in the reference, if that samples finely enough there.
    fn image(&self, reference: &Reference, point: &SurfacePoint) -> Option<Image> {
        let camera = &reference.camera;
        let (x, y, depth) = camera.project(point.p)?;
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (width, height) = (f64::from(camera.width), f64::from(camera.height));
        if !(left >= -1.0 && top >= -1.0 && left < width && top < height) {
            return None;
        }
        let to_eye = camera.eye - point.p;
        let cos = (point.n.as_dvec3().dot(to_eye) / to_eye.length()).max(0.02);
        let footprint = depth * reference.pixel_size;
        let own = f64::from(point.footprint);
        let own_area = own * own / if point.direct { f64::from(point.cos).max(0.02) } else { 1.0 };
        if footprint * footprint / cos > self.evidence.coarser * own_area {
            return None;
        }
        let mut samples = [NONE; 4];
        for (k, sample) in samples.iter_mut().enumerate() {
            let (tx, ty) = (left + (k & 1) as f64, top + (k >> 1) as f64);
            if tx >= 0.0 && ty >= 0.0 && tx < width && ty < height {
                *sample = reference.slots[ty as usize * camera.width as usize + tx as usize];
            }
        }
        let reach = (2.0 / cos.max(self.evidence.grazing)) as f32;
        let (fx, fy) = ((x - left) as f32, (y - top) as f32);
        Some(Image { fx, fy, footprint: footprint as f32, reach, samples })
    }

    /// The four samples around the point's image in the reference.
    fn screen_taps(
        &self,
        (number, reference): (u32, &Reference),
        point: &SurfacePoint,
        image: &Image,
        taps: &mut Taps,
    ) {
        let Image { fx, fy, footprint, reach, samples } = *image;
        for (k, sample) in samples.into_iter().enumerate().filter(|(_, sample)| *sample != NONE) {
            let s = &reference.samples[sample as usize];
            let Some(near) = self.on_surface(point, s, footprint, reach) else { continue };
            let wx = if k & 1 == 1 { fx } else { 1.0 - fx };
            let wy = if k >> 1 == 1 { fy } else { 1.0 - fy };
            let weight = wx * wy * near.alike * near.alike;
            taps.push(number, sample, weight, near.apart);
        }
    }

    /// Samples in the `cells` around the point.
    fn index_taps(
        &self,
        (number, reference): (u32, &Reference),
        point: &SurfacePoint,
        cells: &[Cells; LEVELS],
        taps: &mut Taps,
    ) {
        for cells in cells {
            let reach = cells.edge as f32 / point.footprint;
            for sample in reference.index.members(cells) {
                let s = &reference.samples[sample as usize];
                let Some(near) = self.on_surface(point, s, point.footprint, reach) else {
                    continue;
                };
                let weight = 0.5 * (1.0 - near.distance / reach);
                taps.push(number, sample, weight, near.apart);
            }
        }
    }

    /// Where a sample lies, if on the point's own surface and within `reach` footprints.
    fn on_surface(
        &self,
        point: &SurfacePoint,
        s: &Sample,
        footprint: f32,
        reach: f32,
    ) -> Option<Near> {
        let least = self.evidence.least_cos;
        let cos = s.n.dot(point.n);
        if s.geom_id != point.geom_id || cos < least {
            return None;
        }
        let apart = (s.position() - point.p).as_vec3() / footprint;
        let distance = apart.length();
        let height = apart.dot(point.n).abs();
        let allowed = self.evidence.height + self.evidence.slope * distance;
        let alike = ((cos - least) / (1.0 - least)).min(1.0);
        (distance <= reach && height <= allowed).then_some(Near { apart, distance, alike })
    }
}

/// A sample on the point's surface.
struct Near {
    /// From the point, footprints.
    apart: Vec3,
    distance: f32,
    /// 1 with the point's own normal, 0 where they are as far apart as can be.
    alike: f32,
}

impl Image {
    fn keep_mesh(&mut self, reference: &Reference, geom_id: u32) {
        for sample in self.samples.iter_mut().filter(|sample| **sample != NONE) {
            if reference.samples[*sample as usize].geom_id != geom_id {
                *sample = NONE;
            }
        }
    }
}
