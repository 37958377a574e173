//! Which lights shading points look at, where the scene has many.
//!
//! A point's lights are those of its cell ([`LightCells`]), a function of its position alone. Its main lights are
//! traced one by one, as all lights are in a scene of few. Samples choose among those of the tail
//! ([`super::tail`]).

use super::Renderer;
use super::far_lights::{FarLights, TailsSeen};
use super::source::LightSource;
use crate::math::{DVec3, Rgb};
use crate::scene::{CellLights, LightCells, Settings, Tail};
use std::f64::consts::PI;

/// Culled lights together change a white surface by at most so much, display steps of 1/255, even where nothing else
/// shines.
const CULLED: f64 = 0.1;
/// Display steps of 1/255 per unit of radiance where the sRGB curve is steepest, in the dark.
const STEPS: f64 = 255.0 * 12.92;
/// No source.
const NONE: u32 = u32::MAX;

/// The lights of all places in one frame.
pub(super) struct LightSelection<'a> {
    cells: &'a LightCells,
    /// Irradiance that the culled lights of a diffuse point send together at most.
    culled: f64,
    /// Shadow samples of a light with an extent.
    pub samples: u32,
    /// For each light of the scene its place among the frame's sources.
    sources: Vec<u32>,
    /// The lights of the scene as diffuse points see those of a tail.
    pub far: FarLights,
}

/// A point that a light is traced at.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LightUser {
    /// Its number in the chunk.
    pub point: u32,
    /// Where the light's ratio is kept, if it is.
    pub slot: Option<u16>,
}

/// For each source the points of a chunk that it is traced at.
#[derive(Default)]
pub(super) struct LightUsers {
    /// The cell of each point.
    pub cells: Vec<u32>,
    /// Sources with their users, point by point.
    found: Vec<(u32, LightUser)>,
    /// Where the users of each source begin.
    starts: Vec<u32>,
    /// The users, source by source.
    users: Vec<LightUser>,
}

/// The points that one source is traced at.
#[derive(Clone, Copy)]
pub(super) enum Reached<'u> {
    /// So many points, all of a chunk, and where its ratios are kept.
    All(usize, Option<u16>),
    Some(&'u [LightUser]),
}

/// Random numbers of the samples at one point.
#[derive(Default)]
pub(super) struct TailSamples {
    pub choices: Vec<[f32; 2]>,
    pub places: Vec<[f32; 2]>,
    /// The tails of the points of a chunk.
    pub seen: TailsSeen,
    /// What samples found at some points of a chunk.
    pub found: Vec<FoundLight>,
}

/// What samples of the tail found at a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct FoundLight {
    /// The point's number in the chunk.
    pub point: u32,
    /// Number of samples.
    pub rays: u32,
    pub irradiance: Rgb,
}

/// A sample's light.
pub(super) struct Choice {
    /// Its place among the frame's sources; `None` of a light that does not shine.
    pub source: Option<usize>,
    /// Mean number of the samples that choose it.
    pub count: f64,
    /// The place on it.
    pub place: [f32; 2],
}

impl TailSamples {
    /// The samples' choices among the lights of `tail`.
    pub fn choices<'s>(
        &'s self,
        tail: Tail<'s>,
        selection: &'s LightSelection,
    ) -> impl Iterator<Item = Choice> + 's {
        let samples = self.choices.len() as f64;
        self.choices.iter().zip(&self.places).map(move |(choice, place)| {
            let (light, probability) = tail.choose(f64::from(choice[0]));
            let source = selection.source(light);
            Choice { source, count: samples * probability, place: *place }
        })
    }
}

/// The irradiance that the culled lights of a point may send together.
fn culled(settings: &Settings) -> f64 {
    CULLED * PI / (STEPS * f64::from(settings.exposure).max(f64::MIN_POSITIVE))
}

impl Renderer<'_> {
    /// The selection among `sources`; `None` where every point looks at every light.
    pub(super) fn light_selection(&self, lights: &[LightSource]) -> Option<LightSelection<'_>> {
        let cells = self.scene.selected_lights(self.settings)?;
        let mut sources = vec![NONE; self.scene.lights.len()];
        for (at, source) in (0..).zip(lights).filter(|(_, source)| !source.is_sky()) {
            sources[source.number as usize] = at;
        }
        let samples = self.settings.shadow_samples;
        let far = FarLights::of(&self.scene.lights);
        Some(LightSelection { cells, culled: culled(self.settings), samples, sources, far })
    }
}

