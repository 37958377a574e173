//! Whitted radiance (Whitted, 1980) along camera rays, by kernels that [`EffectPlan`] selects.
//!
//! Takes a scene, an intersector and a camera; gives a film. Direct light from lights,
//! emitting faces and the sky or an environment, light scattered once by fog, mirrors and glass, polished or rough, clear or absorbing, by recursion to a set depth.
//! Never looks at other frames.
//!
//! Not done: caustics (the shadow of glass is opaque, or light goes straight through), diffuse interreflection.

mod adaptive;
mod backdrop;
mod cone;
mod dimensions;
mod direct;
mod environment;
mod far_lights;
mod fog;
mod groups;
mod highlight;
mod in_scattering;
mod irradiance;
mod kernel;
pub(crate) mod light;
mod lobe;
mod medium;
mod medium_stack;
mod motion;
mod normal_map;
pub mod optics;
mod pilots;
mod pixels;
mod point;
mod scattered;
mod selection;
mod sky_samples;
mod source;
mod straight_shadows;
mod tail;
mod texture;

use crate::effects::EffectPlan;
use crate::film::{Film, GPixel, Provenance};
use crate::inference::{Channels, Inference, SAMPLES_TOGETHER, TracedPoints};
use crate::intersect::{Intersector, Ray};
use crate::math::Rgb;
use crate::sampling::PixelFilter;
use crate::scene::{Camera, Filter, Material, Rect, Scene, Settings};
use crate::stats::{BadSamples, RayCounts, ReuseCounts};
pub use adaptive::SampleSpread;
use adaptive::Until;
use backdrop::Backdrop;
pub(crate) use direct::ShadowStarts;
use environment::EnvironmentSource;
use in_scattering::FogInput;
use kernel::Scratch;
use medium_stack::MediumStack;
use pilots::LightFindings;
use pixels::{BlockPixels, FinishedPixel, SampleLimits};
use selection::{LightSelection, LightUsers, Reached};
use source::LightSource;
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Edge of a block in pixels.
const BLOCK: u32 = 8;
/// Edge of a tile, the unit of parallel work, in pixels; a multiple of the block's. Larger ones leave
/// threads idle at a frame's end: glass makes a tile cost twenty times its neighbour.
const TILE: u32 = 16;
/// Frames with fewer camera samples than this are cut into single blocks: a few tiles would not
/// keep the threads equally busy.
const SMALL: u64 = 8192;
/// Frames with fewer still stay on one thread: handing out work costs more.
const PARALLEL_FROM: u64 = 512;

/// What it takes to shade any frame of a job.
///
/// The effect plan is made here, of the very scene and settings that it is used with; no other gets in.
///
/// ```
/// use std::sync::atomic::AtomicBool;
/// use tweenray::intersect;
/// use tweenray::math::{DVec3, Rgb};
/// use tweenray::scene::{Camera, Material, Pose, Settings, World, WorldSphere};
/// use tweenray::shade::Renderer;
///
/// let mut world = World::default();
/// let grey = world.add_material(Material::diffuse("grey", Rgb::splat(0.5)));
/// world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, grey));
/// world.sky.radiance = Rgb::ONE;
/// let settings = Settings { width: 9, height: 9, ..Settings::default() };
/// let scene = world.into_scene(true)?;
/// let intersector = intersect::build(&scene, &settings, 1)?;
/// let pose = Pose::look_at(DVec3::new(0.0, 0.0, 9.0), DVec3::ZERO);
/// let camera = Camera::new(&pose, 40.0, 9, 9)?;
/// // A frame is `None` when somebody sets the flag before it is done.
/// let renderer = Renderer::new(&scene, &settings, &*intersector);
/// let (film, _) = renderer.render(&camera, 1, false, &AtomicBool::new(false), &()).unwrap();
/// // A ball under a sky that is the same all round shows its albedo.
/// assert_eq!(film.rgb[0], Rgb::ONE);
/// assert!((film.rgb[film.index(4, 4)] - Rgb::splat(0.5)).abs().max_element() < 1e-6);
/// # Ok::<(), tweenray::error::Error>(())
/// ```
#[derive(Clone, Copy)]
pub struct Renderer<'a> {
    /// The scene, scene space.
    pub(crate) scene: &'a Scene,
    /// The job's settings.
    pub(crate) settings: &'a Settings,
    plan: EffectPlan,
    /// What traces.
    pub(crate) intersector: &'a dyn Intersector,
}

