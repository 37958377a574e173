//! The same picture wherever the scene stands and however large it is.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{self, Outcome, Size};
use tweenray::film::Film;
use tweenray::math::{DAffine3, DVec3, Rgb, Vec3};
use tweenray::output::Display;
use tweenray::scene::{
    Camera, Glass, HitRules, Light, Material, PointLight, Pose, QuadLight, Recheck, Sky,
    SphereLight, World, WorldMesh, WorldSphere,
};

/// Our rules, but the world's own coordinates rounded to f32, and Embree's word for the hit.
const NAIVE: HitRules = HitRules {
    robust: true,
    retry: true,
    recheck: Recheck::Off,
    spawn_offset: true,
    recentre: false,
};

/// Edge of the images.
const EDGE: u32 = 64;

/// A scene that calls for every effect: diffuse, mirror, glass, all kinds of light.
fn studio(spp: u32) -> Job {
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::new(0.7, 0.7, 0.6)));
    world.materials.push(Material::diffuse("red", Rgb::new(0.7, 0.2, 0.1)));
    world.materials.push(Material { mirror: Rgb::splat(0.8), ..Material::black("mirror") });
    let glass = Some(Glass::clear(1.5));
    world.materials.push(Material { glass, ..Material::black("glass") });
    let p = DVec3::new;
    let floor = [p(-3.0, 0.0, -3.0), p(-3.0, 0.0, 3.0), p(3.0, 0.0, 3.0), p(3.0, 0.0, -3.0)];
    world.meshes.push(common::quad(floor, 0));
    world.meshes.push(common::cube(p(1.2, 0.5, -0.9), 0.5, 1));
    world.meshes.push(smooth(p(-1.1, 0.7, 0.1), 0.7, 1));
    world.meshes.push(smooth(p(0.3, 0.45, 1.0), 0.45, 3));
    let centre = p(0.2, 0.6, -0.6);
    world.spheres.push(WorldSphere::new("ball", centre, 0.6, 2));
    let lamp = [p(-0.7, 3.0, -0.7), p(0.7, 3.0, -0.7), p(0.7, 3.0, 0.7), p(-0.7, 3.0, 0.7)];
    let radiance = Rgb::splat(4.0);
    world.lights.push(Light::Quad(QuadLight { corners: lamp, radiance, two_sided: false }));
    world
        .lights
        .push(Light::Point(PointLight { position: p(2.5, 2.0, 2.5), intensity: Rgb::splat(5.0) }));
    let centre = p(-2.4, 1.8, 1.5);
    world.lights.push(Light::Sphere(SphereLight {
        centre,
        radius: 0.3,
        radiance: Rgb::new(2.0, 3.0, 6.0),
    }));
    world.sky = Sky { radiance: Rgb::splat(0.1), lights: true, ambient: Rgb::ZERO };
    let mut job = common::job(world, common::pose((0.6, 1.9, 4.3), (0.0, 0.5, 0.0)), EDGE, EDGE);
    job.settings.spp = spp;
    job.settings.shadow_samples = 4;
    job.settings.sky_samples = 4;
    job
}

/// A sphere of triangles with smooth normals.
fn smooth(centre: DVec3, radius: f64, material: u32) -> WorldMesh {
    WorldMesh { material, ..shapes::smooth_sphere(centre, radius, 48, 24) }
}

/// The jobs that are moved about.
fn jobs(size: Size) -> Vec<(&'static str, Job)> {
    let mut jobs = vec![("studio", studio(size.of(1, 16)))];
    if size == Size::Full {
        for name in ["cornell", "reflective_spheres"] {
            jobs.push((name, common::load_job(name, 1, Some((EDGE, EDGE)))));
        }
    }
    jobs
}

/// The job with everything moved by `transform`, which makes lengths `scale` times as long, and
/// with point lights that shine as bright as before.
fn moved(job: &Job, transform: &DAffine3, scale: f64) -> Job {
    let mut world = job.world.clone();
    world.apply_transform(transform).unwrap();
    for light in &mut world.lights {
        if let Light::Point(PointLight { intensity, .. }) = light {
            *intensity = (intensity.as_dvec3() * scale * scale).as_vec3();
        }
    }
    let camera = &job.camera;
    let pose = Pose {
        eye: transform.transform_point3(camera.eye),
        target: transform.transform_point3(camera.eye + camera.forward * 4.0),
        up: camera.half_up,
        roll_degrees: 0.0,
    };
    let vfov = 2.0 * camera.half_up.length().atan().to_degrees();
    let camera = Camera::new(&pose, vfov, camera.width, camera.height).unwrap();
    Job { world, camera, settings: job.settings.clone() }
}

fn render(job: &Job, rules: HitRules) -> Film {
    let isa = suite::isa().map(Into::into);
    let settings = tweenray::scene::Settings { rules, isa, ..job.settings.clone() };
    common::render(&Job { world: job.world.clone(), camera: job.camera, settings }).0
}

