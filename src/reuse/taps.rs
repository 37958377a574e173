//! The samples around a point in each reference: found by where the point is seen, or by place.

use super::index::{Cells, level_of};
use super::lookup::Lookup;
use super::reference::{NONE, Reference, Sample};
use crate::inference::SurfacePoint;
use crate::math::{DVec3, Vec3};

/// Samples that one point's answer is made of, at most.
const MOST_TAPS: usize = 24;
/// References that are asked about every point.
pub(super) const ALWAYS: usize = 2;

/// A sample that lies on the point's surface.
#[derive(Clone, Copy)]
pub(super) struct Tap {
    pub reference: u32,
    pub sample: u32,
    pub weight: f32,
    /// From the point to the sample, footprints.
    pub apart: Vec3,
}

#[derive(Clone, Copy)]
pub(super) struct Taps {
    list: [Tap; MOST_TAPS],
    len: usize,
    pub weight: f64,
}

impl Taps {
    const NONE: Self = Self {
        list: [Tap { reference: 0, sample: 0, weight: 0.0, apart: Vec3::ZERO }; MOST_TAPS],
        len: 0,
        weight: 0.0,
    };

    fn push(&mut self, tap: Tap) {
        if self.len < MOST_TAPS && tap.weight > 0.0 {
            self.list[self.len] = tap;
            self.len += 1;
            self.weight += f64::from(tap.weight);
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
    fx: f64,
    fy: f64,
    /// A pixel's edge there, scene units.
    footprint: f64,
    /// How far away samples count, scene units.
    reach: f64,
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

    /// The samples about `point`, whose `images` are found.
    pub(super) fn taps(&self, point: &SurfacePoint, images: &Images) -> Taps {
        let mut taps = Taps::NONE;
        for (number, reference) in self.references.iter().enumerate() {
            let image = match images.get(number) {
                Some(image) => *image,
                None if taps.weight >= self.evidence.enough_weight => break,
                None => self.image(reference, point),
            };
            if let Some(image) = image {
                self.screen_taps((number as u32, reference), point, &image, &mut taps);
            }
        }
        if !point.direct && taps.weight < self.evidence.enough_weight {
            let own = level_of(point.footprint);
            let cells = [own, own - 1].map(|level| Cells::around(level, point.geom_id, point.p));
            for (number, reference) in self.references.iter().enumerate() {
                if taps.weight >= self.evidence.enough_weight {
                    break;
                }
                self.index_taps((number as u32, reference), point, &cells, &mut taps);
            }
        }
        taps
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
        let reach = 2.0 * footprint / cos.max(self.evidence.grazing);
        Some(Image { fx: x - left, fy: y - top, footprint, reach, samples })
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
            let Some(apart) = self.on_surface(point, s, footprint, reach) else { continue };
            let wx = if k & 1 == 1 { fx } else { 1.0 - fx };
            let wy = if k >> 1 == 1 { fy } else { 1.0 - fy };
            let apart = (apart / footprint).as_vec3();
            let alike = self.alikeness(point, s);
            let weight = (wx * wy) as f32 * alike * alike;
            taps.push(Tap { reference: number, sample, weight, apart });
        }
    }

    /// Samples in the `cells` around the point.
    fn index_taps(
        &self,
        (number, reference): (u32, &Reference),
        point: &SurfacePoint,
        cells: &[Cells; 2],
        taps: &mut Taps,
    ) {
        let footprint = f64::from(point.footprint);
        for cells in cells {
            let reach = cells.edge;
            for sample in reference.index.members(cells) {
                let s = &reference.samples[sample as usize];
                let Some(apart) = self.on_surface(point, s, footprint, reach) else { continue };
                let weight = 0.5 * (1.0 - apart.length() / reach);
                let apart = (apart / footprint).as_vec3();
                taps.push(Tap { reference: number, sample, weight: weight as f32, apart });
            }
        }
    }

    /// From the point to a sample on its own surface; `None` where it is on another.
    fn on_surface(
        &self,
        point: &SurfacePoint,
        s: &Sample,
        footprint: f64,
        reach: f64,
    ) -> Option<DVec3> {
        if s.geom_id != point.geom_id || s.n.dot(point.n) < self.evidence.least_cos {
            return None;
        }
        let apart = s.position() - point.p;
        let distance = apart.length();
        let height = apart.dot(point.n.as_dvec3()).abs();
        let allowed = self.evidence.height * footprint + self.evidence.slope * distance;
        (distance <= reach && height <= allowed).then_some(apart)
    }

    /// 1 for a sample with the point's own normal, 0 where they are as far apart as can be.
    fn alikeness(&self, point: &SurfacePoint, s: &Sample) -> f32 {
        let least = self.evidence.least_cos;
        ((s.n.dot(point.n) - least) / (1.0 - least)).clamp(0.0, 1.0)
    }}

impl Image {
    fn keep_mesh(&mut self, reference: &Reference, geom_id: u32) {
        for sample in self.samples.iter_mut().filter(|sample| **sample != NONE) {
            if reference.samples[*sample as usize].geom_id != geom_id {
                *sample = NONE;
            }
        }
    }
}
