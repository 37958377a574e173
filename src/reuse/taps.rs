//! The samples around a point in each reference, four at a time: found by the point's image in the reference, or by
//! its position in the scene.

mod image;

pub(super) use image::ALWAYS;

use super::index::{Cells, level_of};
use super::reference::{NONE, Reference, Sample};
use crate::inference::SurfacePoint;
use crate::math::Vec3;
use wide::{CmpGe, CmpGt, CmpLe, f32x4};

/// Most groups of four samples that one point's estimate is made of.
const MOST: usize = 8;
/// Number of points that are looked up together: their memory is requested for all before it is used for any.
pub(super) const TOGETHER: usize = 16;
/// Sum of weights (a reference that surrounds the point gives 1) from which on no further reference is looked up.
pub(super) const ENOUGH_WEIGHT: f64 = 0.6;
/// Least cosine between the normals of point and sample; the weight grows with the square of the excess.
const LEAST_COS: f32 = 0.8;
/// A sample lies on the point's surface up to this height above its tangent plane, footprints, and
/// further by this share of its distance along the plane.
const HEIGHT: f32 = 0.7;
const SLOPE: f32 = 0.35;
/// Number of levels of the index that are searched: a point's own, the finer and the coarser one.
const LEVELS: usize = 3;

/// Three coordinates of four places.
type Vec3x4 = [f32x4; 3];

/// Up to four samples of one reference that lie on the point's surface; the others have no weight.
#[derive(Clone, Copy)]
pub(super) struct Taps4 {
    pub reference: u32,
    /// Numbers of the samples. A lane without weight repeats another lane's number, so that every lane can be
    /// read.
    pub samples: [u32; 4],
    /// Weights; a reference that surrounds the point gives 1 in all.
    pub weight: f32x4,
    /// Weights for means: `weight` to the power of 3/4. They are more even, which averages out more of tracing's
    /// noise.
    pub share: f32x4,
    /// Distances from the point to the samples, footprints.
    pub distance: f32x4,
}

/// The samples about a point.
pub(super) struct Taps {
    list: [Taps4; MOST],
    len: usize,
    /// Number of lanes of the last group that are in use.
    lanes: usize,
    pub weight: f64,
}

/// A point to compare samples with, split in two so that distances, not positions, are rounded to f32.
#[derive(Clone, Copy)]
pub(super) struct Place {
    p: Vec3,
    /// The rounding error of `p`, to be added to it.
    rest: Vec3,
    n: Vec3,
    geom_id: u32,
}

/// Distances and normals of four samples relative to a point; 0 for samples that are not on its surface.
struct Near4 {
    /// Mask: all bits set for samples on the surface.
    is_near: f32x4,
    distance: f32x4,
    /// Likeness of the normals: 1 for equal normals, 0 at the limit.
    alike: f32x4,
}

impl Taps4 {
    const NONE: Self = Self {
        reference: 0,
        samples: [0; 4],
        weight: f32x4::ZERO,
        share: f32x4::ZERO,
        distance: f32x4::ZERO,
    };

    /// Taps of those `samples` that are `near` and have a weight; `None` where there is none.
    fn new(reference: u32, mut samples: [u32; 4], weight: f32x4, near: &Near4) -> Option<Self> {
        let weight = weight & near.is_near & weight.cmp_gt(f32x4::ZERO);
        let some = weight.cmp_gt(f32x4::ZERO).move_mask();
        let any = *samples.get(some.trailing_zeros() as usize)?;
        for (k, sample) in samples.iter_mut().enumerate() {
            *sample = if some >> k & 1 == 1 { *sample } else { any };
        }
        // To the power of 3/4.
        let root = weight.sqrt();
        let share = root * root.sqrt();
        Some(Self { reference, samples, weight, share, distance: near.distance })
    }

    /// Copies lane `from` of `other`, which is of the same reference, into lane `to`.
    fn set(&mut self, to: usize, other: &Self, from: usize) {
        self.samples[to] = other.samples[from];
        let rows = |t: &Self| [t.weight, t.share, t.distance].map(f32x4::to_array);
        let (mut own, others) = (rows(self), rows(other));
        own.iter_mut().zip(others).for_each(|(own, other)| own[to] = other[from]);
        let [weight, share, distance] = own.map(f32x4::from);
        (self.weight, self.share, self.distance) = (weight, share, distance);
    }
}

impl Taps {
    /// No taps.
    pub fn new() -> Self {
        Self { list: [Taps4::NONE; MOST], len: 0, lanes: 4, weight: 0.0 }
    }

    fn clear(&mut self) {
        (self.len, self.lanes, self.weight) = (0, 4, 0.0);
    }

    /// Appends four lanes.
    fn push(&mut self, four: &Taps4) {
        if self.len < MOST {
            self.list[self.len] = *four;
            self.len += 1;
            self.lanes = 4;
            self.weight += f64::from(sum(four.weight));
        }
    }

    /// Appends the lanes that have weight, to the last group of the same reference as far as that has room.
    fn pack(&mut self, four: &Taps4) {
        let weights = four.weight.to_array();
        for (from, weight) in weights.into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
            if self.lanes == 4 || self.list[self.len - 1].reference != four.reference {
                if self.len == MOST {
                    return;
                }
                let samples = [four.samples[from]; 4];
                let empty = Taps4 { reference: four.reference, samples, ..Taps4::NONE };
                self.list[self.len] = empty;
                (self.len, self.lanes) = (self.len + 1, 0);
            }
            self.list[self.len - 1].set(self.lanes, four, from);
            self.lanes += 1;
            self.weight += f64::from(weight);
        }
    }

    /// The taps in groups of four.
    pub fn fours(&self) -> &[Taps4] {
        &self.list[..self.len]
    }
}