/// Colour values of `b` that differ by more than one of 255 from those of `a`, and the largest
/// difference.
fn apart(job: &Job, a: &Film, b: &Film) -> (u64, u8) {
    let display = Display { exposure: job.settings.exposure, tone: job.settings.tone };
    let [a, b] = [a, b].map(|film| display.encode_8(&film.rgb, film.width));
    let differences: Vec<u8> = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).collect();
    let most = differences.iter().copied().max().unwrap_or(0);
    (differences.iter().filter(|d| **d > 1).count() as u64, most)
}

/// Colour values of an image.
const VALUES: u64 = 3 * (EDGE * EDGE) as u64;

fn is_lit(film: &Film) -> bool {
    let bright = film.rgb.iter().filter(|c| c.max_element() > 0.05).count();
    bright > film.rgb.len() / 2 && film.rgb.iter().all(|c| c.is_finite())
}

/// Images at offsets up to 1e9.
pub fn translation(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let ways = [DVec3::X, DVec3::new(1.0, -1.0, 0.5), DVec3::new(-0.3, 0.1, 1.0)];
    for (name, job) in jobs(size) {
        let shot = |offset: DVec3, rules: HitRules| {
            render(&moved(&job, &DAffine3::from_translation(offset), 1.0), rules)
        };
        let here = shot(DVec3::ZERO, HitRules::default());
        if !is_lit(&here) {
            outcome.complain(format!("{name} is dark"));
        }
        let naive_here = shot(DVec3::ZERO, NAIVE);
        for offset in [1e3, 1e5, 1e6, 1e9] {
            let mut worst = 0;
            for way in &ways[..size.of(1, 3)] {
                let (wrong, most) = apart(&job, &here, &shot(*way * offset, HitRules::default()));
                outcome.count(VALUES, wrong);
                worst = worst.max(most);
                if wrong > 0 {
                    outcome.example(format!("{name} at {:?}: {wrong} values", *way * offset));
                }
            }
            let naive_wrong = apart(&job, &naive_here, &shot(ways[0] * offset, NAIVE)).0;
            let naive_share = 100.0 * naive_wrong as f64 / VALUES as f64;
            outcome.show(format!(
                "{name} at {offset:.0e}: {worst} of 255 at most; without our rules {naive_share:.1} % \
                 of values change by more than 1"
            ));
            if offset == 1e9 && naive_share < 1.0 {
                outcome.complain(format!("{name} is not hard at {offset:.0e}"));
            }
        }
    }
    outcome
}

/// Whether every number of the two films is the same, lengths `scale` times as long.
fn same_bits(a: &Film, b: &Film, scale: f64) -> u64 {
    let (ga, gb) = (a.gbuffer.as_ref().unwrap(), b.gbuffer.as_ref().unwrap());
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    let longer = |x: f32| ((f64::from(x) * scale) as f32).to_bits();
    let differs = |i: usize| {
        let place = ga.position[i].to_array().map(longer);
        bits(a.rgb[i]) != bits(b.rgb[i])
            || bits(ga.normal[i]) != bits(gb.normal[i])
            || ga.mesh_id[i] != gb.mesh_id[i]
            || longer(ga.depth[i]) != gb.depth[i].to_bits()
            || place != bits(gb.position[i])
    };
    (0..a.rgb.len()).filter(|i| differs(*i)).count() as u64
}

/// Images at scales from 2^-40 to 2^40, and at powers of ten.
pub fn scale(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    for (name, job) in jobs(size) {
        let shot = |scale: f64, rules: HitRules| {
            render(&moved(&job, &DAffine3::from_scale(DVec3::splat(scale)), scale), rules)
        };
        let here = shot(1.0, HitRules::default());
        if !is_lit(&here) {
            outcome.complain(format!("{name} is dark"));
        }
        for k in (-40..=40).step_by(size.of(20, 1)) {
            let scale = 2f64.powi(k);
            let different = same_bits(&here, &shot(scale, HitRules::default()), scale);
            outcome.count(u64::from(EDGE * EDGE), different);
            if different > 0 {
                outcome.example(format!("{name} times 2^{k}: {different} pixels differ"));
            }
        }
        let mut worst = 0;
        for k in [-6, 6].into_iter().chain((-5..=5).take(size.of(0, 11))) {
            let (wrong, most) = apart(&job, &here, &shot(10f64.powi(k), HitRules::default()));
            outcome.count(VALUES, wrong);
            worst = worst.max(most);
            if wrong > 0 {
                outcome.example(format!("{name} times 10^{k}: {wrong} values"));
            }
        }
        outcome.show(format!("{name} at powers of ten: {worst} of 255 at most"));
        let naive_here = shot(1.0, NAIVE);
        for k in [-40, 40] {
            let different = apart(&job, &naive_here, &shot(2f64.powi(k), NAIVE)).0;
            let share = 100.0 * different as f64 / VALUES as f64;
            outcome
                .show(format!("{name} times 2^{k}, not rescaled: {share:.1} % of values change"));
        }
    }
    outcome
}
