//! Where the light ends on a coarse mesh with smooth normals.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{Outcome, Size};
use std::f32::consts::PI;
use std::time::Instant;
use tweenray::math::{DVec3, Rgb, luminance};
use tweenray::scene::{DirectionalLight, Light, SphereLight};

/// A ball of `rows` by `rows` facets with the normals of a sphere.
fn ball(rows: u32, light: Light, edge: u32, smooth_terminator: bool) -> Job {
    let mut world = shapes::world_of(shapes::smooth_sphere(DVec3::ZERO, 1.0, rows, rows));
    world.lights.push(light);
    let mut job = common::job(world, common::pose((0.4, 0.9, 3.2), (0.0, 0.0, 0.0)), edge, edge);
    job.settings.smooth_terminator = smooth_terminator;
    // The one sample a pixel has is the one whose normal is recorded.
    job.settings.spp = 1;
    job
}

/// What a picture of the ball shows.
#[derive(Default)]
struct Seen {
    /// Largest difference of luminance between pixels side by side, outline left out.
    step: f32,
    /// The same for what the recorded normals reflect if nothing is in the light's way.
    unshadowed_step: f32,
    /// Pixels that differ from that visibly.
    shadowed: u64,
    /// The largest such difference.
    most: f32,
    pixels: u64,
}

impl Seen {
    fn add(&mut self, o: &Self) {
        self.step = self.step.max(o.step);
        self.unshadowed_step = self.unshadowed_step.max(o.unshadowed_step);
        self.shadowed += o.shadowed;
        self.most = self.most.max(o.most);
        self.pixels += o.pixels;
    }
}

/// The step of 8-bit pixels.
const VISIBLE: f32 = 1.0 / 255.0;

fn look(job: &Job) -> Seen {
    let (film, _) = common::render(job);
    let buffer = film.gbuffer.as_ref().unwrap();
    let light = &job.world.lights[0];
    // One pixel from the outline a pixel's samples may miss the ball.
    let inside = |x: u32, y: u32| {
        let mut around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        around.all(|(x, y)| buffer.mesh_id[film.index(x, y)] == 1)
    };
    let at = |x: u32, y: u32| {
        let i = film.index(x, y);
        let (normal, position) = (buffer.normal[i].as_dvec3(), buffer.position[i].as_dvec3());
        (luminance(film.rgb[i]), unshadowed(light, position, normal))
    };
    let mut seen = Seen::default();
    for y in 1..film.height - 2 {
        for x in 1..film.width - 2 {
            if !inside(x, y) {
                continue;
            }
            let (found, (expected, whole)) = at(x, y);
            seen.pixels += 1;
            if whole {
                let off = (found - expected).abs();
                seen.shadowed += u64::from(off > VISIBLE);
                seen.most = seen.most.max(off);
            }
            for (x2, y2) in [(x + 1, y), (x, y + 1)] {
                if inside(x2, y2) {
                    let (found2, (expected2, _)) = at(x2, y2);
                    seen.step = seen.step.max((found - found2).abs());
                    let step = (expected - expected2).abs();
                    seen.unshadowed_step = seen.unshadowed_step.max(step);
                }
            }
        }
    }
    seen
}

/// Radiance that a white surface reflects if nothing is in the light's way, and whether that is
/// sure: not where a lamp is half below the horizon.
fn unshadowed(light: &Light, p: DVec3, n: DVec3) -> (f32, bool) {
    let (to_light, irradiance, sin) = match light {
        Light::Directional(DirectionalLight { to_light, irradiance }) => {
            (*to_light, irradiance.x, 0.0)
        }
        Light::Sphere(SphereLight { centre, radius, radiance }) => {
            let sin = radius / (*centre - p).length();
            ((*centre - p).normalize(), radiance.x * PI * (sin * sin) as f32, sin)
        }
        _ => unreachable!("a sun or a lamp"),
    };
    let cos = to_light.dot(n);
    (irradiance * cos.max(0.0) as f32 / PI, cos.abs() >= sin)
}

/// Irradiance of the sun; the lamp's is chosen alike.
const SUN: f32 = 3.0;

/// Directions `angle` (degrees) around the ball: 0 is behind the camera.
fn direction(angle: f64) -> DVec3 {
    let (sin, cos) = angle.to_radians().sin_cos();
    DVec3::new(sin, 0.2, cos).normalize()
}

fn sun(to_light: DVec3) -> Light {
    Light::Directional(DirectionalLight { to_light, irradiance: Rgb::splat(SUN) })
}

/// A lamp of radius 0.4 at distance 6, as bright as the sun there.
fn lamp(to_light: DVec3) -> Light {
    let radiance = Rgb::splat(SUN * 36.0 / (0.16 * PI));
    Light::Sphere(SphereLight { centre: to_light * 6.0, radius: 0.4, radiance })
}

pub fn terminator(size: Size) -> Outcome {
    // The lifted point is an approximation: close under a lamp a few shadow rays still graze a facet.
    let mut outcome = Outcome { allowed: 5e-4, ..Outcome::default() };
    let edge = size.of(64, 256);
    let turn = size.of(30, 5);
    for (name, light) in [("sun", sun as fn(DVec3) -> Light), ("lamp", lamp)] {
        let sweep = |rows: u32, rule: bool| {
            let mut all = Seen::default();
            for angle in (0..=180).step_by(turn) {
                all.add(&look(&ball(rows, light(direction(f64::from(angle))), edge, rule)));
            }
            all
        };
        let (ours, off, fine) = (sweep(8, true), sweep(8, false), sweep(256, true));
        // The coarse ball's normals turn faster from pixel to pixel than a sphere's where a facet
        // is seen edge-on: no rule about shadows changes that.
        let of = |step: f32, reference: f32| f64::from(step / reference);
        let of_own = of(ours.step, ours.unshadowed_step);
        outcome.at_most(&format!("{name}: step, of the same without shadows"), of_own, 1.01);
        let shadowed = off.shadowed as f64 / off.pixels as f64;
        outcome.at_least(&format!("{name}: self-shadowed without the rule"), shadowed, 0.01);
        outcome.show(format!(
            "{name}: step, of a 256 x 256 ball's: {:.2}, without the rule {:.2}; without any shadow {:.2}",
            of(ours.step, fine.step),
            of(off.step, fine.step),
            of(ours.unshadowed_step, fine.step)
        ));
        outcome.show(format!(
            "{name}: {} of {} pixels in a shadow of their own ball (the darkest by {:.1e}), {} without \
             the rule",
            ours.shadowed, ours.pixels, ours.most, off.shadowed
        ));
        outcome.count(ours.pixels, ours.shadowed);
    }
    if size == Size::Full {
        cost(&mut outcome);
    }
    outcome
}

/// Time of a frame with the rule over one without, in turns.
fn cost(outcome: &mut Outcome) {
    let light = lamp(direction(60.0));
    let jobs = [false, true].map(|on| ball(256, light.clone(), 384, on));
    let scenes = [0, 1].map(|i: usize| jobs[i].world.clone().into_scene(true).unwrap());
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..15 {
        for (i, job) in jobs.iter().enumerate() {
            let intersector = tweenray::intersect::build(&scenes[i], &job.settings, 2).unwrap();
            let renderer = tweenray::shade::Renderer::new(&scenes[i], &job.settings, &*intersector);
            let never = std::sync::atomic::AtomicBool::new(false);
            let start = Instant::now();
            renderer.render(&job.camera, 1, false, &never, &()).unwrap();
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
