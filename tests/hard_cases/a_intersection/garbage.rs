//! Meshes that are broken, and meshes that never were any.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use std::time::Instant;
use tweenray::error::Result;
use tweenray::import::{Model, load_model};
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray, SurfaceInteraction};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    HitRules, Light, Material, NormalPolicy, PointLight, Scene, World, WorldMesh,
};
use tweenray::stats::RayCounts;

/// What loading must say.
enum Loads {
    /// Refused, with this in the message.
    Refused(&'static str),
    /// Loaded with this many triangles, and a warning that contains this.
    Triangles(usize, &'static str),
}

/// A mesh file, and what loading must say of it.
fn degenerate_files() -> Vec<(&'static str, &'static str, Loads)> {
    use Loads::{Refused, Triangles};
    vec![
        (
            "no area, one index twice",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 2\n",
            Triangles(1, "1 triangle without area"),
        ),
        (
            "three corners in one place",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 0 0 0\nf 1 4 5\nf 1 2 3\n",
            Triangles(1, "1 triangle without area"),
        ),
        (
            "collinear",
            "v 0 0 0\nv 1 1 1\nv 2 2 2\nv 0 3 0\nf 1 2 3\nf 1 2 4\nf 2 3 4\n",
            Triangles(2, "1 triangle without area"),
        ),
        ("needle", "v 0 0 0\nv 1e8 0 0\nv 5e7 1 0\nf 1 2 3\n", Triangles(1, "")),
        ("flat needle", "v 0 0 0\nv 1e8 1e8 1e-8\nv 1 1 0\nf 1 2 3\n", Triangles(1, "")),
        ("NaN vertex", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", Refused("nan")),
        ("infinite vertex", "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", Refused("1e999")),
        ("index out of bounds", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", Refused("4")),
        ("no triangle", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", Refused("no faces")),
        ("one triangle", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Triangles(1, "")),
        (
            "nothing but no area",
            "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 1\n",
            Triangles(0, "2 triangles without area"),
        ),
    ]
}

fn load(name: &str, content: &[u8]) -> Result<Model> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    load_model(&path, NormalPolicy::Auto { crease_degrees: 30.0 })
}

pub fn degenerate(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let rays = size.of(5_000, 100_000);
    for (name, text, expect) in degenerate_files() {
        match (load("bad.obj", text.as_bytes()), expect) {
            (Err(error), Loads::Refused(part)) => {
                let said = error.to_string();
                let placed = said.contains("bad.obj:") && said.contains(part);
                outcome.check(placed, || format!("{name}: {said}"));
            }
            (Ok(model), Loads::Triangles(count, part)) => {
                let meshes = &model.world.meshes;
                let found: usize = meshes.iter().map(|m| m.triangles.len()).sum();
                let warned =
                    part.is_empty() || model.warnings.iter().any(|w| w.message.contains(part));
                outcome.check(found == count && warned, || {
                    format!("{name}: {found} triangles, {:?}", model.warnings)
                });
                outcome.merge(traced(name, model.world, rays));
            }
            (Ok(_), Loads::Refused(_)) => outcome.complain(format!("{name} is loaded")),
            (Err(error), _) => outcome.complain(format!("{name}: {error}")),
        }
    }
    // Past the importer: what f32 makes of geometry that was sound in f64.
    let refused = shapes::world_of(strip(1e-3)).into_scene(true).err().map(|e| e.to_string());
    let named = refused.as_ref().is_some_and(|said| said.contains("98 triangles"));
    outcome.check(named, || format!("a strip below f32's grain: {refused:?}"));
    for (name, mesh) in collapsed() {
        outcome.merge(traced(name, shapes::world_of(mesh), rays));
    }
    outcome
}

/// Meshes whose triangles lose their area when they are rounded, or never had any.
fn collapsed() -> Vec<(&'static str, WorldMesh)> {
    let line: Vec<DVec3> = (0..10).map(|i| DVec3::splat(f64::from(i))).collect();
    let point = vec![DVec3::ONE; 3];
    vec![
        ("strip below f32's grain, among more", among_more(strip(1e-3))),
        ("strip at f32's grain, among more", among_more(strip(64.0))),
        ("a line of triangles", common::mesh(line, (0..8).map(|i| [i, i + 1, i + 2]).collect(), 0)),
        ("a point of triangles", common::mesh(point, vec![[0, 1, 2]; 50], 0)),
        ("a vertex three times", common::mesh(vec![DVec3::X], vec![[0, 0, 0]; 50], 0)),
    ]
}

/// 98 triangles of a strip of width `step`, far from a vertex that nothing uses.
fn strip(step: f64) -> WorldMesh {
    let far = DVec3::splat(1e9);
    let positions = (0..100)
        .map(|i| far + DVec3::new(f64::from(i / 2), f64::from(i % 2) * step, f64::from(i) * step));
    let mut positions: Vec<DVec3> = positions.collect();
    positions.push(-far);
    common::mesh(positions, (0..98).map(|i| [i, i + 1, i + 2]).collect(), 0)
}

/// With as many large triangles, so that what is lost is not most of it.
fn among_more(mut mesh: WorldMesh) -> WorldMesh {
    let next = mesh.positions.len() as u32;
    for i in 0..mesh.triangles.len() as u32 + 2 {
        let turn = 1e9 * f64::from(i) / 100.0;
        mesh.positions.push(DVec3::new(turn, -1e9, 1e9 - turn));
    }
    let fan = (next..mesh.positions.len() as u32 - 1).map(|i| [next - 1, i, i + 1]);
    mesh.triangles.extend(fan);
    mesh
}

/// Random rays at a world, both tracers, and a small picture: all finite.
fn traced(name: &str, mut world: World, rays: u64) -> Outcome {
    let mut outcome = Outcome::default();
    if world.materials.is_empty() {
        world.materials.push(Material::diffuse("white", Rgb::ONE));
    }
    let bounds = world.bounds();
    let centre = if world.meshes.is_empty() { DVec3::ZERO } else { bounds.centre() };
    let reach = bounds.extent().max_element().max(1e-3);
    let position = centre + DVec3::new(1.0, 2.0, 3.0) * reach;
    world
        .lights
        .push(Light::Point(PointLight { position, intensity: Rgb::splat((reach * reach) as f32) }));
    world.sky.radiance = Rgb::splat(0.2);
    let eye = centre + DVec3::new(0.7, 1.1, 2.0) * reach;
    let pose = tweenray::scene::Pose { eye, target: centre, up: DVec3::Y, roll_degrees: 0.0 };
    let job = common::job(world, pose, 32, 32);
    let (film, _) = common::render(&job);
    for pixel in &film.rgb {
        outcome.check(pixel.is_finite() && pixel.min_element() >= 0.0, || {
            format!("{name}: a pixel is {pixel}")
        });
    }
    let scene = job.world.into_scene(true).unwrap();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let make = |i: u64| random_ray(&scene, i);
    let judge = |rays: &[Ray], hits: &[Option<Hit>]| sound(name, &scene, rays, hits);
    let sum = |mut a: Outcome, b: Outcome| {
        a.merge(b);
        a
    };
    outcome.merge(suite::trace(&embree, rays, make, judge, sum, Outcome::default));
    let oracle = Oracle::new(&scene);
    let name = format!("{name}, oracle");
    let judge = |rays: &[Ray], hits: &[Option<Hit>]| sound(&name, &scene, rays, hits);
    outcome.merge(suite::trace(&oracle, rays / 10, make, judge, sum, Outcome::default));
    outcome
}

/// A ray at a corner, an edge or the inside of some triangle, from all around.
fn random_ray(scene: &Scene, i: u64) -> Ray {
    let mut rng = suite::rng(20, i);
    let org = shapes::in_ball(&mut rng, 3.0);
    let mut target = shapes::in_ball(&mut rng, 1.0);
    if let Some(mesh) = scene.meshes.iter().find(|m| !m.triangles.is_empty()) {
        let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
        let (a, b) = (rng.random::<f64>(), rng.random::<f64>());
        match i % 4 {
            0 => target = corners[0],
            1 => target = corners[0].lerp(corners[1], a),
            2 => target = corners[0].lerp(corners[1].lerp(corners[2], a), b),
            _ => {}
        }
    }
    Ray::new(org, target - org)
}

/// No NaN in any hit, nor in the point and the normals made of it.
fn sound(name: &str, scene: &Scene, rays: &[Ray], hits: &[Option<Hit>]) -> Outcome {
    let mut outcome = Outcome::default();
    for (ray, hit) in rays.iter().zip(hits) {
        let ok = hit.is_none_or(|hit| {
            let si = SurfaceInteraction::new(scene, ray, &hit);
            let unit = |n: DVec3| (n.length() - 1.0).abs() < 1e-6;
            (hit.t + hit.u + hit.v).is_finite()
                && hit.t >= ray.tnear
                && si.p.is_finite()
                && si.offset.is_finite()
                && unit(si.ng)
                && unit(si.ns)
        });
        outcome.check(ok, || format!("{name}: {ray:?}: {hit:?}"));
    }
    outcome
}

/// Rays each garbage mesh gets.
const GARBAGE_RAYS: u64 = 1000;

/// What came of a garbage mesh.
enum Fate {
    /// The importer, or the scene, refused it.
    Refused,
    /// Seconds to trace its rays, and what came of them.
    Traced(f64, Outcome),
}

/// Times an ordinary mesh's time that each garbage mesh may take.
const MOST_TIME: f64 = 10.0;
/// A mesh that seems slow is timed so often: other work on the machine is no fault of it.
const TIMINGS: usize = 8;

pub fn fuzz(size: Size) -> Outcome {
    let meshes = size.of(200, 10_000u64);
    // As many rays at ordinary triangles, in the same turmoil.
    let mut ordinary: Vec<f64> = (0..meshes.min(400))
        .into_par_iter()
        .map(|i| {
            let mut rng = suite::rng(21, i);
            let positions = (0..VERTICES).map(|_| shapes::in_ball(&mut rng, 1.0)).collect();
            let scene = shapes::scene_of(common::mesh(positions, random_faces(&mut rng), 0));
            trace_garbage(&scene, i, false).0
        })
        .collect();
    ordinary.sort_by(f64::total_cmp);
    let ordinary = ordinary[ordinary.len() / 2];
    let fates: Vec<Fate> =
        (0..meshes).into_par_iter().map(|i| garbage(i, MOST_TIME * ordinary)).collect();
    let mut outcome = Outcome::default();
    let mut times = Vec::new();
    for fate in fates {
        outcome.trials += 1;
        if let Fate::Traced(seconds, traced) = fate {
            outcome.merge(traced);
            times.push(seconds / ordinary);
        }
    }
    let (traced, refused) = (times.len(), meshes as usize - times.len());
    outcome.show(format!("{traced} meshes traced, {refused} refused with an error"));
    outcome.at_least("meshes traced, share", traced as f64 / meshes as f64, 0.5);
    let mean = times.iter().sum::<f64>() / traced as f64;
    outcome.show(format!("time of a garbage mesh, of an ordinary one's: {mean:.2} in the mean"));
    let worst = times.into_iter().fold(0f64, f64::max);
    outcome.at_most("time of the slowest garbage mesh, of an ordinary one's", worst, MOST_TIME);
    outcome
}

const VERTICES: usize = 24;

fn random_faces(rng: &mut impl Rng) -> Vec<[u32; 3]> {
    (0..40).map(|_| [0; 3].map(|_: u32| rng.random_range(0..VERTICES as u32))).collect()
}

/// A mesh of random bits through a file, the importer and the tracer; timed again where it takes
/// more than `limit` seconds.
fn garbage(i: u64, limit: f64) -> Fate {
    let mut rng = suite::rng(19, i);
    let faces = random_faces(&mut rng);
    // Every fourth mesh takes any bits: NaN, infinities, numbers too large to render. The others
    // are kept within what a scene may hold, so that they reach the tracer.
    let any = i % 4 == 0;
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {VERTICES}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        faces.len()
    )
    .into_bytes();
    for _ in 0..3 * VERTICES {
        let mut bits = rng.random::<u32>();
        while !(any || f32::from_bits(bits).abs() <= 1e29) {
            bits = rng.random();
        }
        file.extend(bits.to_le_bytes());
    }
    for face in faces {
        file.push(3);
        face.iter().for_each(|i| file.extend(i.to_le_bytes()));
    }
    let Ok(model) = load("garbage.ply", &file) else { return Fate::Refused };
    let Ok(scene) = model.world.into_scene(i % 2 == 0) else { return Fate::Refused };
    let (mut seconds, outcome) = trace_garbage(&scene, i, true);
    for _ in 1..TIMINGS {
        if seconds > limit {
            seconds = seconds.min(trace_garbage(&scene, i, true).0);
        }
    }
    Fate::Traced(seconds, outcome)
}

/// Ordinary rays, every tenth of random bits where `wild`.
fn trace_garbage(scene: &Scene, seed: u64, wild: bool) -> (f64, Outcome) {
    let embree = EmbreeIntersector::new(scene, HitRules::default(), suite::isa(), 1).unwrap();
    let mut rng = suite::rng(22, seed);
    let mut rays: Vec<Ray> =
        (0..GARBAGE_RAYS).map(|i| random_ray(scene, i + seed * GARBAGE_RAYS)).collect();
    if wild {
        for ray in rays.iter_mut().step_by(10) {
            let mut bits = || f64::from_bits(rng.random());
            ray.org = DVec3::new(bits(), bits(), bits());
            ray.dir = DVec3::new(bits(), bits(), bits());
        }
    }
    let mut hits = vec![None; rays.len()];
    let mut occluded = vec![false; rays.len()];
    let mut counts = RayCounts::default();
    let start = Instant::now();
    embree.intersect_batch(&rays, &mut hits, &mut counts);
    embree.occluded_batch(&rays, &mut occluded, &mut counts);
    let seconds = start.elapsed().as_secs_f64();
    (seconds, sound("garbage", scene, &rays, &hits))
}
