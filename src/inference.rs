//! The seam between shading and reuse: what is asked about a surface point, what is answered, and
//! what tracing leaves behind for later frames.
//!
//! `shade` asks an [`Inference`] before it casts shadow rays and never learns where the answer
//! comes from; `reuse` answers and never traces. All in scene space.

use crate::film::Provenance;
use crate::math::{DVec3, Vec3};
use crate::scene::{LightCells, Scene, ratio_count};
use serde::{Deserialize, Serialize};

/// Camera samples of a pixel that are traced, shaded and looked up together: 256 rays of a whole block are enough
/// for packets and few enough to stay in the L1 cache. As many where few pixels are rendered, so that a probe has
/// the surface points that the frame would have, and sums in their order.
pub const SAMPLES_TOGETHER: u32 = 4;
/// Points of a pixel lie on one surface where their normals differ by less: cosine.
pub const SAME_SURFACE: f32 = 0.9;
/// And one lies so little off the tangent plane of the other, footprints.
const MOST_HEIGHT: f64 = 1.0;

/// A surface point whose light is wanted: where one or more camera samples of a pixel end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// The point; the mean where there are several samples.
    pub p: DVec3,
    /// Unit shading normal on the viewer's side.
    pub n: Vec3,
    /// Mesh, or the spheres' number.
    pub geom_id: u32,
    /// Distance on the surface to what the neighbouring pixels see, at right angles to the ray.
    pub footprint: f32,
    /// Cosine between `n` and the direction back along the ray.
    pub cos: f32,
    /// Whether the pixel shows it sharply: a camera ray ends here, not one from a mirror or glass, and it is
    /// in focus.
    pub direct: bool,
    /// Camera samples that it stands for.
    pub samples: u32,
}

impl SurfacePoint {
    /// Whether `other` is of the same mesh and faces the same way.
    pub fn faces_as(&self, other: &Self) -> bool {
        self.geom_id == other.geom_id && self.n.dot(other.n) > SAME_SURFACE
    }

    /// Whether `other`, seen in the same pixel, lies on the same surface: beyond a ridge there may be another
    /// slope of the mesh that faces the same way.
    pub fn is_one_surface(&self, other: &Self) -> bool {
        let height = (other.p - self.p).dot(self.n.as_dvec3());
        self.faces_as(other) && height.abs() <= MOST_HEIGHT * f64::from(self.footprint)
    }

    /// Takes in more camera samples of the same pixel and surface; their share of all.
    pub fn join(&mut self, other: &Self) -> f32 {
        let samples = self.samples.saturating_add(other.samples);
        let share = other.samples as f32 / samples as f32;
        self.p += (other.p - self.p) * f64::from(share);
        self.n = (self.n + (other.n - self.n) * share).normalize_or(self.n);
        self.footprint += (other.footprint - self.footprint) * share;
        self.cos += (other.cos - self.cos) * share;
        self.samples = samples;
        share
    }
}

/// An estimate of one light at a point from other frames, and its risk.
///
/// The lights of a point are ordered by what they send without shadows: those up to one of them may be inferred, while the
/// brighter ones are traced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Ratio of shadowed to unshadowed irradiance; NaN where no other frame knows it.
    pub ratio: f32,
    /// Level of risk, from the samples around the point, of this light and of all that send less, together.
    pub level: u8,
    /// How many lights of the point send less.
    pub order: u32,
}

impl Estimate {
    /// No estimate.
    pub const UNKNOWN: Self = Self { ratio: f32::NAN, level: 0, order: 0 };
}

/// One check ray is cast for this many shadow rays that tracing would cast.
const RAYS_PER_CHECK: u32 = 16;
/// Least number of check rays: two would miss a quarter of the shadows that cover half of a light.
const FEWEST_CHECKS: u32 = 4;

/// How many times its share of the check rays a light gets. The error that `n` rays to a light of share `s` leave
/// unfound is at most s·d·√(1-d)ⁿ, for the ratio's error d that makes it largest: with this factor the squares of several
/// lights add up to little more than that of one light with the fewest rays. (Where many rays are saved, one light gets
/// more than the fewest, and many lights hide more together than it.)
const SHARED: f32 = 1.5;

