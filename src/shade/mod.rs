//! Whitted radiance (Whitted, 1980) along camera rays, by kernels that [`EffectPlan`] selects.
//!
//! Takes a scene, an intersector and a camera; gives a film. Direct light from area, point and
//! directional lights and the sky, perfect mirrors and clear glass by recursion to a set depth.
//! Never looks at other frames.
//!
//! Not done: light through glass (its shadow is opaque), glossy lobes, diffuse interreflection.

mod interior;
mod irradiance;
mod kernel;
pub(crate) mod light;
mod lighting;
pub mod optics;
mod pixels;
mod surface;

use crate::effects::EffectPlan;
use crate::film::{Film, GPixel};
use crate::intersect::Intersector;
use crate::math::Rgb;
use crate::sampling::PixelFilter;
use crate::scene::{Camera, Filter, Rect, Scene, Settings};
use crate::stats::{BadSamples, RayCounts};
use interior::Interior;
use kernel::Scratch;
use light::AreaLight;
use pixels::{BLOCK, BlockPixels};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Edge of a tile, the unit of parallel work, in pixels; a multiple of the block's.
const TILE: u32 = 32;
/// Frames with fewer camera samples than this are cut into single blocks: a few tiles would not
/// keep the threads equally busy.
const SMALL: u64 = 8192;
/// Frames with fewer still stay on one thread: handing out work costs more.
const PARALLEL_FROM: u64 = 512;

/// What it takes to shade any frame of a job.
pub struct Renderer<'a> {
    /// The scene, scene space.
    pub scene: &'a Scene,
    /// The job's settings.
    pub settings: &'a Settings,
    /// What runs.
    pub plan: EffectPlan,
    /// What traces.
    pub intersector: &'a dyn Intersector,
}

/// Told about finished tiles, from any worker thread.
pub trait Progress: Sync {
    /// A tile is done: its share of the frame in `[0, 1]` and the rays it cast.
    fn tile_done(&self, share: f64, rays: &RayCounts);
}

/// What is fixed for one frame.
struct FrameInput {
    /// Scene space.
    camera: Camera,
    frame: u32,
    filter: PixelFilter,
    /// For each light of the scene, its area form.
    area_lights: Vec<Option<AreaLight>>,
    /// Bodies of ranked glass that the camera is in.
    around_eye: Interior,
}

/// One finished tile.
#[derive(Default)]
struct TileDone {
    /// Each pixel's place, radiance and record.
    pixels: Vec<(u32, u32, Rgb, Option<GPixel>)>,
    rays: RayCounts,
    bad: BadSamples,
}

type BlockKernel = fn(&Renderer, &FrameInput, &mut BlockPixels, &mut Scratch) -> RayCounts;

impl Renderer<'_> {
    /// Renders frame number `frame` (from 1) through `camera` (world space) on the current rayon
    /// pool. `None` when `stop` was set before the frame was finished.
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
        let own = camera.to_scene(&self.scene.recentring);
        let around_eye = match self.plan.nested_glass {
            true => Interior::at(self, own.eye, own.forward),
            false => Interior::default(),
        };
        let input = FrameInput {
            camera: own,
            frame,
            filter: pixel_filter(self.settings.filter),
            area_lights: self.scene.lights.iter().map(AreaLight::new).collect(),
            around_eye,
        };
        let full = Rect { x0: 0, y0: 0, x1: camera.width, y1: camera.height };
        let crop = self.settings.crop.map_or(full, |c| intersection(&c, &full));
        let samples = u64::from(crop.x1 - crop.x0)
            * u64::from(crop.y1 - crop.y0)
            * u64::from(self.settings.spp);
        let tiles = split(&aligned(&crop, &full), if samples < SMALL { BLOCK } else { TILE });
        let share = 1.0 / tiles.len().max(1) as f64;
        let kernel = self.kernel();
        let start = || (BlockPixels::new(with_gbuffer), Scratch::default());
        let one = |state: &mut (BlockPixels, Scratch), tile: &Rect| {
            let done = self.tile(&input, tile, &crop, kernel, state, stop)?;
            progress.tile_done(share, &done.rays);
            Some(done)
        };
        let done: Option<Vec<TileDone>> = if samples < PARALLEL_FROM {
            let mut state = start();
            tiles.iter().map(|tile| one(&mut state, tile)).collect()
        } else {
            tiles.par_iter().map_init(start, one).collect()
        };
        Some(assemble(camera, with_gbuffer, done?))
    }

    fn tile(
        &self,
        input: &FrameInput,
        tile: &Rect,
        crop: &Rect,
        kernel: BlockKernel,
        (pixels, scratch): &mut (BlockPixels, Scratch),
        stop: &AtomicBool,
    ) -> Option<TileDone> {
        let mut out = TileDone::default();
        for block in split(tile, BLOCK) {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            pixels.start(&block, self.settings.seed, input.frame);
            out.rays += kernel(self, input, pixels, scratch);
            let inside =
                |x: u32, y: u32| x >= crop.x0 && x < crop.x1 && y >= crop.y0 && y < crop.y1;
            let finished = pixels.finished(self.settings.spp, self.settings.flag_bad);
            out.pixels.extend(finished.filter(|(x, y, _, _)| inside(*x, *y)));
            let bad = pixels.bad().filter(|(x, y, _)| inside(*x, *y));
            bad.for_each(|(x, y, fault)| out.bad.count(fault, x, y));
        }
        Some(out)
    }

    /// The kernel that the plan calls for: one of twenty-four.
    fn kernel(&self) -> BlockKernel {
        let EffectPlan { mirror, glass, nested_glass, area_lights, sky_light, .. } = self.plan;
        macro_rules! choose {
            ($([$m:literal $g:literal $n:literal $a:literal $s:literal])*) => {
                match (mirror, glass, glass && nested_glass, area_lights, sky_light) {
                    $(($m, $g, $n, $a, $s) => kernel::block::<$m, $g, $n, $a, $s>,)*
                    // Nested glass is glass.
                    (_, false, true, _, _) => unreachable!(),
                }
            };
        }
        choose! {
            [false false false false false] [false false false false true]
            [false false false true false] [false false false true true]
            [false true false false false] [false true false false true]
            [false true false true false] [false true false true true]
            [false true true false false] [false true true false true]
            [false true true true false] [false true true true true]
            [true false false false false] [true false false false true]
            [true false false true false] [true false false true true]
            [true true false false false] [true true false false true]
            [true true false true false] [true true false true true]
            [true true true false false] [true true true false true]
            [true true true true false] [true true true true true]
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

fn assemble(camera: &Camera, with_gbuffer: bool, tiles: Vec<TileDone>) -> (Film, RayCounts) {
    let mut film = Film::new(camera.width, camera.height, with_gbuffer);
    let mut counts = RayCounts::default();
    for tile in tiles {
        counts += tile.rays;
        film.bad += tile.bad;
        for (x, y, rgb, record) in tile.pixels {
            let index = film.index(x, y);
            film.rgb[index] = rgb;
            if let (Some(gbuffer), Some(record)) = (&mut film.gbuffer, record) {
                gbuffer.set(index, &record);
            }
        }
    }
    (film, counts)
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
