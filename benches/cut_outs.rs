//! What cut-outs cost: a forest of leaf cards, half of each cut away, beside the same cards whole.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "../tests/common/leaves.rs"]
mod leaves;
mod support;

use std::sync::atomic::AtomicBool;
use support::Candidate;
use tweenray::intersect::EmbreeIntersector;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{Camera, DirectionalLight, Light, Pose, Scene, Settings};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

/// Trees along each edge of the forest, and cards of each: 200,000.
const TREES: u32 = 10;
const LEAVES: u32 = 2000;
const TURNS: usize = 7;

fn main() {
    support::title("cut_outs: 200,000 leaf cards, one thread");
    let [whole, cut] = [false, true].map(forest);
    let settings = Settings { width: 640, height: 360, spp: 1, ..Settings::default() };
    let pose = Pose {
        eye: DVec3::new(4.0, 4.0, 21.0),
        target: DVec3::new(0.0, 1.5, 0.0),
        up: DVec3::Y,
        roll_degrees: 0.0,
    };
    let camera = Camera::new(&pose, 40.0, settings.width, settings.height).expect("a camera");
    let mut rows = Vec::new();
    for (name, sky_samples, sun) in
        [("camera rays alone", 0, false), ("and the sun", 0, true), ("and 4 sky samples", 4, true)]
    {
        let settings = Settings { sky_samples, ..settings.clone() };
        rows.push(row(name, [&whole, &cut].map(|scene| with_sun(scene, sun)), &settings, &camera));
    }
    let head =
        ["640x360 pixels", "whole", "cut", "cut / whole", "quartiles", "rays whole", "rays cut"];
    support::table(&head, &rows);
    println!("\nseconds of a frame; load average {}", support::load_average());
}

fn forest(cut: bool) -> Scene {
    let mut world = leaves::forest(TREES, LEAVES, cut);
    world.sky.radiance = Rgb::new(0.4, 0.5, 0.7);
    world.sky.lights = true;
    world.lights.push(Light::Directional(DirectionalLight {
        to_light: DVec3::new(0.5, 1.0, 0.3).normalize(),
        irradiance: Rgb::splat(2.0),
    }));
    world.into_scene(true).expect("a scene")
}

fn with_sun(scene: &Scene, sun: bool) -> Scene {
    let lights = if sun { scene.lights.clone() } else { Vec::new() };
    Scene { lights, ..scene.clone() }
}

/// Times a frame of both scenes in turns.
fn row(name: &str, scenes: [Scene; 2], settings: &Settings, camera: &Camera) -> Vec<String> {
    let intersectors = [&scenes[0], &scenes[1]].map(|scene| {
        EmbreeIntersector::new(scene, settings.rules, settings.isa.as_deref(), 1).expect("a BVH")
    });
    let renderers = [0, 1].map(|k| Renderer::new(&scenes[k], settings, &intersectors[k]));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let frame = |renderer: &Renderer| -> RayCounts {
        let stop = AtomicBool::new(false);
        let film = pool.install(|| renderer.render(camera, 1, false, &stop, &()));
        film.expect("nobody stops it").1
    };
    let mut candidates: Vec<Candidate> = renderers
        .iter()
        .map(|renderer| -> Candidate {
            let run = || {
                frame(renderer);
            };
            (String::new(), Box::new(run))
        })
        .collect();
    let times = support::take_turns(TURNS, &mut candidates);
    drop(candidates);
    let [low, ratio, high] = times[1].over(&times[0]);
    let rays = |k: usize| frame(&renderers[k]).total().to_string();
    vec![
        name.into(),
        format!("{:.3}", times[0].median()),
        format!("{:.3}", times[1].median()),
        format!("{ratio:.2}"),
        format!("{low:.2} to {high:.2}"),
        rays(0),
        rays(1),
    ]
}