/// Multiple of the check rays where other lights of the point are traced: what throws their shadows may throw one that no
/// sample of this light shows.
const BESIDE_RISK: u32 = 2;

/// Number of check rays to a light for an answer that saves `rays` shadow rays to it. The check is of all lights of a
/// point together that are inferred: this one sends the part `share` of what arrives of these without shadows, and the
/// answer is `ratio`, NaN where it has none. The point's other lights may be traced (`in_part`).
///
/// In half shadow there are twice as many: the mean of four rays then has a standard deviation of a quarter, so that not
/// even a point that sees all of the light, or nothing, would be more than two of them away.
pub fn check_rays(rays: u32, share: f32, ratio: f32, in_part: bool) -> u32 {
    let all = (rays / RAYS_PER_CHECK).max(FEWEST_CHECKS);
    let all = all.saturating_mul(if in_part { BESIDE_RISK } else { 1 });
    // A tail's ratio may be above 1.
    let variance = (ratio * (1.0 - ratio)).max(0.0);
    let all = ((all as f32 * (1.0 + 4.0 * variance)).round() as u32).min(rays);
    ((SHARED * share * all as f32).ceil() as u32).clamp(all.min(1), all)
}

/// The result of the check rays for one light at a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Checked {
    /// Ratio of shadowed to unshadowed irradiance.
    pub ratio: f32,
    /// Number of check rays; 0 where none was cast.
    pub rays: u32,
}

/// Points in a batch with the answers about them.
#[derive(Debug, Default)]
pub struct LookupBatch {
    /// The surface points, scene space.
    pub points: Vec<SurfacePoint>,
    /// Camera samples that the pixels have with these, over the least number of a pixel, if more: the trace of a pixel with
    /// more samples has less noise.
    pub refinement: f32,
    /// For each point the pixel that shows it: column, row.
    pub pixels: Vec<[u32; 2]>,
    /// For each point and channel the light's contribution to the pixel without shadows:
    /// luminance, exposure applied; 0 where no light can arrive.
    pub unshadowed: Vec<f32>,
    /// For each point and channel the number of its light, [`NO_LIGHT`] or that of a part of the sky ([`sky_light`]); empty where each
    /// channel has the same light everywhere.
    pub lights: Vec<u32>,
    /// For each point the ratio in each channel; NaN where it is unknown and must be traced.
    pub ratios: Vec<f32>,
    /// For each point and channel the estimate from other frames; filled by the answering side.
    pub estimates: Vec<Estimate>,
    /// For each point the provenance of its ratios; the default where no other frame knows any.
    pub provenance: Vec<Provenance>,
    /// For each point and channel whether check rays are to be cast; empty if none are.
    pub checks: Vec<bool>,
    /// For each point and channel the result of the check rays; empty if none were cast.
    pub checked: Vec<Checked>,
}

/// A point that was traced: a source for other frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TracedPoint {
    /// Pixel column.
    pub x: u32,
    /// Pixel row.
    pub y: u32,
    /// The point.
    pub point: SurfacePoint,
}

/// Traced points with their ratios.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TracedPoints {
    /// The points.
    pub points: Vec<TracedPoint>,
    /// For each point the ratio in each channel; NaN where it was not traced.
    pub ratios: Vec<f32>,
    /// For each point the light of each channel, as in [`LookupBatch::lights`].
    pub lights: Vec<u32>,
}

impl TracedPoints {
    /// Appends all of `other`.
    pub fn append(&mut self, other: Self) {
        let Self { mut points, mut ratios, mut lights } = other;
        self.points.append(&mut points);
        self.ratios.append(&mut ratios);
        self.lights.append(&mut lights);
    }