impl LightSelection<'_> {
    /// Number of the set of lights in the tail of a cell.
    pub fn tail_set(&self, cell: u32) -> u32 {
        self.cells.tail_set(cell)
    }

    /// Colours that the tail's ratios are kept of.
    pub fn tints(&self) -> &[Rgb] {
        self.cells.tints()
    }

    /// Number of the cell of `p`.
    pub fn cell(&self, p: DVec3) -> u32 {
        self.cells.cell(p)
    }

    /// The lights of a diffuse point.
    pub fn of_diffuse(&self, cell: u32) -> CellLights<'_> {
        self.cells.lights(cell, self.culled)
    }

    /// The lights of a glossy point: all that can send it anything, since a highlight may be as bright as the light.
    pub fn of_glossy(&self, cell: u32) -> CellLights<'_> {
        self.cells.lights(cell, 0.0)
    }

    /// The place among the frame's sources of a light, if it shines.
    pub fn source(&self, light: u32) -> Option<usize> {
        self.sources.get(light as usize).filter(|at| **at != NONE).map(|at| *at as usize)
    }

    /// Samples that glossy points of a cell have on average of a light, of which main ones have `samples`.
    pub fn samples_of(&self, cell: u32, light: u32, samples: u32) -> f64 {
        let lights = self.of_glossy(cell);
        if lights.main().any(|main| main == light) {
            return f64::from(samples);
        }
        let tail = lights.tail();
        f64::from(tail.samples(self.samples)) * tail.probability_of(light)
    }
}

impl LightUsers {
    /// Finds the main lights at `points`. `lights` gives the lights of a cell; `slot` says where the ratio of a
    /// source is kept at a point.
    pub fn find<'c>(
        &mut self,
        selection: &'c LightSelection,
        sources: &[LightSource],
        points: impl Iterator<Item = DVec3>,
        lights: impl Fn(u32) -> CellLights<'c>,
        mut slot: impl FnMut(u32, &LightSource) -> Option<u16>,
    ) {
        let Self { cells, found, starts, users } = self;
        cells.clear();
        found.clear();
        starts.clear();
        starts.resize(sources.len() + 1, 0);
        for (point, p) in (0..).zip(points) {
            let cell = selection.cell(p);
            cells.push(cell);
            for at in lights(cell).main().filter_map(|light| selection.source(light)) {
                let user = LightUser { point, slot: slot(point, &sources[at]) };
                found.push((at as u32, user));
                starts[at + 1] += 1;
            }
        }
        for at in 0..sources.len() {
            starts[at + 1] += starts[at];
        }
        users.clear();
        users.resize(found.len(), LightUser::default());
        for (at, user) in found {
            let next = &mut starts[*at as usize];
            users[*next as usize] = *user;
            *next += 1;
        }
        // Each start is the next one's by now.
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// The points that source number `at` is traced at.
    pub fn of(&self, at: usize) -> Reached<'_> {
        Reached::Some(&self.users[self.starts[at] as usize..self.starts[at + 1] as usize])
    }
}

