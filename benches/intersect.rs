//! Rays a second of the intersect layer beside a bare C loop on Embree, what each hit rule costs,
//! and the packet widths behind `docs/decisions/003-packets-of-8.md`. One thread.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "intersect/packets.rs"]
mod packets;
mod support;

use std::cell::Cell;
use support::{Candidate, Times};
use tweenray::embree::{BareCamera, BuildOptions, CommittedScene, SceneBuilder};
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Ray};
use tweenray::scene::{Camera, HitRules, Recheck, Scene};
use tweenray::stats::RayCounts;

/// The frame whose camera the rays are.
const FRAME: u32 = 8;
const TURNS: usize = 45;
/// Rays handed over at once: the kernel's, one sample of an 8 x 8 block.
const BLOCK: usize = 64;
/// The hit rules, one added after another.
const RULES: [(&str, bool, bool, Recheck); 5] = [
    ("rules off", false, false, Recheck::Off),
    ("+ robust", true, false, Recheck::Off),
    ("+ retry", true, true, Recheck::Off),
    ("+ recheck risky", true, true, Recheck::Risky),
    ("+ recheck always", true, true, Recheck::Always),
];

fn main() {
    support::title("intersect: spheres_on_terrain, one thread");
    let loaded = support::bench_scene();
    let (width, height) = (loaded.settings.width, loaded.settings.height);
    let camera = loaded.shot.camera(FRAME, width, height).expect("a camera");
    let scene = loaded.world.into_scene(true).expect("a scene");
    let camera = camera.to_scene(&scene.recentring);
    let committed = commit(&scene);
    let rays = camera_rays(&camera);
    camera_rates(&scene, &committed, &camera, &rays);
    packets::report(&scene, &committed, &rays);
    println!("load average at the end {}", support::load_average());
}

/// The scene's triangles in Embree, as the intersect layer builds them.
fn commit(scene: &Scene) -> CommittedScene<'_> {
    let options = BuildOptions { threads: 2, isa: None, robust: true };
    let mut builder = SceneBuilder::new(&options).expect("a device");
    for mesh in &scene.meshes {
        let added = builder.add_triangles(
            &mesh.positions,
            mesh.vertex_count,
            &mesh.triangles,
            std::iter::empty(),
        );
        added.expect("valid triangles");
    }
    builder.commit().expect("a scene")
}

fn intersector(
    scene: &Scene,
    robust: bool,
    retry: bool,
    recheck: Recheck,
) -> EmbreeIntersector<'_> {
    let rules = HitRules { robust, retry, recheck, ..HitRules::default() };
    EmbreeIntersector::new(scene, rules, None, 2).expect("Embree builds")
}

/// The rays of every pixel in the order of the renderer's blocks.
fn camera_rays(camera: &Camera) -> Vec<Ray> {
    let mut rays = Vec::new();
    each_block(camera, |block| block.iter().for_each(|ray| rays.push(*ray)));
    rays
}

/// Calls `with` with the rays of each block of 8 x 8 pixels, in 4 x 4 sub-blocks.
fn each_block(camera: &Camera, mut with: impl FnMut(&[Ray])) {
    let mut block = Vec::with_capacity(BLOCK);
    for by in (0..camera.height).step_by(8) {
        for bx in (0..camera.width).step_by(8) {
            block.clear();
            for k in 0..BLOCK as u32 {
                let x = bx + k / 16 % 2 * 4 + k % 4;
                let y = by + k / 32 * 4 + k % 16 / 4;
                let dir = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
                block.push(Ray::new(camera.eye, dir));
            }
            with(&block);
        }
    }
}

fn trace(layer: &dyn Intersector, rays: &[Ray], hits: &mut Vec<Option<Hit>>) -> u64 {
    hits.clear();
    hits.resize(rays.len(), None);
    layer.intersect_batch(rays, hits, &mut RayCounts::default());
    hits.iter().flatten().count() as u64
}

fn camera_rates(scene: &Scene, committed: &CommittedScene, camera: &Camera, rays: &[Ray]) {
    let layers =
        RULES.map(|(_, robust, retry, recheck)| intersector(scene, robust, retry, recheck));
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
                each_block(camera, |block| count += trace(&layers[1], block, &mut hits));
                found.set(count);
            }),
        ),
    ];
    for (layer, (name, ..)) in layers.iter().zip(RULES) {
        candidates.push((
            format!("(c) rays made beforehand, {name}"),
            Box::new(move || {
                let mut hits = Vec::new();
                rays.chunks(BLOCK).for_each(|block| _ = trace(layer, block, &mut hits));
            }),
        ));
    }
    let times = support::take_turns(TURNS, &mut candidates);
    let names: Vec<String> = candidates.into_iter().map(|(name, _)| name).collect();
    print_rates(&names, &times, rays.len());
    let (expected, found) = (expected.get(), found.get());
    println!("\nhits: bare loop {expected}, our layer {found}, of {} rays", rays.len());
    assert!(expected.abs_diff(found) <= expected / 1000, "the loops do different work");
    let [low, ratio, high] = times[0].over(&times[1]);
    println!("ratio b/a of rates: {ratio:.3} (quartiles {low:.3} to {high:.3}); wanted: 0.8");
    let [low, ratio, high] = times[0].over(&times[3]);
    println!("with rays made beforehand: {ratio:.3} (quartiles {low:.3} to {high:.3})");
    for (name, rules) in [("risky", &times[5]), ("always", &times[6])] {
        let [low, ratio, high] = rules.over(&times[2]);
        println!(
            "all rules, recheck {name}, over none: {ratio:.3} ({low:.3} to {high:.3}); wanted: 1.2"
        );
    }
}

fn print_rates(names: &[String], times: &[Times], rays: usize) {
    let rows: Vec<Vec<String>> = names
        .iter()
        .zip(times)
        .enumerate()
        .map(|(k, (name, time))| {
            let per_ray = time.median() / rays as f64 * 1e9;
            let mut row = vec![name.clone(), format!("{:.2}", 1e3 / per_ray)];
            row.push(format!("{per_ray:.1}"));
            row.push(format!("±{:.0} %", time.spread()));
            // What a rule adds to those before it.
            if k > 2 {
                let added = time.less(&times[k - 1]) / rays as f64 * 1e9;
                let share = 100.0 * (time.over(&times[k - 1])[1] - 1.0);
                row.extend([format!("{added:+.1}"), format!("{share:+.1} %")]);
            } else {
                row.extend(["".into(), "".into()]);
            }
            row
        })
        .collect();
    support::table(&["camera rays", "Mrays/s", "ns a ray", "spread", "adds ns", "adds"], &rows);
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