    /// The points sorted row by row; points of one pixel keep their order.
    pub fn in_rows(self) -> Self {
        let place = |t: &TracedPoint| (t.y, t.x);
        if self.points.is_sorted_by_key(place) {
            return self;
        }
        let channels = self.ratios.len() / self.points.len();
        let order = in_order(&self.points);
        let points = order.iter().map(|i| self.points[*i as usize]).collect();
        let own = |i: &u32| *i as usize * channels..(*i as usize + 1) * channels;
        let ratios = order.iter().flat_map(|i| &self.ratios[own(i)]).copied().collect();
        let lights = |i: &u32| self.lights.get(own(i)).unwrap_or_default();
        let lights = order.iter().flat_map(lights).copied().collect();
        Self { points, ratios, lights }
    }
}

/// The numbers of `points` row by row. There are about as many points as pixels, so they are counted, not compared.
fn in_order(points: &[TracedPoint]) -> Vec<u32> {
    let width = points.iter().map(|t| t.x as usize + 1).max().unwrap_or(0);
    let rows = points.iter().map(|t| t.y as usize + 1).max().unwrap_or(0);
    let pixel = |t: &TracedPoint| t.y as usize * width + t.x as usize;
    let mut places = vec![0_u32; width * rows];
    points.iter().for_each(|t| places[pixel(t)] += 1);
    let mut before = 0;
    for place in &mut places {
        before += std::mem::replace(place, before);
    }
    let mut order = vec![0; points.len()];
    for (i, t) in (0..).zip(points) {
        let place = &mut places[pixel(t)];
        order[*place as usize] = i;
        *place += 1;
    }
    order
}

/// Number of no light, of a channel that is free.
pub const NO_LIGHT: u32 = u32::MAX;
/// Number of the sky, or the first part of it, among the lights of channels.
const SKY_LIGHT: u32 = u32::MAX - 1;
/// Numbers of the other parts.
const SKY_PARTS: [u32; 2] = [u32::MAX / 2, u32::MAX / 2 + 1];
/// The largest number of a part of a tail among the lights of channels.
const TAIL_LIGHT: u32 = u32::MAX - 2;
/// Most parts of a tail.
const TAIL_PARTS: u32 = 3;

/// Number among the lights of channels of a `part` of the sky.
pub fn sky_light(part: usize) -> u32 {
    if part == 0 { SKY_LIGHT } else { SKY_PARTS[(part - 1) % SKY_PARTS.len()] }
}

/// Number among the lights of channels of a `part` of the tail with this set of lights
/// ([`LightCells::tail_set`](crate::scene::LightCells::tail_set)).
pub fn tail_light(set: u32, part: u32) -> u32 {
    TAIL_LIGHT - (TAIL_PARTS * set + part)
}

/// The most that a ratio of the light of this number can be, `None` of a scene that selects no lights: the tail's
/// ratios are to a stand-in, which may be less than what arrives.
pub fn most_ratio(light: Option<&u32>) -> f32 {
    // The lights of a scene take the lower half of the numbers.
    let first = SKY_PARTS[SKY_PARTS.len() - 1] + 1;
    let is_tail = light.is_some_and(|light| (first..=TAIL_LIGHT).contains(light));
    if is_tail { f32::MAX } else { 1.0 }
}

/// The channel of a point with the lights `known` that is of the light of channel `k` of a point with the lights
/// `asked`; `k` itself where each channel has the same light everywhere.
#[inline]
pub fn channel_of(known: &[u32], asked: &[u32], k: usize) -> Option<usize> {
    let Some(light) = asked.get(k) else { return Some(k) };
    // Neighbours mostly have the same lights.
    match known.get(k) {
        _ if *light == NO_LIGHT => None,
        Some(other) if other == light => Some(k),
        _ => known.iter().position(|other| other == light),
    }
}

/// Answers what is known about the light at surface points.
pub trait Inference: Sync {
    /// Fills ratios and origins for all points, and says what is to be checked.
    fn infer(&self, batch: &mut LookupBatch);

    /// Hears what check rays found where there were any, and takes back answers that they contradict.
    fn check(&self, _questions: &mut LookupBatch) {}

