//! Where the light ends on a coarse mesh with smooth normals.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{Outcome, Size};
use std::time::Instant;
use tweenray::math::{DVec3, Rgb, luminance};
use tweenray::scene::{Corners, Light};

/// A ball of `rows` by `rows` facets with the normals of a sphere.
fn ball(rows: u32, light: Light, edge: u32, smooth_terminator: bool) -> Job {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, rows, rows);
    let values = mesh.positions.iter().map(|p| p.normalize().as_vec3()).collect();
    mesh.normals = Some(Corners { values, corners: None });
    let mut world = shapes::world_of(mesh);
    world.lights.push(light);
    let mut job = common::job(world, common::pose((0.4, 0.9, 3.2), (0.0, 0.0, 0.0)), edge, edge);
    job.settings.smooth_terminator = smooth_terminator;
    job.settings.spp = 4;
    job
}

/// The largest difference of luminance between pixels side by side, both well within the ball.
fn largest_step(job: &Job) -> f32 {
    let (film, _) = common::render(job);
    let ids = &film.gbuffer.as_ref().unwrap().mesh_id;
    let (width, height) = (film.width, film.height);
    // One pixel from the outline a pixel's samples may miss the ball.
    let inside = |x: u32, y: u32| {
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        around.into_iter().all(|(x, y)| ids[film.index(x, y)] == 1)
    };
    let at = |x: u32, y: u32| luminance(film.rgb[film.index(x, y)]);
    let mut most = 0f32;
    for y in 1..height - 2 {
        for x in 1..width - 2 {
            for (x2, y2) in [(x + 1, y), (x, y + 1)] {
                if inside(x, y) && inside(x2, y2) {
                    most = most.max((at(x, y) - at(x2, y2)).abs());
                }
            }
        }
    }
    most
}

/// Lights at `angle` (degrees) around the ball: 0 is behind the camera.
fn lights(angle: f64) -> [(&'static str, Light); 2] {
    let (sin, cos) = angle.to_radians().sin_cos();
    let to_light = DVec3::new(sin, 0.2, cos).normalize();
    [
        ("sun", Light::Directional { to_light, irradiance: Rgb::splat(3.0) }),
        (
            "lamp",
            Light::Sphere { centre: to_light * 6.0, radius: 0.4, radiance: Rgb::splat(200.0) },
        ),
    ]
}

pub fn terminator(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(64, 256);
    let step = size.of(30, 5);
    for kind in 0..2 {
        // Largest step of the sweep, and the largest share of the fine ball's at one angle.
        let (mut coarse, mut off, mut fine, mut ratio) = (0f32, 0f32, 0f32, 0f32);
        let mut name = "";
        for angle in (0..=180).step_by(step) {
            let (kind, light) = lights(f64::from(angle))[kind].clone();
            name = kind;
            let ours = largest_step(&ball(8, light.clone(), edge, true));
            let reference = largest_step(&ball(256, light.clone(), edge, true));
            off = off.max(largest_step(&ball(8, light, edge, false)));
            coarse = coarse.max(ours);
            fine = fine.max(reference);
            ratio = ratio.max(ours / reference);
            outcome.trials += 1;
        }
        outcome.at_most(
            &format!("{name}: step, of a 256 x 256 ball's"),
            f64::from(coarse / fine),
            1.5,
        );
        outcome.at_least(&format!("{name}: without the rule"), f64::from(off / fine), 1.5);
        outcome
            .show(format!("{name}: at its worst angle {ratio:.2} of the fine ball's step there"));
    }
    if size == Size::Full {
        cost(&mut outcome);
    }
    outcome
}

/// Time of a frame with the rule over one without, in turns.
fn cost(outcome: &mut Outcome) {
    let light = lights(60.0)[1].1.clone();
    let jobs = [false, true].map(|on| ball(256, light.clone(), 384, on));
    let scenes = [0, 1].map(|i: usize| jobs[i].world.clone().into_scene(true).unwrap());
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..15 {
        for (i, job) in jobs.iter().enumerate() {
            let plan = tweenray::effects::EffectPlan::of(&scenes[i], &job.settings);
            let intersector = tweenray::intersect::build(&scenes[i], &job.settings, 2).unwrap();
            let (scene, settings) = (&scenes[i], &job.settings);
            let renderer =
                tweenray::shade::Renderer { scene, settings, plan, intersector: &*intersector };
            let never = std::sync::atomic::AtomicBool::new(false);
            let start = Instant::now();
            renderer.render(&job.camera, 1, false, &never, &common::Silent).unwrap();
            times[i].push(start.elapsed().as_secs_f64());
        }
    }
    let median = |t: &mut Vec<f64>| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 2]
    };
    let [without, with] = &mut times;
    let percent = 100.0 * (median(with) / median(without) - 1.0);
    outcome
        .show(format!("cost: {percent:+.1} % of a frame (median of 15 in turns; Cycles +3.0 %)"));
}
