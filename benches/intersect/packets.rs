//! Rates of every packet width and flag for camera and shadow rays: decision 003's table.

use super::support::camera_rays::BLOCK;
use super::support::{self, Candidate};
use tweenray::embree::{CastRays, CommittedScene, Packet, QueryFlags};
use tweenray::intersect::{
    EmbreeIntersector, Intersector, PlaneError, Ray, RayEnd, SurfaceInteraction,
};
use tweenray::math::orthonormal_basis;
use tweenray::sampling::{PixelSampler, QuadWarp, cosine_hemisphere, to_world};
use tweenray::scene::{HitRules, Light, Recheck, Scene};
use tweenray::stats::RayCounts;

const TURNS: usize = 9;
const WIDTHS: [&str; 4] = ["16", "8", "4", "1"];
/// Shadow rays a point, as the scene file has it.
const SAMPLES: usize = 16;
/// Only every so many blocks of pixels are taken, to save time.
const EVERY: usize = 8;

/// Times every combination and prints the table.
pub fn report(scene: &Scene, committed: &CommittedScene, camera_rays: &[Ray]) {
    let blocks = camera_rays.chunks(BLOCK).step_by(EVERY);
    let camera: Vec<Ray> = blocks.flatten().copied().collect();
    let (area, sky) = shadow_rays(scene, &camera);
    let kinds = [("camera", &camera), ("shadow, area light", &area), ("shadow, sky", &sky)];
    let mut rows = Vec::new();
    for (name, rays) in kinds {
        let closest = name == "camera";
        let mut candidates: Vec<Candidate> = Vec::new();
        for coherent in [true, false] {
            // Shadow rays leave a surface, whose primitive they exclude.
            let flags = QueryFlags { coherent, exclude: !closest, ..QueryFlags::default() };
            let width = |run: fn(&CommittedScene, &[Ray], QueryFlags, bool)| -> Candidate {
                (String::new(), Box::new(move || run(committed, rays, flags, closest)))
            };
            candidates.extend([
                width(trace::<16>),
                width(trace::<8>),
                width(trace::<4>),
                width(trace::<1>),
            ]);
        }
        let times = support::take_turns(TURNS, &mut candidates);
        for (times, flag) in times.chunks(WIDTHS.len()).zip(["coherent", "incoherent"]) {
            let rate = |t: &support::Times| rays.len() as f64 / t.median() * 1e-6;
            let mut row = vec![name.to_string(), flag.to_string()];
            row.extend(times.iter().map(|t| format!("{:.1}", rate(t))));
            let spread = times.iter().map(support::Times::spread).fold(0.0, f64::max);
            row.push(format!("±{spread:.0} %"));
            rows.push(row);
        }
    }
    let mut head = vec!["Mrays/s by packet width", "flag"];
    head.extend(WIDTHS);
    head.push("spread");
    support::table(&head, &rows);
}

fn trace<const W: usize>(scene: &CommittedScene, rays: &[Ray], flags: QueryFlags, closest: bool) {
    let mut packet = Packet::<W>::new();
    let mut found = 0;
    for rays in rays.chunks(W) {
        let mut valid = [0; W];
        for (lane, ray) in rays.iter().enumerate() {
            packet.set(lane, ray);
            valid[lane] = -1;
        }
        if closest {
            scene.intersect(&valid, &mut packet, CastRays::as_asked(rays), flags);
            found += (0..rays.len()).filter(|lane| packet.hit(*lane).is_some()).count();
        } else {
            scene.occluded(&valid, &mut packet, CastRays::as_asked(rays), flags);
            found += (0..rays.len()).filter(|lane| packet.is_occluded(*lane)).count();
        }
    }
    std::hint::black_box(found);
}

/// The shadow rays that the renderer would send from the terrain that `camera` sees: to the area
/// light and to the sky.
fn shadow_rays(scene: &Scene, camera: &[Ray]) -> (Vec<Ray>, Vec<Ray>) {
    let rules = HitRules { recheck: Recheck::Always, ..HitRules::default() };
    let layer = EmbreeIntersector::new(scene, rules, None, 2).expect("Embree builds");
    let mut hits = vec![None; camera.len()];
    layer.intersect_batch(camera, &mut hits, &mut RayCounts::default());
    let Some(Light::Quad(quad)) = scene.lights.first() else {
        panic!("the bench scene has one rectangle light");
    };
    let (warp, normal) = (QuadWarp::new(quad.corners), quad.normal());
    let [a, b, c, _] = quad.corners;
    let plane_error = PlaneError::of(&[a, b, c]);
    let (mut area, mut sky) = (Vec::new(), Vec::new());
    for (k, (ray, hit)) in camera.iter().zip(&hits).enumerate() {
        let Some(hit) = hit.filter(|hit| hit.prim.geom_id == 0) else { continue };
        let si = SurfaceInteraction::new(scene, ray, &hit);
        let sampler = PixelSampler::new(0, 1, k as u32, 0);
        let mut u = [[0f32; 2]; SAMPLES];
        sampler.fill2(0, 0, &mut u);
        area.extend(u.map(|u| {
            let point = warp.point(u.map(f64::from));
            si.spawn_to(&RayEnd { point, normal, plane_error }, true)
        }));
        sampler.fill2(0, 1, &mut u);
        let n = if si.is_outside(ray.dir) { -si.ng } else { si.ng };
        let frame = orthonormal_basis(n);
        let above = |u: [f32; 2]| to_world(cosine_hemisphere(u.map(f64::from)), frame, n);
        sky.extend(u.map(|u| si.spawn(above(u), true)));
    }
    (area, sky)
}