    /// Hears what came out for the same points, once those that had to be were traced: a ratio is NaN
    /// only where no light was asked for. The estimates are as `infer` left them.
    fn hear(&self, _answered: &LookupBatch) {}
}

/// Which light a channel of ratios belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// The area light of this index, or the part of it of one primary colour ([`Channels::colours`]).
    Area(u32, u32),
    /// One of the lights with an extent that matter at a point, where lights are selected, or the part of it of one primary
    /// colour: another light at every point.
    Selected(u32, u32),
    /// The part of this number of the light that samples choose, where lights are selected. The parts differ in
    /// colour.
    Tail(u32),
    /// The part of this number of the sky: one, but for an environment of several colours and behind coloured glass.
    Sky(u32),
}

impl Channel {
    /// Which of the ratios of its light it is: 0 for the first, which lights of one colour have alone.
    pub fn part(self) -> u32 {
        match self {
            Self::Area(_, part) | Self::Selected(_, part) | Self::Tail(part) | Self::Sky(part) => {
                part
            }
        }
    }
}

/// The lights whose ratios are kept.
///
/// For an area light the ratio is that of shadowed to unshadowed irradiance at the shading normal;
/// for the sky that of arriving to unoccluded irradiance; for the tail that of shadowed irradiance to a stand-in for
/// the unshadowed one. None depends on where the camera is.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Channels {
    list: Vec<Channel>,
    of_light: Vec<Option<usize>>,
    sky: std::ops::Range<usize>,
    slots: usize,
    tail: usize,
    colours: usize,
}

impl Channels {
    /// Channels for those lights of `scene` that `is_kept` keeps, three for each where light `is_coloured` by glass on its
    /// way. Where `cells` select lights, a point has channels for as many as matter at most.
    pub fn of(
        scene: &Scene,
        cells: Option<&LightCells>,
        is_coloured: bool,
        is_kept: impl Fn(Channel) -> bool,
    ) -> Self {
        let colours = ratio_count(1, is_coloured);
        let of_light = vec![None; scene.lights.len()];
        let mut channels = Self { of_light, colours, ..Self::default() };
        let parts = 0..colours as u32;
        if let Some(cells) = cells {
            let slots = 0..cells.most_area() as u32;
            let slots =
                slots.flat_map(|slot| parts.clone().map(move |k| Channel::Selected(slot, k)));
            channels.list.extend(slots.filter(|channel| is_kept(*channel)));
            channels.slots = channels.list.len();
            if channels.slots > 0 {
                let tints = ratio_count(cells.tints().len(), is_coloured);
                let parts = (0..tints as u32).map(Channel::Tail);
                channels.list.extend(parts.filter(|channel| is_kept(*channel)));
                channels.tail = channels.list.len() - channels.slots;
            }
        }
        let lights = if cells.is_some() { &[] } else { &scene.lights[..] };
        for (index, light) in lights.iter().enumerate() {
            let of_part = |part| Channel::Area(index as u32, part);
            if light.is_area() && is_kept(of_part(0)) {
                channels.of_light[index] = Some(channels.list.len());
                channels.list.extend(parts.clone().map(of_part));
            }
        }
        let first = channels.list.len();
        let tints = scene.environment.as_ref().map_or(1, |sky| sky.radiance.tints().len());
        let parts = (0..ratio_count(tints, is_coloured) as u32).map(Channel::Sky);
        channels.list.extend(parts.filter(|channel| is_kept(*channel)));
        channels.sky = first..channels.list.len();
        channels
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = Channel> + '_ {
        self.list.iter().copied()
    }

    /// How many ratios are kept of a light: one, or three where glass may colour it on its way.
    pub fn colours(&self) -> usize {
        self.colours.max(1)
    }

    /// The channel of light `index`, or the first of them, if its ratio is kept.
    pub fn of_light(&self, index: u32) -> Option<usize> {
        self.of_light.get(index as usize).copied().flatten()
    }