/// Told about finished tiles, from any worker thread.
pub trait Progress: Sync {
    /// A tile is done: its share of the frame in `[0, 1]` and the rays it cast.
    fn tile_done(&self, share: f64, rays: &RayCounts);
}

/// Nobody watches.
impl Progress for () {
    fn tile_done(&self, _: f64, _: &RayCounts) {}
}

/// Reuse between frames: what is known before a frame, and what it is to leave behind.
#[derive(Clone, Copy)]
pub struct Reuse<'a> {
    /// The lights whose ratios are kept.
    pub channels: &'a Channels,
    /// Who knows about surface points; nobody where the frame is traced whole.
    pub inference: Option<&'a dyn Inference>,
    /// Whether what is traced is kept, as a source for other frames.
    pub is_source: bool,
}

/// A frame to render.
pub struct FrameJob<'a> {
    /// World space.
    pub camera: &'a Camera,
    /// Number that its random numbers depend on: the frame's, from 1, or another for other samples
    /// of the same frame.
    pub stream: u32,
    /// Whether first-hit records are kept.
    pub with_gbuffer: bool,
    /// `None` traces everything and keeps nothing.
    pub reuse: Option<Reuse<'a>>,
    /// Which pixels, row by row; `None` for all of the crop.
    pub mask: Option<&'a [bool]>,
    /// Whether what lies beyond the crop is traced too, as a source for other frames.
    pub beyond_crop: bool,
    /// Pixels that have been rendered already, and are part of the picture.
    pub known: Option<Known<'a>>,
    /// What pixels that may take more samples than others go by.
    pub sampling: Sampling<'a>,
}

impl<'a> FrameJob<'a> {
    /// All pixels of the crop, traced, without records.
    pub fn whole(camera: &'a Camera, stream: u32) -> Self {
        Self {
            camera,
            stream,
            with_gbuffer: false,
            reuse: None,
            mask: None,
            beyond_crop: false,
            known: None,
            sampling: Sampling::Neighbours,
        }
    }
}

/// Pixels of a frame that have been rendered already.
#[derive(Clone, Copy)]
pub struct Known<'a> {
    /// Which, row by row.
    pub mask: &'a [bool],
    /// What was rendered.
    pub rendered: &'a Rendered,
}

/// What the number of camera samples of a pixel follows, if it may be more than the least.
#[derive(Clone, Copy)]
pub enum Sampling<'a> {
    /// Its own samples and those of its neighbours, which are looked at even where they are not asked for.
    Neighbours,
    /// Its own samples and those of the neighbours that are asked for.
    Alone,
    /// Its own samples: so it has no more than with those of its neighbours.
    Own,
    /// The numbers given for each pixel of the film.
    As(&'a [u32]),
}

/// A rendered frame.
pub struct Rendered {
    /// The picture. Pixels outside of crop and mask are black.
    pub film: Film,
    /// Rays cast.
    pub rays: RayCounts,
    /// What was traced of the kept lights, if the frame is a source for others.
    pub sources: TracedPoints,
    /// How much was inferred.
    pub reuse: ReuseCounts,
    /// The differences among each pixel's camera samples; empty where every pixel takes as many samples.
    pub spreads: Vec<SampleSpread>,
    /// The same of the least number of samples, where more followed a pixel's own differences alone.
    pub pilots: Vec<SampleSpread>,
}

