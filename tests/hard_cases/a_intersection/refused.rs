//! Rays that are none, and a host that flushes denormals.

use crate::common;
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use std::path::Path;
use std::process::Command;
use std::time::Instant;
use tweenray::embree::floating_point_mode;
use tweenray::intersect::{EmbreeIntersector, Hit, Intersector, Oracle, Ray};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{HitRules, Light, PointLight, Scene, SphereLight};
use tweenray::stats::{RayCounts, RayKind};

/// What must come of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Expect {
    /// Refused: no hit, counted as invalid.
    Refused,
    /// The sphere's near side, this far along the ray.
    Hit(f64),
    /// Traced without a hit.
    Miss,
}

/// The table: rays at a sphere of radius 2 around the origin from (0.1, 0.2, 5).
fn table() -> Vec<(&'static str, Ray, Expect)> {
    use Expect::{Hit, Miss, Refused};
    let good = Ray::new(DVec3::new(0.1, 0.2, 5.0), DVec3::NEG_Z);
    let near = 5.0 - (4.0f64 - 0.01 - 0.04).sqrt();
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let dir = |x: f64, y: f64, z: f64| Ray { dir: DVec3::new(x, y, z), ..good };
    let org = |x: f64| Ray { org: DVec3::new(x, 0.2, 5.0), ..good };
    vec![
        ("NaN in the origin", org(nan), Refused),
        ("infinity in the origin", org(inf), Refused),
        ("origin at 1e30", org(1e30), Refused),
        ("NaN in the direction", dir(nan, 0.0, -1.0), Refused),
        ("infinity in the direction", dir(0.0, 0.0, -inf), Refused),
        ("zero direction", dir(0.0, -0.0, 0.0), Refused),
        ("denormal direction", dir(0.0, 0.0, -1e-310), Refused),
        ("direction of 1e-20", dir(0.0, 0.0, -1e-20), Refused),
        ("direction of 1e20", dir(0.0, 0.0, -1e20), Refused),
        ("direction of 1e38", dir(0.0, 0.0, -1e38), Refused),
        ("zeros of both signs", dir(0.0, -0.0, -1.0), Hit(near)),
        ("denormals beside a good direction", dir(1e-310, -1e-40, -1.0), Hit(near)),
        ("NaN tnear", Ray { tnear: nan, ..good }, Refused),
        ("NaN tfar", Ray { tfar: nan, ..good }, Refused),
        ("tnear of -0", Ray { tnear: -0.0, ..good }, Hit(near)),
        ("negative tnear", Ray { tnear: -100.0, ..good }, Refused),
        ("tnear beyond tfar", Ray { tnear: 2.0, tfar: 1.0, ..good }, Refused),
        ("a segment that ends before", Ray { tfar: 1.0, ..good }, Miss),
        (
            "everything NaN",
            Ray { org: DVec3::NAN, dir: DVec3::NAN, tnear: nan, tfar: nan, ..good },
            Refused,
        ),
        (
            "everything infinite",
            Ray { org: DVec3::INFINITY, dir: DVec3::INFINITY, tnear: inf, tfar: inf, ..good },
            Refused,
        ),
    ]
}

fn ball() -> Scene {
    shapes::scene_of(shapes::sphere(DVec3::ZERO, 2.0, 200, 100))
}

/// `ray`, in world space, as the scene sees it: the recentring scales by a power of two.
fn placed(scene: &Scene, ray: &Ray) -> Ray {
    let scale = scene.recentring.scale();
    Ray { org: ray.org * scale, tnear: ray.tnear * scale, tfar: ray.tfar * scale, ..*ray }
}

pub fn invalid_rays(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let scene = ball();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let oracle = Oracle::new(&scene);
    for intersector in [&embree as &dyn Intersector, &oracle] {
        for (name, ray, expect) in table() {
            let answers = answers(intersector, &placed(&scene, &ray));
            for (how, hit, occluded, refused) in answers {
                let t = hit.map(|h| h.t / scene.recentring.scale());
                let ok = match expect {
                    Expect::Refused => t.is_none() && !occluded && refused,
                    // A mesh of 40,000 triangles lies within 1e-3 of its sphere.
                    Expect::Hit(near) => {
                        t.is_some_and(|t| (t - near).abs() < 2e-3) && occluded && !refused
                    }
                    Expect::Miss => t.is_none() && !occluded && !refused,
                };
                let finite = hit.is_none_or(|h| (h.t + h.u + h.v).is_finite());
                let who = intersector.describe();
                outcome.check(ok && finite, || {
                    format!("{name}, {who}, {how}: {hit:?}, {occluded}, refused {refused}")
                });
            }
        }
    }
    cost(&mut outcome, &scene, &embree, size);
    outcome
}

