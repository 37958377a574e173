//! Adaptive camera samples where they are hard: four pilot samples of a pixel hit fine textures, thin bars, discs of
//! confusion and small highlights only by chance. With as many rays, uniform samples are never nearer to the truth.
//!
//! No case here has an alpha mask: thin geometry stands for their edges.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

#[path = "common/moves.rs"]
mod moves;

use moves::{Set, Stage, codes, mean_square};
use std::fmt::Write;
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

/// A floor under `texture.png`, lit from above; `more` has the rest of the scene.
fn on_a_floor(camera: &str, more: &str) -> String {
    format!(
        "camera = {{ frames = 16, {camera} orbit = {{ eye = [0, 1.6, 7], target = [0, 0.6, 0], degrees = 20 }} }}\n\
         sky = {{ radiance = [0.2, 0.25, 0.35], lights = false, ambient = 0.2 }}\n\
         [material.floor]\ntexture = 'texture.png'\n\
         [material.grey]\ndiffuse = 0.6\n\
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
struct Case {
    name: &'static str,
    /// The scene file.
    text: fn() -> String,
}

const TEXTURES: Case = Case { name: "fine textures", text: fine_textures };
const BARS: Case = Case { name: "thin bars", text: thin_bars };
const DEFOCUS: Case = Case { name: "defocus", text: defocus };
const HIGHLIGHTS: Case = Case { name: "moving highlights", text: highlights };

fn load(text: &str) -> Set {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path().join("texture.png"), &texture(), &WriteOptions::default()).unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let loaded = import::load(&path, &LoadOptions::default()).expect("the scene loads");
    Set { settings: loaded.settings, ..Set::of(loaded.world, loaded.shot) }
}

/// A frame, its rays and its mean number of camera samples.
struct Traced {
    film: Film,
    rays: f64,
    samples: f64,
}

struct Hard<'s> {
    stage: Stage<'s>,
    shot: Shot,
    base: Settings,
}

impl Hard<'_> {
    fn traced(&self, frame: u32, seed: u64, (spp, most_spp): (u32, Option<u32>)) -> Traced {
        let settings = Settings { seed, spp, most_spp, ..self.base.clone() };
        let camera = self.shot.camera(frame, settings.width, settings.height).unwrap();
        let renderer = self.stage.renderer(&settings);
        let job = FrameJob::whole(&camera, frame);
        let render = || renderer.render_job(&job, &self.stage.stop, &()).unwrap();
        let done = self.stage.pool.install(render);
        let samples = done.film.mean_samples().unwrap_or(f64::from(spp));
        Traced { film: done.film, rays: done.rays.total() as f64, samples }
    }

    /// Rays of a frame and its mean squared error, the mean over `seeds`.
    fn figures(
        &self,
        frames: &[(u32, Vec<[f64; 3]>)],
        seeds: u64,
        spp: (u32, Option<u32>),
    ) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (frame, truth) in frames {
            for seed in 0..seeds {
                let Traced { film, rays, samples } = self.traced(*frame, seed, spp);
                let error = mean_square(&codes(&self.base, &film), truth);
                sums.iter_mut().zip([rays, error, samples]).for_each(|(sum, x)| *sum += x);
            }
        }
        sums.map(|sum| sum / (seeds * frames.len() as u64) as f64)
    }

    /// By how many decibels each of `ranges` is nearer to the truth than uniform samples of as many rays, whose error is
    /// interpolated between powers of two.
    fn gains(&self, frames: &[u32], seeds: u64, ranges: &[(u32, u32)]) -> Vec<f64> {
        let truth = |frame: &u32| {
            let film = self.traced(*frame, 9000, (TRUTH, None)).film;
            (*frame, codes(&self.base, &film))
        };
        let frames: Vec<_> = frames.iter().map(truth).collect();
        let highest = ranges.iter().map(|(_, most)| *most).max().unwrap_or(1);
        let counts = (1..).map(|k| 1 << k).take_while(|n| *n <= highest);
        let uniform: Vec<[f64; 3]> =
            counts.map(|n| self.figures(&frames, seeds, (n, None))).collect();
        let gain = |(least, most): &(u32, u32)| {
            let [rays, error, samples] = self.figures(&frames, seeds, (*least, Some(*most)));
            let at = uniform.partition_point(|u| u[0] < rays).clamp(1, uniform.len() - 1);
            let [low, high] = [&uniform[at - 1], &uniform[at]];
            let share = (rays / low[0]).ln() / (high[0] / low[0]).ln();
            let equal = low[1] * (high[1] / low[1]).powf(share);
            let db = |error: f64| -10.0 * error.log10();
            println!(
                "  {least}..{most}: {samples:.2} samples, {:.1} dB, uniform {:.1} dB, gain {:.2} dB",
                db(error),
                db(equal),
                db(error) - db(equal)
            );
            db(error) - db(equal)
        };
        ranges.iter().map(gain).collect()
    }
}

/// The least gain of any range, decibels.
fn worst_gain(
    case: &Case,
    size: (u32, u32),
    frames: &[u32],
    seeds: u64,
    ranges: &[(u32, u32)],
) -> f64 {
    let set = load(&(case.text)());
    let (base, shot) = (set.settings(size, 4, 4), set.shot.clone());
    println!("{}, {} x {}:", case.name, size.0, size.1);
    let hard = Hard { stage: set.stage(2), shot, base };
    hard.gains(frames, seeds, ranges).into_iter().fold(f64::INFINITY, f64::min)
}

fn assert_never_worse(case: &Case) {
    let worst = worst_gain(case, (96, 54), &[8], 6, &[(4, 16)]);
    assert!(worst > 0.0, "{}: {worst:.2} dB", case.name);
}

#[test]
fn fine_textures_are_found() {
    assert_never_worse(&TEXTURES);
}

#[test]
fn bars_thinner_than_a_pixel_are_found() {
    assert_never_worse(&BARS);
}

#[test]
fn what_is_out_of_focus_is_found() {
    assert_never_worse(&DEFOCUS);
}

#[test]
fn highlights_of_rough_mirrors_are_found() {
    assert_never_worse(&HIGHLIGHTS);
}

/// The figures of `docs/accuracy.md`.
#[test]
#[ignore = "minutes"]
fn every_range_of_every_hard_case() {
    for case in [TEXTURES, BARS, DEFOCUS, HIGHLIGHTS] {
        let ranges = [(2, 8), (2, 32), (4, 16), (4, 32), (4, 64)];
        let worst = worst_gain(&case, (192, 108), &[3, 12], 2, &ranges);
        assert!(worst > 0.0, "{}: {worst:.2} dB", case.name);
    }
}