impl Rendered {
    /// How many samples each pixel has, also beyond the crop if it was rendered; empty where all have as many.
    pub fn sample_counts(&self) -> Vec<u32> {
        self.spreads.iter().map(|spread| spread.count).collect()
    }
}

/// What is fixed for one frame.
struct FrameInput<'a> {
    /// Scene space.
    camera: Camera,
    /// Edge of a pixel at distance 1 along the view axis, scene units.
    pixel_size: f64,
    /// Whether any material shows an image; else no path has a cone.
    has_textures: bool,
    stream: u32,
    /// The least number of camera samples of a pixel.
    least: u32,
    filter: PixelFilter,
    /// The lights that shine, the sky last.
    lights: Vec<LightSource>,
    /// Which of them are looked at where; `None` if all are everywhere.
    selection: Option<LightSelection<'a>>,
    /// An environment that shines, in place of the sky.
    environment: Option<EnvironmentSource<'a>>,
    /// What rays see that leave the scene, if it is more than the sky's colour.
    backdrop: Option<Backdrop<'a>>,
    /// The fog, if there is any.
    fog: Option<FogInput<'a>>,
    /// Bodies of ranked glass that the camera is in.
    around_eye: MediumStack,
    has_ranked_glass: bool,
    reuse: Option<Reuse<'a>>,
    /// Whether the points of any light may cast pilots alone.
    has_pilots: bool,
    /// Whether any light must be traced in every frame.
    has_always_traced: bool,
}

impl FrameInput<'_> {
    /// The spread along the view axis of the cone of camera sample number `sample`. As many as a pixel has cover it side by
    /// side; a pixel that goes on after the least number takes narrower ones.
    fn spread(&self, sample: u32) -> f64 {
        if !self.has_textures {
            return 0.0;
        }
        let goes_on = sample >= self.least;
        let together = (sample / SAMPLES_TOGETHER + 1).saturating_mul(SAMPLES_TOGETHER);
        let count = if goes_on { together } else { self.least };
        self.pixel_size / f64::from(count).sqrt()
    }

    /// The points, of so many, that source number `at` is traced at.
    fn reached<'u>(&self, at: usize, points: usize, users: &'u LightUsers) -> Reached<'u> {
        let source = &self.lights[at];
        match &self.selection {
            Some(_) if !source.is_sky() => users.of(at),
            _ => Reached::All(points, source.channel),
        }
    }
}

/// What blocks leave behind beside their pixels.
#[derive(Default)]
struct Left {
    sources: TracedPoints,
    reuse: ReuseCounts,
}

/// One finished tile: its pixels in one order in all lists.
#[derive(Default)]
struct TileDone {
    /// Where each pixel lies in the film.
    places: Vec<u32>,
    rgb: Vec<Rgb>,
    /// Empty where none are asked for, as `provenance`.
    records: Vec<GPixel>,
    provenance: Vec<Provenance>,
    /// Of more pixels, where they lie with what their samples say.
    spreads: Vec<(u32, SampleSpread)>,
    /// What pilots found, for blocks whose pixels may go on.
    findings: Vec<([u32; 2], LightFindings)>,
    rays: RayCounts,
    bad: BadSamples,
    left: Left,
}

impl TileDone {
    fn push(&mut self, place: u32, pixel: &FinishedPixel, is_kept: bool, with_provenance: bool) {
        self.spreads.extend(pixel.spread.map(|spread| (place, spread)));
        if !is_kept {
            return;
        }
        self.places.push(place);
        self.rgb.push(pixel.rgb);
        self.records.extend(pixel.record);
        self.provenance.extend(with_provenance.then_some(pixel.provenance));
    }
}

type BlockKernel =
    fn(&Renderer, &FrameInput, &Until, &mut BlockPixels, &mut Scratch, &mut Left) -> RayCounts;