impl Reached<'_> {
    pub fn len(&self) -> usize {
        match self {
            Self::All(points, _) => *points,
            Self::Some(users) => users.len(),
        }
    }

    #[inline(always)]
    pub fn get(&self, k: usize) -> LightUser {
        match self {
            Self::All(_, slot) => LightUser { point: k as u32, slot: *slot },
            Self::Some(users) => users[k],
        }
    }

    pub fn iter(self) -> impl Iterator<Item = LightUser> {
        (0..self.len()).map(move |k| self.get(k))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::sampling::mix;
    use crate::scene::{
        DirectionalLight, DiskLight, Light, Material, PointLight, QuadLight, Scene, SphereLight,
        SpotLight, SunLight, World, WorldSphere,
    };
    use crate::shade::light::LightSampler;

    /// Random numbers from -1 to 1.
    fn random(mut seed: u64) -> impl FnMut() -> f64 {
        move || {
            seed = mix(seed);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn vector(next: &mut impl FnMut() -> f64) -> DVec3 {
        DVec3::new(next(), next(), next())
    }

    /// A light of random kind, place and size: huge ones stand beside tiny ones.
    fn light(next: &mut impl FnMut() -> f64) -> Light {
        let p = vector(next);
        let normal = vector(next).normalize();
        let size = libm::exp(-3.0 + 2.5 * next());
        let radiance = Rgb::new(2.0, 1.0, 0.5) * libm::exp(3.0 * next()) as f32;
        let two_sided = next() > 0.0;
        let kinds = Light::written_kinds().count();
        match (0.5 * kinds as f64 * (next() + 1.0)) as usize {
            0 => Light::Point(PointLight { position: p, intensity: radiance * 0.01 }),
            1 => {
                let (s, t) = crate::math::orthonormal_basis(normal);
                let (s, t) = (s * size, t * size * 0.5);
                let corners = [p - s - t, p + s - t, p + s + t, p - s + t];
                Light::Quad(QuadLight { corners, radiance, two_sided })
            }
            2 => Light::Sphere(SphereLight { centre: p, radius: size, radiance }),
            3 => Light::Disk(DiskLight { centre: p, normal, radius: size, radiance, two_sided }),
            4 => {
                let (cos_outer, intensity) = (0.9 * next(), radiance * 0.01);
                let cos_inner = cos_outer + 0.05 * (next() + 1.0);
                let radius = if two_sided { 0.1 * size } else { 0.0 };
                let (position, direction) = (p, normal);
                Light::Spot(SpotLight {
                    position,
                    direction,
                    intensity,
                    cos_inner,
                    cos_outer,
                    radius,
                })
            }
            5 => {
                let irradiance = radiance * 0.001;
                Light::Directional(DirectionalLight { to_light: normal, irradiance })
            }
            6 => {
                let irradiance = radiance * 0.001;
                Light::Sun(SunLight::of_irradiance(normal, 0.3 * size.min(4.0), irradiance))
            }
            kind => panic!("{} lights are not drawn", Light::KINDS[kind]),
        }
    }

    /// A ball of radius 2 around `lights`, and little balls to light.
    fn scene(lights: Vec<Light>) -> Scene {
        let mut world = World { lights, ..World::default() };
        let grey = world.add_material(Material::diffuse("grey", Rgb::splat(0.5)));
        world.spheres.push(WorldSphere::new("room", DVec3::ZERO, 2.0, grey));
        world.into_scene(true).expect("a scene")
    }

    /// Irradiance without shadows, of the brightest colour.
    fn sent(light: &Light, p: DVec3, n: DVec3) -> f64 {
        let sampler = LightSampler::new(light);
        sampler.unshadowed(p, n) * f64::from(sampler.emission.max_element())
    }

    /// At random points of random scenes what is culled sends less than the limit, what can send nothing is
    /// black, and every light that shines is a main one or can be chosen.
    #[test]
    fn culled_lights_together_stay_below_the_limit() {
        let limit = culled(&Settings::default());
        let mut culled_some = 0;
        for seed in 0..24 {
            let mut next = random(seed);
            // Dim lights, of which many are culled, in every other scene.
            let dim = if seed % 2 == 0 { 1.0 } else { 1e-5 };
            let mut lights: Vec<Light> = (0..60).map(|_| light(&mut next)).collect();
            for light in &mut lights {
                if let Light::Quad(QuadLight { radiance, .. })
                | Light::Disk(DiskLight { radiance, .. })
                | Light::Sphere(SphereLight { radiance, .. }) = light
                {
                    *radiance *= dim;
                }
            }
            let scene = scene(lights);
            let cells = scene.light_cells.as_ref().expect("many lights");
            for k in 0..400 {
                let p = vector(&mut next) * scene.bounds.max;
                // On the planes that cells meet in, too.
                let p = if k % 5 == 0 { DVec3::new(0.0, p.y, 0.5 * scene.bounds.max.z) } else { p };
                let n = vector(&mut next).normalize();
                let cell = cells.cell(p);
                let own = cells.lights(cell, limit);
                let known: Vec<u32> = own.main().collect();
                let mut rest = 0.0;
                for (number, light) in (0..).zip(&scene.lights) {
                    let sent = sent(light, p, n);
                    if known.contains(&number) {
                        continue;
                    }
                    if own.tail().probability_of(number) == 0.0 {
                        rest += sent;
                        culled_some += usize::from(sent > 0.0);
                    }
                    let all = cells.lights(cell, 0.0);
                    let is_listed = all.main().any(|main| main == number)
                        || all.tail().probability_of(number) > 0.0;
                    assert!(is_listed || sent == 0.0, "{seed} {number} {light:?}: {sent}");
                }
                assert!(rest <= limit, "{seed} {p}: {rest} of {limit}");
            }
        }
        assert!(culled_some > 1000, "{culled_some}");
    }

    /// The probabilities of a tail add up to 1, and each light is chosen as often as its own says.
    #[test]
    fn a_tail_chooses_by_its_probabilities() {
        let mut next = random(5);
        let scene = scene((0..200).map(|_| light(&mut next)).collect());
        let cells = scene.light_cells.as_ref().expect("many lights");
        for _ in 0..50 {
            let lights = cells.lights(cells.cell(vector(&mut next)), 0.0);
            let tail = lights.tail();
            assert!(!tail.is_empty());
            let all: f64 = (0..200).map(|light| tail.probability_of(light)).sum();
            assert!((all - 1.0).abs() < 1e-9, "{all}");
            let mut chosen = [0.0; 200];
            for k in 0..4096 {
                let (light, probability) = tail.choose((f64::from(k) + 0.5) / 4096.0);
                assert!((probability - tail.probability_of(light)).abs() < 1e-12);
                chosen[light as usize] += 1.0 / 4096.0;
            }
            for light in 0..200 {
                let expected = tail.probability_of(light);
                assert!((chosen[light as usize] - expected).abs() < 1e-3, "{expected}");
            }
            assert!(tail.choose(0.0).1 > 0.0 && tail.choose(1.0 - 1e-16).1 > 0.0);
        }
    }

    /// Lights in one place, more of them than are ever traced one by one, and lights without radiance.
    #[test]
    fn coincident_and_black_lights_have_finite_probabilities() {
        let point = |intensity| Light::Point(PointLight { position: DVec3::ZERO, intensity });
        let black = SphereLight { centre: DVec3::X, radius: 0.1, radiance: Rgb::ZERO };
        let mut lights = vec![point(Rgb::ONE); 40];
        lights.extend(vec![Light::Sphere(black); 10]);
        let scene = scene(lights);
        let cells = scene.light_cells.as_ref().expect("many lights");
        for p in [DVec3::ZERO, DVec3::splat(1e-9), DVec3::splat(0.4), DVec3::splat(9.0)] {
            let lights = cells.lights(cells.cell(p), 0.0);
            assert!(lights.main().all(|light| light < 40));
            let all: f64 = (0..50).map(|light| lights.tail().probability_of(light)).sum();
            assert!((all - 1.0).abs() < 1e-9, "{p}: {all}");
            assert!((40..50).all(|light| lights.tail().probability_of(light) == 0.0));
        }
    }

    /// A light that is far brighter than all others, and lights next to the faces between cells, whose bounds there are
    /// as far above what they send to most of the cell.
    #[test]
    fn a_far_larger_bound_rounds_no_other_light_away() {
        let mut next = random(515);
        let face =
            |at: f64| DVec3::new(if at.is_sign_negative() { -1e-17 } else { 1e-17 }, at, 0.3);
        for (near, brightest) in [(0, 1e22f32), (0, 1.0), (3, 1.0), (30, 1.0), (30, 1e18)] {
            let point = |position, intensity| {
                Light::Point(PointLight { position, intensity: Rgb::splat(intensity) })
            };
            let mut lights: Vec<Light> = (0..40).map(|_| point(vector(&mut next), 0.01)).collect();
            lights.extend((0..near).map(|_| point(face(next()), 0.01)));
            lights.push(point(vector(&mut next), brightest));
            let count = lights.len() as u32;
            let scene = scene(lights);
            let cells = scene.light_cells.as_ref().expect("many lights");
            for _ in 0..200 {
                let p = vector(&mut next) * DVec3::new(1e-3, 1.0, 1.0);
                let tail = cells.lights(cells.cell(p), 0.0).tail();
                if tail.is_empty() {
                    continue;
                }
                assert!((1..=Tail::most_samples(8)).contains(&tail.samples(8)));
                let all: f64 = (0..count).map(|light| tail.probability_of(light)).sum();
                assert!((all - 1.0).abs() < 1e-9, "{near} {brightest}: {all}");
                for u in [0.0, 0.5 + 0.5 * next(), 1.0 - f64::EPSILON / 2.0] {
                    for limit in [0.0, 1e-6, 1e-3, 0.1] {
                        let tail = cells.lights(cells.cell(p), limit).tail();
                        if !tail.is_empty() {
                            let (light, probability) = tail.choose(u);
                            assert!(probability > 0.0 && probability == tail.probability_of(light));
                        }
                    }
                }
                // Where only the usual lights are in the tail, each is chosen now and then.
                let usual = tail.len() as u32 <= 40 && brightest == 1.0;
                let least = (0..40).map(|light| tail.probability_of(light)).filter(|p| *p > 0.0);
                assert!(!usual || least.fold(1.0, f64::min) > 1e-6, "{near}");
            }
        }
    }
}
