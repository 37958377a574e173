//! Rays a second of the intersect layer beside a bare C loop on Embree, and the packet widths behind `docs/decisions/003-packets-of-8.md`. One thread.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "intersect/packets.rs"]
mod packets;
mod support;
use support::camera_rays;

use std::cell::Cell;
use support::Candidate;
use tweenray::embree::{BareCamera, CommittedScene};
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Ray};
use tweenray::scene::{Camera, HitRules, Recheck, Scene};
use tweenray::stats::RayCounts;

/// The frame whose camera the rays are.
const FRAME: u32 = 8;
const TURNS: usize = 45;
fn main() {
    support::title("intersect: spheres_on_terrain, one thread");
    let loaded = support::bench_scene();
    let (width, height) = (loaded.settings.width, loaded.settings.height);
    let camera = loaded.shot.camera(FRAME, width, height).expect("a camera");
    let scene = loaded.world.into_scene(true).expect("a scene");
    let camera = camera.to_scene(&scene.recentring);
    let committed = support::commit(&scene, 2);
    let rays = camera_rays::all(&camera);
    camera_rates(&scene, &committed, &camera, &rays);
    packets::report(&scene, &committed, &rays);
    println!("load average at the end {}", support::load_average());
}

fn trace(layer: &dyn Intersector, rays: &[Ray], hits: &mut Vec<Option<Hit>>) -> u64 {
    hits.clear();
    hits.resize(rays.len(), None);
    layer.intersect_batch(rays, hits, &mut RayCounts::default());
    hits.iter().flatten().count() as u64
}

fn camera_rates(scene: &Scene, committed: &CommittedScene, camera: &Camera, rays: &[Ray]) {
    let rules = HitRules { retry: false, recheck: Recheck::Off, ..HitRules::default() };
    let layer = EmbreeIntersector::new(scene, rules, None, 2).expect("Embree builds");
    let bare = bare_camera(camera);
    let (expected, found) = (Cell::new(0), Cell::new(0));
    let mut candidates: Vec<Candidate> = vec![
        (
            "(a) bare C loop, makes its rays in f32".into(),
            Box::new(|| expected.set(committed.bare_camera_loop(&bare).expect("it runs").hits)),
        ),
        (
            "(b) our layer, robust only, makes its rays in f64".into(),
            Box::new(|| {
                let (mut hits, mut count) = (Vec::new(), 0);
                camera_rays::each_block(camera, |block| count += trace(&layer, block, &mut hits));
                found.set(count);
            }),
        ),
        (
            "(c) the same, rays made beforehand".into(),
            Box::new(|| {
                let mut hits = Vec::new();
                rays.chunks(camera_rays::BLOCK).for_each(|b| _ = trace(&layer, b, &mut hits));
            }),
        ),
    ];
    let times = support::take_turns(TURNS, &mut candidates);
    let names: Vec<String> = candidates.into_iter().map(|(name, _)| name).collect();
    let rows: Vec<Vec<String>> = names
        .iter()
        .zip(&times)
        .map(|(name, time)| {
            let per_ray = time.median() / rays.len() as f64 * 1e9;
            let (rate, spread) = (1e3 / per_ray, time.spread());
            vec![
                name.clone(),
                format!("{rate:.2}"),
                format!("{per_ray:.1}"),
                format!("±{spread:.0} %"),
            ]
        })
        .collect();
    support::table(&["camera rays", "Mrays/s", "ns a ray", "spread"], &rows);
    let (expected, found) = (expected.get(), found.get());
    println!("\nhits: bare loop {expected}, our layer {found}, of {} rays", rays.len());
    assert!(expected.abs_diff(found) <= expected / 1000, "the loops do different work");
    for (name, time) in [("b/a", &times[1]), ("c/a", &times[2])] {
        let [low, ratio, high] = times[0].over(time);
        println!(
            "ratio {name} of rates: {ratio:.3} (quartiles {low:.3} to {high:.3}); wanted: 0.8"
        );
    }
    println!("what each hit rule costs: ./x stress costs");
}

fn bare_camera(camera: &Camera) -> BareCamera {
    BareCamera {
        eye: camera.eye.as_vec3(),
        forward: camera.forward.as_vec3(),
        half_right: camera.half_right.as_vec3(),
        half_up: camera.half_up.as_vec3(),
        width: camera.width,
        height: camera.height,
    }
}