impl<'a> Renderer<'a> {
    /// A renderer of `scene` under `settings`, whose rays `intersector` traces: one that was built of
    /// the same scene ([`intersect::build`](crate::intersect::build)).
    pub fn new(scene: &'a Scene, settings: &'a Settings, intersector: &'a dyn Intersector) -> Self {
        Self { scene, settings, plan: EffectPlan::of(scene, settings), intersector }
    }

    /// Which effects run.
    pub fn plan(&self) -> EffectPlan {
        self.plan
    }

    /// The same by the kernel that leaves no effect out, to measure and test the specialised ones. The
    /// picture and the rays are the same. (Sky rays stay as they were: of a sky that is seen, the scene says
    /// whether it also lights.)
    pub fn with_every_effect(mut self) -> Self {
        // What settings choose stays.
        let EffectPlan { sky_light, glass_shadows, .. } = self.plan;
        self.plan = EffectPlan { sky_light, glass_shadows, ..EffectPlan::EVERYTHING };
        self
    }

    /// The same without any light but what surfaces and sky emit and the ambient term, to measure what
    /// lights cost.
    pub fn without_lights(mut self) -> Self {
        let (area_lights, delta_lights, sky_light) = (false, false, false);
        self.plan = EffectPlan { area_lights, delta_lights, sky_light, ..self.plan };
        self
    }
}