    /// How many channels, the first ones, are of selected lights; 0 where each channel has the same light
    /// everywhere.
    pub fn slots(&self) -> usize {
        self.slots
    }

    /// The channels of the tail, if its ratios are kept.
    pub fn tail(&self) -> std::ops::Range<usize> {
        self.slots..self.slots + self.tail
    }

    /// The sky's channels, if its ratios are kept: one, but for an environment of several colours and behind coloured glass.
    pub fn sky(&self) -> std::ops::Range<usize> {
        self.sky.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, n: Vec3) -> SurfacePoint {
        let (p, footprint, cos) = (DVec3::new(x, y, 0.0), 0.5, 0.3);
        SurfacePoint { p, n, geom_id: 0, footprint, cos, direct: true, samples: 1 }
    }

    /// The largest squared error that `n` rays leave unfound on average, of a light that sends 1.
    fn hidden(n: u32) -> f64 {
        let errors = (0..=100).map(|d| f64::from(d) / 100.0);
        errors.map(|d| d * d * (1.0 - d).powi(n as i32)).fold(0.0, f64::max)
    }

    #[test]
    fn lights_share_check_rays_and_hide_little_more_than_one_with_the_fewest() {
        assert_eq!(
            [0, 1, 3, 16, 64, 100].map(|rays| check_rays(rays, 1.0, 1.0, false)),
            [0, 1, 3, 4, 4, 6]
        );
        assert_eq!([0.9, 0.1].map(|share| check_rays(16, share, 1.0, false)), [4, 1]);
        let of = |rays, share| check_rays(rays, share, 1.0, false);
        assert_eq!([of(160, 0.5), of(160, 0.0), of(0, 0.5)], [8, 1, 0]);
        // Twice as many where other lights are traced.
        assert_eq!([1.0, 0.1].map(|share| check_rays(64, share, 1.0, true)), [8, 2]);
        assert_eq!(check_rays(6, 1.0, 1.0, true), 6);
        // More in half shadow.
        let of = |ratio| check_rays(64, 1.0, ratio, false);
        assert_eq!([0.0, f32::NAN, 0.1, 0.5, 0.9, 1.2].map(of), [4, 4, 5, 8, 5, 4]);
        let one = hidden(FEWEST_CHECKS);
        for (rays, lights) in [16, 100, 1024].into_iter().flat_map(|r| (2..30).map(move |n| (r, n)))
        {
            for steepness in 0..40 {
                let sent = |k: i32| (1.0 - 0.025 * f64::from(steepness)).powi(k);
                let all: f64 = (0..lights).map(sent).sum();
                let of = |k: i32| {
                    let share = sent(k) / all;
                    share * share * hidden(check_rays(rays, share as f32, 1.0, false))
                };
                let together: f64 = (0..lights).map(of).sum();
                // A fifth more at worst, for a few lights of some kinds.
                let told = format!("{rays} rays, {lights} lights, {steepness}: {}", together / one);
                assert!(together < 1.2 * one, "{told}");
            }
        }
    }

    #[test]
    fn samples_of_a_pixel_are_one_surface_where_they_lie_on_one_plane() {
        let mut group = at(0.0, 0.0, Vec3::Y);
        // Seen along the surface, a pixel reaches far.
        let beside = at(2.0, 0.0, Vec3::new(0.1, 1.0, 0.0).normalize());
        assert!(group.is_one_surface(&beside));
        group.join(&beside);
        assert_eq!((group.samples, group.p.x), (2, 1.0));
        assert!(group.is_one_surface(&at(3.0, 0.4, Vec3::Y)));
        // The next ridge, another side of this one, another mesh.
        assert!(!group.is_one_surface(&at(3.0, 1.0, Vec3::Y)));
        assert!(!group.is_one_surface(&at(3.0, -1.0, Vec3::Y)));
        assert!(!group.is_one_surface(&at(1.0, 0.0, Vec3::new(1.0, 1.0, 0.0).normalize())));
        assert!(!group.is_one_surface(&SurfacePoint { geom_id: 1, ..group }));
    }
}
