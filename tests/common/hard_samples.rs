//! Scenes in which a pixel's first camera samples see what matters only by chance, and how much nearer to the truth adaptive
//! samples are there than as many rays of uniform ones.

#![allow(
    clippy::unwrap_used,
    dead_code,
    missing_docs,
    reason = "the tests and the bench each use their part"
)]

use super::moves::{Set, Stage, codes, mean_square};
use std::fmt::Write;
use std::ops::Range;
use tweenray::film::Film;
use tweenray::import::{self, LoadOptions};
use tweenray::math::Rgb;
use tweenray::output::{WriteOptions, write_image};
use tweenray::scene::{Settings, Shot};
use tweenray::shade::FrameJob;

/// Camera samples of the truth.
const TRUTH: u32 = 512;

/// Checks of 16 texels on the left, of single texels on the right, and a slow gradient between.
fn texture() -> Film {
    const SIDE: u32 = 512;
    let mut film = Film::new(SIDE, SIDE, false);
    for (i, c) in film.rgb.iter_mut().enumerate() {
        let (x, y) = (i as u32 % SIDE, i as u32 / SIDE);
        let value = match 3 * x / SIDE {
            0 => [0.05, 0.9][((x / 16 + y / 16) % 2) as usize],
            1 => 0.1 + 0.8 * y as f32 / SIDE as f32,
            _ => [0.05, 0.9][((x + y) % 2) as usize],
        };
        *c = Rgb::new(value, 0.8 * value, 0.3 + 0.4 * value);
    }
    film
}

/// Round holes with a leaf between them each: of 32 texels on the left, of 8 on the right.
fn holes() -> Film {
    const SIDE: u32 = 512;
    let mut film = Film::new(SIDE, SIDE, false);
    for (i, c) in film.rgb.iter_mut().enumerate() {
        let (x, y) = (i as u32 % SIDE, i as u32 / SIDE);
        let edge = if x < SIDE / 2 { 32 } else { 8 };
        // Discs of other sizes, each in the middle of a cell.
        let cell = (x / edge).wrapping_mul(73).wrapping_add((y / edge).wrapping_mul(151)) % 13;
        let radius = edge as f32 * (0.25 + 0.25 * cell as f32 / 13.0);
        let off = [x, y].map(|k| (k % edge) as f32 + 0.5 - 0.5 * edge as f32);
        *c = Rgb::splat(if off[0].hypot(off[1]) < radius { 0.0 } else { 1.0 });
    }
    film
}

/// A floor under `texture.png`, lit from above; `more` has the rest of the scene.
fn on_a_floor(camera: &str, more: &str) -> String {
    format!(
        "camera = {{ frames = 16, {camera} orbit = {{ eye = [0, 1.6, 7], target = [0, 0.6, 0], degrees = 20 }} }}\n\
         sky = {{ radiance = [0.2, 0.25, 0.35], lights = false, ambient = 0.2 }}\n\
         [material.floor]\ntexture = 'texture.png'\n\
         [material.grey]\ndiffuse = 0.6\n\
         [material.lace]\ndiffuse = [0.2, 0.4, 0.1]\nalpha = 'holes.png'\n\
         [material.chrome]\nmirror = 0.9\n\
         [material.brushed]\ndiffuse = [0.15, 0.03, 0.02]\nmirror = 0.6\nroughness = 0.12\n\
         [material.satin]\ndiffuse = 0.1\nmirror = [0.7, 0.6, 0.4]\nroughness = 0.3\n\
         [[mesh]]\nquad = {{ centre = [0, 0, -4], normal = 'y', size = [14, 20] }}\nmaterial = 'floor'\n\
         {more}"
    )
}

const LAMP: &str =
    "[[light]]\nquad = { centre = [1, 6, 2], normal = '-y', size = [1, 1], radiance = 40 }\n";

fn fine_textures() -> String {
    on_a_floor("", LAMP)
}

/// A fence of bars a fifth of a pixel wide, upright and slanted.
fn thin_bars() -> String {
    let mut bars = String::from(LAMP);
    for i in -20..=20 {
        let (x, turn) = (0.15 * f64::from(i), if i % 2 == 0 { 0.0 } else { 23.0 });
        writeln!(
            bars,
            "[[mesh]]\nbox = {{ min = [-0.006, 0, -0.006], max = [0.006, 2, 0.006] }}\nmaterial = 'grey'\n\
             transform = [{{ rotate = {{ axis = 'z', degrees = {turn} }} }}, {{ translate = [{x}, 0, 1] }}]"
        )
        .unwrap();
    }
    on_a_floor("", &bars)
}

/// Cards full of round holes, which turn away from the eye, and their shadows.
fn cut_outs() -> String {
    let mut cards = String::from(LAMP);
    for i in 0..5 {
        let (x, z, turn) = (1.5 * f64::from(i) - 3.0, -0.7 * f64::from(i % 2), 17 * i - 20);
        writeln!(
            cards,
            "[[mesh]]\nquad = {{ centre = [0, 0, 0], normal = 'z', size = [1.8, 1.8] }}\nmaterial = 'lace'\n\
             transform = [{{ rotate = {{ axis = 'y', degrees = {turn} }} }}, {{ translate = [{x}, 1, {z}] }}]"
        )
        .unwrap();
    }
    on_a_floor("", &cards)
}