impl Renderer<'_> {
    /// Renders frame number `frame` (from 1) through `camera` (world space) on the current rayon
    /// pool. `None` when `stop` was set before the frame was finished. To be called from outside the
    /// pool's own loops: a thread that waits for the frame's tiles takes up other work of its pool.
    ///
    /// The bytes depend on scene, settings, camera and frame number only. With a crop the film
    /// has the full size and is black outside of it.
    pub fn render(
        &self,
        camera: &Camera,
        frame: u32,
        with_gbuffer: bool,
        stop: &AtomicBool,
        progress: &dyn Progress,
    ) -> Option<(Film, RayCounts)> {
        let job = FrameJob { with_gbuffer, ..FrameJob::whole(camera, frame) };
        self.render_job(&job, stop, progress).map(|done| (done.film, done.rays))
    }

    /// Renders a frame with all that one can ask for; `None` as [`render`](Self::render).
    pub fn render_job(
        &self,
        job: &FrameJob,
        stop: &AtomicBool,
        progress: &dyn Progress,
    ) -> Option<Rendered> {
        let camera = job.camera;
        let input = self.input(job);
        let full = Rect { x0: 0, y0: 0, x1: camera.width, y1: camera.height };
        let crop = self.settings.crop.map_or(full, |c| intersection(&c, &full));
        let own = aligned(if job.beyond_crop { &full } else { &crop }, &full);
        let with_neighbours =
            self.settings.most_spp.is_some() && matches!(job.sampling, Sampling::Neighbours);
        let known = job.known.map(|known| known.mask);
        let part = Part { image: full, crop, own, mask: job.mask, known, with_neighbours };
        let mut rendered = Rendered::new(job, self.settings.most_spp.is_some());
        let Some(most) = self.settings.most_spp else {
            let pass = Pass::first(own, self.settings.spp);
            self.pass((job, &input, &part, 1.0), &pass, &mut rendered, stop, progress)?;
            rendered.take_over(job, &part);
            return Some(rendered);
        };
        let region = if with_neighbours { aligned(&grown(&own), &full) } else { own };
        let first = Pass::first(region, self.settings.spp);
        let findings =
            self.pass((job, &input, &part, 0.5), &first, &mut rendered, stop, progress)?;
        rendered.take_over_pilots(job);
        let beside = match job.sampling {
            Sampling::Neighbours | Sampling::Alone => {
                adaptive::beside(&rendered.spreads, camera.width)
            }
            Sampling::Own => {
                rendered.pilots = rendered.spreads.clone();
                vec![0.0; rendered.spreads.len()]
            }
            Sampling::As(_) => Vec::new(),
        };
        let until = match job.sampling {
            Sampling::As(counts) => Until::Each(counts),
            Sampling::Neighbours | Sampling::Alone | Sampling::Own => {
                Until::Differences { beside: &beside, most }
            }
        };
        // Pixels that were rendered already may lack samples that their neighbours call for.
        rendered.take_over(job, &part);
        let more = Pass { region: own, until, goes_on: true, findings };
        self.pass((job, &input, &part, 0.5), &more, &mut rendered, stop, progress)?;
        rendered.finish_samples(&part);
        Some(rendered)
    }

    /// Takes camera samples of the pixels of a region and puts what they show into `rendered`. `None` when `stop` was
    /// set before the end.
    fn pass(
        &self,
        (job, input, part, share): (&FrameJob, &FrameInput, &Part, f64),
        pass: &Pass,
        rendered: &mut Rendered,
        stop: &AtomicBool,
        progress: &dyn Progress,
    ) -> Option<BlockFindings> {
        let region = &pass.region;
        let samples = u64::from(region.x1 - region.x0)
            * u64::from(region.y1 - region.y0)
            * u64::from(self.settings.spp);
        let tiles = split(region, if samples < SMALL { BLOCK } else { TILE });
        let share = share / tiles.len().max(1) as f64;
        let kernel = self.kernel();
        let spread = self.settings.most_spp.map(|_| self.settings.exposure);
        let limits = SampleLimits { most: self.settings.most_radiance(), spread };
        let with_records = job.with_gbuffer && !pass.goes_on;
        let start = || (BlockPixels::new(with_records, limits), Scratch::default());
        let before = pass.goes_on.then_some(&*rendered);
        let one = |state: &mut (BlockPixels, Scratch), tile: &Rect| {
            let done = self.tile((input, part, kernel), tile, (pass, before), state, stop)?;
            progress.tile_done(share, &done.rays);
            Some(done)
        };
        let done: Option<Vec<TileDone>> = if samples < PARALLEL_FROM {
            let mut state = start();
            tiles.iter().map(|tile| one(&mut state, tile)).collect()
        } else {
            take_turns(&tiles, start, one)
        };
        let mut findings = BlockFindings::new();
        for mut tile in done? {
            findings.extend(tile.findings.drain(..));
            rendered.add(tile);
        }
        Some(findings)
    }

    fn input<'a>(&'a self, job: &FrameJob<'a>) -> FrameInput<'a> {
        let FrameJob { camera, stream, reuse, .. } = *job;
        // Single pixels have no neighbours that pilots could be compared with.
        let stops_early = matches!(job.sampling, Sampling::Neighbours);
        let own = camera.to_scene(&self.scene.recentring);
        let is_ranked = |m: &Material| m.glass.as_ref().is_some_and(medium_stack::is_ranked);
        let has_ranked_glass = self.scene.materials.iter().any(is_ranked);
        let around_eye = match has_ranked_glass && self.plan.nested_glass {
            true => {
                let ray = Ray::new(own.eye, own.forward);
                MediumStack::at(self, &ray, &mut Vec::new(), &mut RayCounts::default())
            }
            false => MediumStack::default(),
        };
        let lights = self.light_sources(reuse, stops_early);
        FrameInput {
            camera: own,
            pixel_size: own.pixel_size(),
            has_textures: self.plan.textures,
            stream,
            least: self.settings.spp,
            filter: pixel_filter(self.settings.filter),
            selection: self.light_selection(&lights),
            fog: self.fog().map(|fog| FogInput::of(fog, self.scene, &lights)),
            has_pilots: lights.iter().any(|light| light.pilots < light.samples),
            lights,
            environment: self.environment_source(reuse),
            backdrop: if self.plan.environment { Backdrop::of(self.scene) } else { None },
            around_eye,
            has_ranked_glass,
            reuse,
            has_always_traced: self.scene.has_always_traced(),
        }
    }

    fn tile(
        &self,
        (input, part, kernel): (&FrameInput, &Part, BlockKernel),
        tile: &Rect,
        (pass, before): (&Pass, Option<&Rendered>),
        (pixels, scratch): &mut (BlockPixels, Scratch),
        stop: &AtomicBool,
    ) -> Option<TileDone> {
        let mut out = TileDone::default();
        let width = input.camera.width;
        let is_adaptive = self.settings.most_spp.is_some();
        for block in split(tile, BLOCK) {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let is_own = part.is_own(&block);
            if !is_own && (pass.goes_on || !part.is_beside(&block)) {
                continue;
            }
            let wanted = |x: u32, y: u32| {
                let at = (y * width + x) as usize;
                let is_asked_for = !is_own || part.is_masked_in(at);
                is_asked_for
                    && match before {
                        None => !part.is_known(at),
                        Some(before) => {
                            let spread = &before.spreads[at];
                            spread.count < pass.until.count(at, Some(spread))
                        }
                    }
            };
            pixels.start(&block, self.settings.seed, input.stream, wanted);
            if pixels.len() == 0 {
                continue;
            }
            if let Some(before) = before {
                pixels.resume(&before.film, &before.spreads, |at| part.is_known(at));
            }
            let place = [block.x0, block.y0];
            if input.has_pilots {
                pixels.start_pilots(input.lights.len(), pass.findings.get(&place));
            }
            let mut unused = Left::default();
            let left = if is_own { &mut out.left } else { &mut unused };
            let rays = kernel(self, input, &pass.until, pixels, scratch, left);
            if input.has_pilots && is_adaptive && is_own && !pass.goes_on {
                out.findings.push((place, pixels.findings().collect()));
            }
            // What lies around a rank's rows are another rank's own.
            if is_own {
                out.rays += rays;
            }
            for pixel in pixels.finished(self.settings.flag_bad) {
                // What lies beyond the crop goes on with it, so that its batches are those of the whole frame.
                let is_kept = is_own && (is_adaptive || part.is_in_crop(pixel.x, pixel.y));
                out.push(pixel.y * width + pixel.x, &pixel, is_kept, input.reuse.is_some());
            }
            let bad = pixels.bad().filter(|(x, y, _)| is_own && part.is_in_crop(*x, *y));
            bad.for_each(|(x, y, fault)| out.bad.count(fault, x, y));
        }
        Some(out)
    }

    /// The kernel that the plan calls for: one of six. Lights need none of their own, since it loops over
    /// those that shine.
    fn kernel(&self) -> BlockKernel {
        let EffectPlan { mirror, glass, nested_glass, .. } = self.plan;
        match (mirror, glass, nested_glass) {
            (false, false, _) => kernel::block::<false, false, false>,
            (false, true, false) => kernel::block::<false, true, false>,
            (false, true, true) => kernel::block::<false, true, true>,
            (true, false, _) => kernel::block::<true, false, false>,
            (true, true, false) => kernel::block::<true, true, false>,
            (true, true, true) => kernel::block::<true, true, true>,
        }
    }
}

