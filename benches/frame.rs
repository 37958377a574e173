//! Seconds of a frame of `spheres_on_terrain` with one thread and with two, with all effects and
//! without any: two threads are never to be slower than one.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

mod support;

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::cell::Cell;
use std::sync::atomic::AtomicBool;
use support::Candidate;
use tweenray::import::Loaded;
use tweenray::intersect::EmbreeIntersector;
use tweenray::scene::{Camera, Scene, Settings, Shot};
use tweenray::shade::Renderer;

const FRAME: u32 = 8;

/// A kind of frame to time.
struct Case {
    name: &'static str,
    size: (u32, u32),
    effects: bool,
    /// Turns of each number of threads; with one, there is no warm-up.
    turns: usize,
    /// Frames a turn.
    frames: u32,
}

#[rustfmt::skip]
const CASES: [Case; 5] = [
    Case { name: "64x36, no effects", size: (64, 36), effects: false, turns: 101, frames: 25 },
    Case { name: "128x72, no effects", size: (128, 72), effects: false, turns: 101, frames: 10 },
    Case { name: "640x360, no effects", size: (640, 360), effects: false, turns: 11, frames: 1 },
    Case { name: "160x90, as the scene file", size: (160, 90), effects: true, turns: 5, frames: 1 },
    Case { name: "640x360, as the scene file", size: (640, 360), effects: true, turns: 1, frames: 1 },
];

fn main() {
    support::title("frame: spheres_on_terrain");
    let Loaded { world, shot, settings, .. } = support::bench_scene();
    let mut plain_world = world.clone();
    plain_world.lights.clear();
    plain_world.sky.lights = false;
    let scene = world.into_scene(true).expect("a scene");
    let plain = plain_world.into_scene(true).expect("a scene");
    let pools = [1, 2].map(pool);
    let rows: Vec<Vec<String>> = CASES
        .iter()
        .map(|case| {
            let scene = if case.effects { &scene } else { &plain };
            row(case, scene, &settings_of(case, &settings), &shot, &pools)
        })
        .collect();
    let head = ["frame", "1 thread", "2 threads", "2 / 1", "quartiles", "spread", "Mrays/s"];
    support::table(&head, &rows);
    println!("\nMrays/s of all kinds with two threads; load average {}", support::load_average());
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

fn settings_of(case: &Case, file: &Settings) -> Settings {
    let (width, height) = case.size;
    let mut settings = Settings { width, height, ..file.clone() };
    if !case.effects {
        (settings.spp, settings.bounces) = (1, 0);
    }
    settings
}

/// Times one case and words it.
fn row(
    case: &Case,
    scene: &Scene,
    settings: &Settings,
    shot: &Shot,
    pools: &[ThreadPool],
) -> Vec<String> {
    let intersector = EmbreeIntersector::new(scene, settings.rules, None, 2).expect("a BVH");
    let renderer = Renderer::new(scene, settings, &intersector);
    let camera = shot.camera(FRAME, settings.width, settings.height).expect("a camera");
    let rays = Cell::new(0);
    let mut candidates: Vec<Candidate> = pools
        .iter()
        .map(|pool| -> Candidate {
            let (renderer, camera, rays) = (&renderer, &camera, &rays);
            let run =
                move || (0..case.frames).for_each(|_| rays.set(frame(renderer, camera, pool)));
            (String::new(), Box::new(run))
        })
        .collect();
    let times = match case.turns {
        1 => support::take_a_turn(&mut candidates),
        turns => support::take_turns(turns, &mut candidates),
    };
    let each = |k: usize| times[k].median() / f64::from(case.frames);
    let [low, ratio, high] = times[1].over(&times[0]);
    vec![
        case.name.into(),
        say_seconds(each(0)),
        say_seconds(each(1)),
        format!("{ratio:.3}"),
        format!("{low:.3} to {high:.3}"),
        format!("±{:.0} %", times[0].spread().max(times[1].spread())),
        format!("{:.2}", rays.get() as f64 / each(1) * 1e-6),
    ]
}

/// Renders a frame and counts its rays.
fn frame(renderer: &Renderer, camera: &Camera, pool: &ThreadPool) -> u64 {
    let stop = AtomicBool::new(false);
    let film = pool.install(|| renderer.render(camera, FRAME, false, &stop, &()));
    film.expect("nobody stops it").1.total()
}

fn say_seconds(seconds: f64) -> String {
    if seconds < 0.1 { format!("{:.2} ms", seconds * 1e3) } else { format!("{seconds:.2} s") }
}