impl Place {
    pub fn of(point: &SurfacePoint) -> Self {
        let p = point.p.as_vec3();
        let rest = (point.p - p.as_dvec3()).as_vec3();
        Self { p, rest, n: point.n, geom_id: point.geom_id }
    }

    /// The distances of `samples` from the point; `None` where none counts. A sample counts if it is on the same
    /// mesh, with a similar normal, within `reach` footprints and near the tangent plane.
    fn near(
        &self,
        reference: &Reference,
        samples: &[u32; 4],
        (footprint, reach): (f32, f32),
    ) -> Near4 {
        let [mut x, mut y, mut z, mut nx, mut ny, mut nz] = [[0.0; 4]; 6];
        for (k, sample) in samples.iter().enumerate() {
            // A lane that stays 0 has no normal like any.
            let found = reference.samples.get(*sample as usize);
            if let Some(s) = found.filter(|s| s.geom_id == self.geom_id) {
                [x[k], y[k], z[k]] = [s.p.x, s.p.y, s.p.z];
                [nx[k], ny[k], nz[k]] = s.normal();
            }
        }
        let by = f32x4::splat(1.0 / footprint);
        let away = |at: [f32; 4], p: f32, rest: f32| {
            ((f32x4::from(at) - f32x4::splat(p)) - f32x4::splat(rest)) * by
        };
        let apart = [
            away(x, self.p.x, self.rest.x),
            away(y, self.p.y, self.rest.y),
            away(z, self.p.z, self.rest.z),
        ];
        let n = [f32x4::splat(self.n.x), f32x4::splat(self.n.y), f32x4::splat(self.n.z)];
        let cos = dot([nx.into(), ny.into(), nz.into()], n) * f32x4::splat(1.0 / Sample::UNIT);
        let distance = dot(apart, apart).sqrt();
        let allowed = f32x4::splat(SLOPE) * distance + f32x4::splat(HEIGHT);
        let least = f32x4::splat(LEAST_COS);
        let is_near = cos.cmp_ge(least)
            & distance.cmp_le(f32x4::splat(reach))
            & dot(apart, n).abs().cmp_le(allowed);
        let alike = (cos - least) * f32x4::splat(1.0 / (1.0 - LEAST_COS));
        Near4 { is_near, distance: distance & is_near, alike: alike.fast_min(f32x4::ONE) & is_near }
    }
}

/// Reference frames in the order in which they are searched.
pub(super) struct References<'a>(pub &'a [&'a Reference]);

impl References<'_> {
    /// Collects the samples near `point` in `taps`, which is cleared first. `found` has the samples of the first
    /// [`ALWAYS`] references; further references are searched until the weights sum up to [`ENOUGH_WEIGHT`].
    pub(super) fn gather(&self, point: &SurfacePoint, found: &[Option<Taps4>], taps: &mut Taps) {
        taps.clear();
        found.iter().flatten().for_each(|four| taps.push(four));
        if taps.weight >= ENOUGH_WEIGHT {
            return;
        }
        let place = Place::of(point);
        for (number, reference) in self.0.iter().enumerate().skip(ALWAYS) {
            if taps.weight >= ENOUGH_WEIGHT {
                return;
            }
            let image = self.image(reference, point);
            let four = image.and_then(|image| self.screen_taps(number, &place, &image));
            four.iter().for_each(|four| taps.pack(four));
        }
        if !point.direct && taps.weight < ENOUGH_WEIGHT {
            let own = level_of(point.footprint);
            let cells =
                [own, own - 1, own + 1].map(|level| Cells::around(level, point.geom_id, point.p));
            for number in 0..self.0.len() {
                if taps.weight >= ENOUGH_WEIGHT {
                    return;
                }
                self.index_taps(number, (&place, point.footprint), &cells, taps);
            }
        }
    }

    /// Samples of a reference in the `cells` around a point.
    fn index_taps(
        &self,
        number: usize,
        (place, footprint): (&Place, f32),
        cells: &[Cells; LEVELS],
        taps: &mut Taps,
    ) {
        let reference = self.0[number];
        for cells in cells {
            let reach = cells.edge as f32 / footprint;
            let mut members = reference.index.members(cells);
            while let Some(first) = members.next() {
                let mut samples = [first, NONE, NONE, NONE];
                samples[1..].iter_mut().zip(&mut members).for_each(|(to, sample)| *to = sample);
                let near = place.near(reference, &samples, (footprint, reach));
                let weight = f32x4::splat(0.5) - near.distance * f32x4::splat(0.5 / reach);
                if let Some(four) = Taps4::new(number as u32, samples, weight, &near) {
                    taps.pack(&four);
                }
            }
        }
    }
}

/// Dot products of four vectors with four others.
fn dot(a: Vec3x4, b: Vec3x4) -> f32x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sum of the lanes, in one order on every machine.
pub(super) fn sum(lanes: f32x4) -> f32 {
    let [a, b, c, d] = lanes.to_array();
    (a + b) + (c + d)
}