fn pixel_filter(filter: Filter) -> PixelFilter {
    match filter {
        Filter::Box => PixelFilter::boxed(),
        Filter::Tent => PixelFilter::tent(),
        Filter::Gaussian => PixelFilter::gaussian(),
        Filter::BlackmanHarris => PixelFilter::blackman_harris(),
    }
}

/// Some camera samples of a frame.
struct Pass<'p> {
    /// The blocks that are looked at.
    region: Rect,
    /// How many samples each pixel has at the end.
    until: Until<'p>,
    /// Whether the pixels have samples already.
    goes_on: bool,
    /// What pilots found with these, by block.
    findings: BlockFindings,
}

/// What pilots found of those lights that have any, by the first column and row of a block.
type BlockFindings = HashMap<[u32; 2], LightFindings>;

impl Pass<'_> {
    /// The first `spp` samples of each pixel of `region`.
    fn first(region: Rect, spp: u32) -> Self {
        Self { region, until: Until::Count(spp), goes_on: false, findings: BlockFindings::new() }
    }
}

/// Which part of the image is wanted.
struct Part<'a> {
    image: Rect,
    crop: Rect,
    /// The blocks that are rendered: whole ones, but for the mask.
    own: Rect,
    mask: Option<&'a [bool]>,
    /// Pixels that are rendered already.
    known: Option<&'a [bool]>,
    /// Whether the first samples of the blocks around it are looked at too.
    with_neighbours: bool,
}