/// Small bright balls far behind the plane in focus, and a sharp one before them.
fn defocus() -> String {
    let mut balls = String::from(LAMP);
    for i in 0..24 {
        let (x, y, z) = (0.9 * f64::from(i % 8) - 3.0, 0.4 + 0.8 * f64::from(i / 8), -4.0);
        writeln!(balls, "[[sphere]]\ncentre = [{x}, {y}, {z}]\nradius = 0.08\nmaterial = 'chrome'")
            .unwrap();
    }
    balls += "[[sphere]]\ncentre = [0, 0.6, 2]\nradius = 0.5\nmaterial = 'grey'\n";
    on_a_floor("lens = { radius = 0.12, focus = 5.0 },", &balls)
}

/// Rough mirrors under a small bright lamp.
fn highlights() -> String {
    let mut balls = String::from(
        "[[light]]\nsphere = { centre = [2, 5, 4], radius = 0.06, radiance = 2500 }\n",
    );
    for (i, name) in ["brushed", "satin", "chrome", "brushed", "satin"].into_iter().enumerate() {
        let x = 1.3 * i as f64 - 2.6;
        writeln!(balls, "[[sphere]]\ncentre = [{x}, 0.6, 0]\nradius = 0.6\nmaterial = '{name}'")
            .unwrap();
    }
    on_a_floor("", &balls)
}

/// A scene that is hard for adaptive samples.
pub struct Case {
    pub name: &'static str,
    /// The scene file.
    text: fn() -> String,
}

pub const TEXTURES: Case = Case { name: "fine textures", text: fine_textures };
pub const BARS: Case = Case { name: "thin bars", text: thin_bars };
pub const CUT_OUTS: Case = Case { name: "cut-outs", text: cut_outs };
pub const DEFOCUS: Case = Case { name: "defocus", text: defocus };
pub const HIGHLIGHTS: Case = Case { name: "moving highlights", text: highlights };

/// All of them.
pub const CASES: [Case; 5] = [TEXTURES, BARS, CUT_OUTS, DEFOCUS, HIGHLIGHTS];

fn load(text: &str) -> Set {
    let folder = tempfile::tempdir().unwrap();
    for (name, film) in [("texture.png", texture()), ("holes.png", holes())] {
        write_image(folder.path().join(name), &film, &WriteOptions::default()).unwrap();
    }
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let loaded = import::load(&path, &LoadOptions::default()).expect("the scene loads");
    Set { settings: loaded.settings, ..Set::of(loaded.world, loaded.shot) }
}

struct Hard<'s> {
    stage: Stage<'s>,
    shot: Shot,
    base: Settings,
}

impl Hard<'_> {
    /// A frame, and its rays.
    fn traced(&self, frame: u32, seed: u64, (spp, most_spp): (u32, Option<u32>)) -> (Film, f64) {
        let settings = Settings { seed, spp, most_spp, ..self.base.clone() };
        let camera = self.shot.camera(frame, settings.width, settings.height).unwrap();
        let renderer = self.stage.renderer(&settings);
        let job = FrameJob::whole(&camera, frame);
        let render = || renderer.render_job(&job, &self.stage.stop, &()).unwrap();
        let done = self.stage.pool.install(render);
        (done.film, done.rays.total() as f64)
    }

    /// Rays of a frame and its mean squared error, the mean over `seeds`.
    fn figures(
        &self,
        frames: &[(u32, Vec<[f64; 3]>)],
        seeds: &Range<u64>,
        spp: (u32, Option<u32>),
    ) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (frame, truth) in frames {
            for seed in seeds.clone() {
                let (film, rays) = self.traced(*frame, seed, spp);
                let error = mean_square(&codes(&self.base, &film), truth);
                sums.iter_mut().zip([rays, error]).for_each(|(sum, x)| *sum += x);
            }
        }
        sums.map(|sum| sum / (seeds.clone().count() * frames.len()) as f64)
    }
}

/// By how many decibels each of `ranges` is nearer to the truth than uniform samples of as many rays, whose error is
/// interpolated between powers of two: the mean over `frames` and `seeds`.
pub fn gains(
    case: &Case,
    size: (u32, u32),
    frames: &[u32],
    seeds: &Range<u64>,
    ranges: &[(u32, u32)],
) -> Vec<f64> {
    let set = load(&(case.text)());
    let (base, shot) = (set.settings(size, 4, 4), set.shot.clone());
    let hard = Hard { stage: set.stage(2), shot, base };
    let truth = |frame: &u32| {
        let (film, _) = hard.traced(*frame, 9000, (TRUTH, None));
        (*frame, codes(&hard.base, &film))
    };
    let frames: Vec<_> = frames.iter().map(truth).collect();
    let highest = ranges.iter().map(|(_, most)| *most).max().unwrap_or(1);
    let counts = (1..).map(|k| 1 << k).take_while(|n| *n <= highest);
    let uniform: Vec<[f64; 2]> = counts.map(|n| hard.figures(&frames, seeds, (n, None))).collect();
    let gain = |(least, most): &(u32, u32)| {
        let [rays, error] = hard.figures(&frames, seeds, (*least, Some(*most)));
        let at = uniform.partition_point(|u| u[0] < rays).clamp(1, uniform.len() - 1);
        let [low, high] = [&uniform[at - 1], &uniform[at]];
        let share = (rays / low[0]).ln() / (high[0] / low[0]).ln();
        let equal = low[1] * (high[1] / low[1]).powf(share);
        10.0 * (equal / error).log10()
    };
    ranges.iter().map(gain).collect()
}