/// Hit, occlusion, and whether both were counted as invalid: one ray alone, and among good ones.
fn answers(
    intersector: &dyn Intersector,
    ray: &Ray,
) -> [(&'static str, Option<Hit>, bool, bool); 2] {
    let mut counts = RayCounts::default();
    let alone = (intersector.intersect(ray, &mut counts), intersector.occluded(ray, &mut counts));
    let refused = counts[RayKind::Invalid] == 2;
    let mut counts = RayCounts::default();
    let mut rays = [Ray::new(DVec3::new(0.0, 0.0, 3.0), DVec3::NEG_Z); 11];
    rays[6] = *ray;
    let (mut hits, mut occluded) = ([None; 11], [false; 11]);
    intersector.intersect_batch(&rays, &mut hits, &mut counts);
    intersector.occluded_batch(&rays, &mut occluded, &mut counts);
    let others_hit = (0..11).filter(|i| *i != 6).all(|i| hits[i].is_some() && occluded[i]);
    let batch = if others_hit { "in a batch" } else { "in a batch that lost its other rays" };
    let refused_too = counts[RayKind::Invalid] == 2 && others_hit;
    [("alone", alone.0, alone.1, refused), (batch, hits[6], occluded[6], refused_too)]
}

/// Time of invalid rays over that of good ones, all through batches, in turns.
fn cost(outcome: &mut Outcome, scene: &Scene, embree: &EmbreeIntersector, size: Size) {
    let count = size.of(4096, 65_536);
    let good: Vec<Ray> = (0..count)
        .map(|i| {
            let a = f64::from(i);
            let aim = DVec3::new(a.sin(), (1.7 * a).cos(), 0.0);
            placed(scene, &Ray::new(DVec3::new(0.1, 0.2, 5.0), aim - DVec3::Z * 5.0))
        })
        .collect();
    let kinds: Vec<Vec<Ray>> = table()
        .into_iter()
        .filter(|(_, _, expect)| *expect == Expect::Refused)
        .map(|(_, ray, _)| vec![placed(scene, &ray); good.len()])
        .collect();
    // One invalid ray in every packet: its neighbours must not pay.
    let mixed: Vec<Vec<Ray>> = kinds
        .iter()
        .map(|bad| {
            let pick = |(i, ray): (usize, &Ray)| if i % 8 == 3 { bad[0] } else { *ray };
            good.iter().enumerate().map(pick).collect()
        })
        .collect();
    let mut hits = vec![None; good.len()];
    let mut time = |rays: &[Ray]| {
        let start = Instant::now();
        embree.intersect_batch(rays, &mut hits, &mut RayCounts::default());
        start.elapsed().as_secs_f64()
    };
    let turns = size.of(25, 31);
    let mut times = vec![Vec::new(); 1 + kinds.len() + mixed.len()];
    for _ in 0..turns {
        let rays = std::iter::once(&good).chain(&kinds).chain(&mixed);
        rays.zip(&mut times).for_each(|(rays, times)| times.push(time(rays)));
    }
    // The small size has too few rays for a median on a busy machine: what disturbs only adds.
    let middle = |times| if size == Size::Full { median(times) } else { fastest(times) };
    let medians: Vec<f64> = times.into_iter().map(middle).collect();
    let worst = |range: std::ops::Range<usize>| {
        medians[range].iter().fold(0f64, |a, b| a.max(*b)) / medians[0]
    };
    let at_most = size.of(1.5, 1.1);
    outcome.at_most("cost of an invalid ray, of a good one's", worst(1..1 + kinds.len()), at_most);
    let among = worst(1 + kinds.len()..medians.len());
    outcome.at_most("cost of a batch with one in eight invalid", among, at_most);
}

fn fastest(times: Vec<f64>) -> f64 {
    times.into_iter().fold(f64::INFINITY, f64::min)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Names the file for the child's answers.
const CHILD: &str = "TWEENRAY_HARD_CASES_FTZ_CHILD";
/// Flush-to-zero and denormals-are-zero.
const FTZ_DAZ: u32 = 0x8040;
/// All of MXCSR but the sticky exception flags.
const CONTROL: u32 = 0xffc0;

/// Table and frame, as bytes, in this process and in a child whose every thread flushes
/// denormals: a library that someone compiled with fast maths does that to its host.
pub fn ftz_independence(_: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let before = floating_point_mode() & CONTROL;
    let ours = ftz_payload();
    outcome
        .check(floating_point_mode() & CONTROL == before, || "tracing left MXCSR changed".into());
    if let Some(file) = std::env::var_os(CHILD) {
        let flushing = worker_modes().iter().all(|mode| mode & FTZ_DAZ == FTZ_DAZ);
        outcome.check(flushing, || "the child does not flush denormals".into());
        std::fs::write(file, &ours).unwrap();
        return outcome;
    }
    for mode in worker_modes() {
        let default = mode & FTZ_DAZ == 0 || !cfg!(target_arch = "x86_64");
        outcome.check(default, || format!("a worker's MXCSR is {mode:#x}"));
    }
    let folder = tempfile::tempdir().unwrap();
    let Some(library) = flushing_library(folder.path()) else {
        outcome.skip("the flushing child: no C compiler, or not Linux on x86-64");
        return outcome;
    };
    let answers = folder.path().join("answers");
    let child = Command::new(std::env::current_exe().unwrap())
        .arg("ftz_independence")
        .env("LD_PRELOAD", library)
        .env(CHILD, &answers)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&child.stdout);
    outcome.check(child.status.success(), || format!("the child failed: {said}"));
    let theirs = std::fs::read(&answers).unwrap_or_default();
    let same = ours == theirs;
    outcome.check(same, || "denormals flushed, the answers differ".into());
    outcome.show(format!("{} bytes of answers and pixels compared", ours.len()));
    outcome
}

/// MXCSR of the calling thread and of every rayon worker.
fn worker_modes() -> Vec<u32> {
    let mut modes = rayon::broadcast(|_| floating_point_mode());
    modes.push(floating_point_mode());
    modes
}

/// Every answer to the table, and a frame of 64 x 64 pixels with lights of all kinds.
fn ftz_payload() -> Vec<u8> {
    let scene = ball();
    let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 1).unwrap();
    let mut payload = String::new();
    for (name, ray, _) in table() {
        for (how, hit, occluded, refused) in answers(&embree, &placed(&scene, &ray)) {
            let bits = hit.map(|h| [h.t, h.u, h.v].map(f64::to_bits));
            payload += &format!("{name}, {how}: {bits:?} {occluded} {refused}\n");
        }
    }
    let mut world = shapes::world_of(shapes::sphere(DVec3::ZERO, 1.0, 60, 40));
    // Weak light, but above f32's denormals: those are gone by definition.
    let intensity = Rgb::new(12.0, 1e-30, 1.0);
    world.lights.push(Light::Point(PointLight { position: DVec3::new(2.0, 3.0, 2.0), intensity }));
    let (centre, radiance) = (DVec3::new(-3.0, 2.0, 1.0), Rgb::splat(3.0));
    world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.5, radiance }));
    world.sky.radiance = Rgb::splat(0.1);
    let pose = common::pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0));
    let (film, _) = common::render(&common::job(world, pose, 64, 64));
    let mut bytes = payload.into_bytes();
    film.rgb.iter().flat_map(|c| c.to_array()).for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}

/// A library that sets FTZ and DAZ in the thread that loads it, whose threads inherit them.
fn flushing_library(folder: &Path) -> Option<std::path::PathBuf> {
    if !cfg!(all(target_os = "linux", target_arch = "x86_64")) {
        return None;
    }
    let (source, library) = (folder.join("flush.c"), folder.join("flush.so"));
    let code = "#include <immintrin.h>\n__attribute__((constructor)) static void flush(void) {\n\
                _mm_setcsr(_mm_getcsr() | 0x8040u);\n}\n";
    std::fs::write(&source, code).unwrap();
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(&library).arg(&source);
    compiler.status().is_ok_and(|s| s.success()).then_some(library)
}