impl Part<'_> {
    fn is_masked_in(&self, at: usize) -> bool {
        self.mask.is_none_or(|mask| mask[at])
    }

    fn is_known(&self, at: usize) -> bool {
        self.known.is_some_and(|known| known[at])
    }

    /// Whether any pixel of `block` is wanted.
    fn is_own(&self, block: &Rect) -> bool {
        let Rect { x0, y0, x1, y1 } = intersection(block, &self.own);
        let mut places = (y0..y1).flat_map(|y| (x0..x1).map(move |x| y * self.image.x1 + x));
        places.any(|at| self.is_masked_in(at as usize))
    }

    /// Whether `block` touches one of which a pixel is wanted, and is looked at for that.
    fn is_beside(&self, block: &Rect) -> bool {
        let around = aligned(&grown(block), &self.image);
        self.with_neighbours && split(&around, BLOCK).iter().any(|block| self.is_own(block))
    }

    fn is_in_crop(&self, x: u32, y: u32) -> bool {
        let crop = &self.crop;
        x >= crop.x0 && x < crop.x1 && y >= crop.y0 && y < crop.y1
    }
}

/// Does `one` with all of `tiles` on the threads of the current rayon pool: each takes the next tile
/// when it is done with one, so that none is left with a share that turns out expensive. In the order of
/// `tiles`; `None` as soon as `one` gives that.
fn take_turns<S, T: Send>(
    tiles: &[Rect],
    start: impl Fn() -> S + Sync,
    one: impl Fn(&mut S, &Rect) -> Option<T> + Sync,
) -> Option<Vec<T>> {
    let next = AtomicUsize::new(0);
    let by_thread = rayon::broadcast(|_| {
        let mut state = start();
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(tile) = tiles.get(i) else { return Some(done) };
            done.push((i, one(&mut state, tile)?));
        }
    });
    let by_thread: Option<Vec<Vec<(usize, T)>>> = by_thread.into_iter().collect();
    let mut done: Vec<(usize, T)> = by_thread?.into_iter().flatten().collect();
    done.sort_unstable_by_key(|(i, _)| *i);
    Some(done.into_iter().map(|(_, tile)| tile).collect())
}

impl Rendered {
    fn new(job: &FrameJob, is_adaptive: bool) -> Self {
        let mut film = Film::new(job.camera.width, job.camera.height, job.with_gbuffer);
        let pixels = film.rgb.len();
        film.provenance = job.reuse.map(|_| vec![Provenance::default(); pixels]);
        let spreads = vec![SampleSpread::default(); if is_adaptive { pixels } else { 0 }];
        let (rays, reuse) = (RayCounts::default(), ReuseCounts::default());
        Self { film, rays, sources: TracedPoints::default(), reuse, spreads, pilots: Vec::new() }
    }

    fn add(&mut self, tile: TileDone) {
        let film = &mut self.film;
        self.rays += tile.rays;
        film.bad += tile.bad;
        self.reuse += tile.left.reuse;
        self.sources.append(tile.left.sources);
        let places = || tile.places.iter().map(|place| *place as usize);
        places().zip(&tile.rgb).for_each(|(at, rgb)| film.rgb[at] = *rgb);
        if let Some(gbuffer) = &mut film.gbuffer {
            places().zip(&tile.records).for_each(|(at, record)| gbuffer.set(at, record));
        }
        if let Some(provenance) = &mut film.provenance {
            places().zip(&tile.provenance).for_each(|(at, own)| provenance[at] = *own);
        }
        tile.spreads.iter().for_each(|(at, spread)| self.spreads[*at as usize] = *spread);
    }

    /// Takes over what the least number of samples told in the pixels that were rendered already, as if they had no
    /// more yet.
    fn take_over_pilots(&mut self, job: &FrameJob) {
        let Some(Known { mask, rendered }) = job.known else { return };
        for (at, spread) in rendered.pilots.iter().enumerate().filter(|(at, _)| mask[*at]) {
            self.spreads[at] = *spread;
        }
    }

    /// Takes over the pixels that were rendered already.
    fn take_over(&mut self, job: &FrameJob, part: &Part) {
        let Some(Known { mask, rendered }) = job.known else { return };
        let (film, from) = (&mut self.film, &rendered.film);
        for at in (0..mask.len()).filter(|at| mask[*at]) {
            if let (Some(to), Some(spread)) = (self.spreads.get_mut(at), rendered.spreads.get(at)) {
                *to = *spread;
            }
            let (x, y) = (at as u32 % film.width, at as u32 / film.width);
            let is_kept = !self.spreads.is_empty() || part.is_in_crop(x, y);
            if !is_kept || !part.is_masked_in(at) {
                continue;
            }
            film.rgb[at] = from.rgb[at];
            if let (Some(to), Some(from)) = (&mut film.provenance, &from.provenance) {
                to[at] = from[at];
            }
            if let (Some(to), Some(from)) = (&mut film.gbuffer, &from.gbuffer) {
                to.set(at, &from.get(at));
            }
        }
    }

    /// Notes how many samples each pixel has, and clears those that were not asked for.
    fn finish_samples(&mut self, part: &Part) {
        let mut samples = self.sample_counts();
        let film = &mut self.film;
        for (at, samples) in samples.iter_mut().enumerate() {
            let (x, y) = (at as u32 % film.width, at as u32 / film.width);
            if part.is_masked_in(at) && part.is_in_crop(x, y) {
                continue;
            }
            *samples = 0;
            film.rgb[at] = Rgb::ZERO;
            if let Some(provenance) = &mut film.provenance {
                provenance[at] = Provenance::default();
            }
            if let Some(gbuffer) = &mut film.gbuffer {
                gbuffer.set(at, &GPixel::EMPTY);
            }
        }
        film.samples = Some(samples);
    }
}

fn intersection(a: &Rect, b: &Rect) -> Rect {
    let (x0, y0) = (a.x0.max(b.x0).min(b.x1), a.y0.max(b.y0).min(b.y1));
    Rect { x0, y0, x1: a.x1.min(b.x1).max(x0), y1: a.y1.min(b.y1).max(y0) }
}

/// The whole blocks that hold `crop`, cut by the image alone: what a block's rays are never
/// depends on the crop.
fn aligned(crop: &Rect, image: &Rect) -> Rect {
    let up = |x: u32| x.div_ceil(BLOCK) * BLOCK;
    Rect {
        x0: crop.x0 / BLOCK * BLOCK,
        y0: crop.y0 / BLOCK * BLOCK,
        x1: up(crop.x1).min(image.x1),
        y1: up(crop.y1).min(image.y1),
    }
}

/// `rect` and what touches it.
fn grown(rect: &Rect) -> Rect {
    let Rect { x0, y0, x1, y1 } = *rect;
    Rect { x0: x0.saturating_sub(1), y0: y0.saturating_sub(1), x1: x1 + 1, y1: y1 + 1 }
}

/// `rect` in squares of `edge` pixels, row by row; those at the far sides may be smaller.
fn split(rect: &Rect, edge: u32) -> Vec<Rect> {
    let mut parts = Vec::new();
    for y0 in (rect.y0..rect.y1).step_by(edge as usize) {
        for x0 in (rect.x0..rect.x1).step_by(edge as usize) {
            parts.push(Rect { x0, y0, x1: (x0 + edge).min(rect.x1), y1: (y0 + edge).min(rect.y1) });
        }
    }
    parts
}
