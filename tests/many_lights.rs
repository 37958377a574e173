//! Scenes of many lights: what points look at is a choice, and the picture is that of all lights.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;
#[path = "common/moves.rs"]
mod moves;

use common::{Job, job, pose, render, render_scene, render_with_every_effect};
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect::{self, Intersector};
use tweenray::math::{DVec3, Rgb, luminance};
use tweenray::scene::{
    DirectionalLight, DiskLight, IntersectorKind, Light, Material, PointLight, QuadLight, Rect,
    Scene, Settings, SphereLight, SpotLight, SunLight, World, WorldSphere,
};
use tweenray::shade::{FrameJob, Renderer};

/// A floor and a wall with balls before them, under a ceiling of `count` lights of all kinds; `glossy` makes the
/// floor reflect them.
fn hall(count: u32, glossy: bool) -> World {
    let mut world = World::default();
    let floor = Material::diffuse("floor", Rgb::new(0.6, 0.5, 0.4));
    world.materials.push(match glossy {
        true => Material { mirror: Rgb::splat(0.3), roughness: 0.25, ..floor },
        false => floor,
    });
    world.materials.push(Material::diffuse("wall", Rgb::splat(0.7)));
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let ground = [(-8.0, 4.0), (8.0, 4.0), (8.0, -20.0), (-8.0, -20.0)];
    world.meshes.push(common::quad(ground.map(|(x, z)| corner(x, 0.0, z)), 0));
    let wall = [(-8.0, 0.0), (8.0, 0.0), (8.0, 4.0), (-8.0, 4.0)];
    world.meshes.push(common::quad(wall.map(|(x, y)| corner(x, y, -20.0)), 1));
    for k in 0..6 {
        let (x, z) = (-4.0 + 1.7 * f64::from(k), -2.0 - 2.3 * f64::from(k % 4));
        world.spheres.push(WorldSphere::new("ball", corner(x, 0.6, z), 0.6, 1));
    }
    for k in 0..count {
        let (x, z) = (-7.0 + 2.0 * f64::from(k % 8), 2.0 - 2.6 * f64::from(k / 8));
        world.lights.push(lamp(k, corner(x, 2.5, z)));
    }
    world
}

fn lamp(k: u32, p: DVec3) -> Light {
    let warm = Rgb::new(1.0, 0.8, 0.5);
    match k % 5 {
        0 => Light::Disk(DiskLight {
            centre: p,
            normal: DVec3::NEG_Y,
            radius: 0.2,
            radiance: warm * 9.0,
            two_sided: false,
        }),
        1 => Light::Sphere(SphereLight { centre: p, radius: 0.15, radiance: warm * 9.0 }),
        2 => {
            let corners = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)];
            let corners = corners.map(|(x, z)| p + DVec3::new(x, 0.0, z));
            Light::Quad(QuadLight { corners, radiance: warm * 8.0, two_sided: k % 2 == 0 })
        }
        3 => Light::Spot(SpotLight {
            position: p,
            direction: DVec3::NEG_Y,
            intensity: warm * 1.5,
            cos_inner: 0.9,
            cos_outer: 0.5,
            radius: if k % 2 == 0 { 0.1 } else { 0.0 },
        }),
        _ => Light::Point(PointLight { position: p, intensity: warm * 0.3 }),
    }
}

/// A floor under rows of `count` upright panels, every other one of which shines to the left, the others to the right.
/// Wherever a point lies, it sees the backs of half of them.
fn panels(count: u32) -> World {
    let mut world = hall(0, false);
    for k in 0..count {
        let (x, z) = (-7.5 + 1.5 * f64::from(k % 11), 3.0 - 2.0 * f64::from(k / 11));
        let p = DVec3::new(x, 1.5, z);
        let corners = [(-0.2, -0.2), (-0.2, 0.2), (0.2, 0.2), (0.2, -0.2)];
        let mut corners = corners.map(|(y, z)| p + DVec3::new(0.0, y, z));
        if k % 2 == 0 {
            corners.reverse();
        }
        let radiance = Rgb::splat(6.0);
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
    }
    world
}

fn hall_job(count: u32, glossy: bool, size: (u32, u32)) -> Job {
    job_of(hall(count, glossy), size)
}

fn job_of(world: World, (width, height): (u32, u32)) -> Job {
    let mut job = job(world, pose((0.5, 1.7, 3.5), (0.0, 0.4, -6.0)), width, height);
    (job.settings.spp, job.settings.shadow_samples, job.settings.bounces) = (2, 4, 2);
    job
}

fn with_all(job: &Job) -> Job {
    Job { settings: Settings { all_lights: true, ..job.settings.clone() }, ..job.clone() }
}

/// The luminance of each pixel in a picture with this seed. (Of other frames the paths would be the same.)
fn picture(scene: &Scene, intersector: &dyn Intersector, job: &Job, seed: u64) -> Vec<f64> {
    let settings = Settings { seed, ..job.settings.clone() };
    let renderer = Renderer::new(scene, &settings, intersector);
    let whole = FrameJob::whole(&job.camera, 1);
    let film = renderer.render_job(&whole, &AtomicBool::new(false), &()).unwrap().film;
    film.rgb.iter().map(|rgb| f64::from(luminance(*rgb))).collect()
}

/// Parts of a picture are squares of this edge: a pixel's own variance is badly known where bright samples are rare.
const SQUARE: usize = 8;

/// Pictures with selected lights and with all differ by chance alone, in each part and in sum.
fn assert_unbiased(name: &str, world: World) {
    const PICTURES: u64 = 200;
    let (width, height) = (24, 16);
    let job = job_of(world, (width, height));
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
    let across = width as usize / SQUARE;
    // For each part, and for the whole, the sum of the differences, of their squares, and of all light.
    let mut sums = vec![[0.0; 3]; across * height as usize / SQUARE + 1];
    for seed in 0..PICTURES {
        // The same paths, so that these do not differ.
        let of = |job: &Job| picture(&scene, &*intersector, job, seed);
        let (ours, all) = (of(&job), of(&with_all(&job)));
        let mut parts = vec![[0.0; 2]; sums.len()];
        for (i, (ours, all)) in ours.iter().zip(&all).enumerate() {
            let (x, y) = (i % width as usize, i / width as usize);
            for part in [y / SQUARE * across + x / SQUARE, sums.len() - 1] {
                parts[part][0] += ours - all;
                parts[part][1] += all;
            }
        }
        for ([apart, squares, bright], [difference, light]) in sums.iter_mut().zip(parts) {
            *apart += difference;
            *squares += difference * difference;
            *bright += light;
        }
    }
    let n = PICTURES as f64;
    let z = |[apart, squares, _]: &[f64; 3]| {
        let mean = apart / n;
        mean / ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt().max(1e-12)
    };
    let worst = sums.iter().map(|part| z(part).abs()).fold(0.0, f64::max);
    let whole = sums[sums.len() - 1];
    let off = whole[0] / whole[2];
    println!("{name}: off by {off:.1e} of all light, z {:.2}, worst {worst:.2}", z(&whole));
    assert!(off.abs() < 4e-3 && worst < 4.0, "{off} {worst}");
}

#[test]
fn selected_lights_are_as_bright_as_all() {
    assert_unbiased("diffuse", hall(64, false));
}

#[test]
fn selected_lights_are_as_bright_as_all_on_glossy_surfaces() {
    assert_unbiased("glossy", hall(64, true));
}

/// The tail of 120 lights is longer than what points look at light by light.
#[test]
fn the_backs_of_lights_are_dark_however_many_there_are() {
    assert_unbiased("backs", panels(120));
}

/// A bulb of a thousand triangles and quads in a scene file lights a floor as the sphere does that it stands for.
#[test]
fn a_bulb_of_triangles_lights_as_a_sphere_does() {
    let folder = tempfile::tempdir().unwrap();
    let mean = |lamp: &str| {
        let text = format!(
            "camera.still = {{ eye = [0, 3, 5], target = [0, 0.4, 0] }}\n\
             [material.glow]\nemission = 4\n[material.grey]\ndiffuse = 0.7\n\
             [[mesh]]\nquad = {{ centre = [0, 0, 0], normal = 'y', size = [4, 4] }}\nmaterial = 'grey'\n\
             {lamp}\nmaterial = 'glow'\n"
        );
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text).unwrap();
        let loaded = tweenray::import::load(&file, &Default::default()).unwrap();
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let count = loaded.world.lights.len();
        let mut job = job(loaded.world, pose((0.0, 3.0, 5.0), (0.0, 0.0, 0.0)), 48, 36);
        (job.settings.spp, job.settings.shadow_samples) = (4, 16);
        let (film, _) = render(&job);
        // The floor alone: of the lamp's outline a mesh lacks a little.
        let floor = film.rgb[48 * 18..].iter().map(|c| f64::from(luminance(*c))).sum::<f64>();
        (count, floor)
    };
    let (one, sphere) = mean("[[sphere]]\ncentre = [0, 1.8, 0]\nradius = 0.4");
    let bulb = "uv_sphere = { centre = [0, 1.8, 0], radius = 0.4, meridians = 48, bands = 25 }";
    let (many, mesh) = mean(&format!("[[mesh]]\n{bulb}"));
    assert!(one == 1 && many > 1000, "{many}");
    assert!((mesh / sphere - 1.0).abs() < 0.01, "{mesh} for {sphere}");
}

fn on_threads(job: &Job, threads: usize) -> Film {
    let scene = job.world.clone().into_scene(true).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let intersector = pool.install(|| intersect::build(&scene, &job.settings, threads)).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    pool.install(|| renderer.render(&job.camera, 7, true, &AtomicBool::new(false), &())).unwrap().0
}

#[test]
fn threads_crops_and_kernels_give_the_same_bytes() {
    for glossy in [false, true] {
        let job = hall_job(40, glossy, (61, 43));
        let whole = on_threads(&job, 1);
        assert!(whole == on_threads(&job, 3));
        let scene = job.world.clone().into_scene(true).unwrap();
        let every = render_with_every_effect(&scene, &job);
        let plain = render_scene(&scene, &job);
        assert!(plain.0 == every.0 && plain.1 == every.1);
        let mut cropped = job.clone();
        let crop = Rect { x0: 13, y0: 5, x1: 40, y1: 37 };
        cropped.settings.crop = Some(crop);
        let part = on_threads(&cropped, 2);
        for y in crop.y0..crop.y1 {
            for x in crop.x0..crop.x1 {
                assert_eq!(part.rgb[part.index(x, y)], whole.rgb[whole.index(x, y)], "{x}, {y}");
            }
        }
    }
}

#[test]
fn the_oracle_sees_the_same_lights() {
    let job = hall_job(40, false, (32, 24));
    let mut slow = job.clone();
    slow.settings.intersector = IntersectorKind::Oracle;
    let (ours, theirs) = (render(&job).0, render(&slow).0);
    let differ =
        ours.rgb.iter().zip(&theirs.rgb).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3);
    let differ = differ.count();
    assert!(differ <= 8, "{differ} of {} pixels differ", ours.rgb.len());
}

#[test]
fn few_lights_are_all_looked_at() {
    let job = hall_job(8, true, (32, 24));
    assert!(render(&job) == render(&with_all(&job)));
    let scene = job.world.into_scene(true).unwrap();
    assert!(scene.light_cells.is_none());
    assert!(hall(9, false).into_scene(true).unwrap().light_cells.is_some());
}

/// A huge light beside tiny ones, lights in one place, in a ball, black ones, suns, and lights whose radiance is no
/// number: what is valid of all lights is valid of some, and what is not is counted.
#[test]
fn odd_lights_do_no_harm() {
    let base = hall_job(20, false, (24, 16));
    let check = |change: &dyn Fn(&mut World), bad: bool| {
        let mut job = base.clone();
        change(&mut job.world);
        let film = render(&job).0;
        assert_eq!(film.bad.total() > 0, bad);
        if !bad {
            let sum = |film: &Film| film.rgb.iter().map(|c| f64::from(c.y)).sum::<f64>();
            let (ours, all) = (sum(&film), sum(&render(&with_all(&job)).0));
            assert!((ours / all - 1.0).abs() < 0.05, "{ours} of {all}");
        }
    };
    let huge = [(-9.0, 5.0), (9.0, 5.0), (9.0, -21.0), (-9.0, -21.0)];
    let corners = huge.map(|(x, z)| DVec3::new(x, 3.9, z));
    let huge = QuadLight { corners, radiance: Rgb::splat(0.5), two_sided: false };
    check(&|w| w.lights.push(Light::Quad(huge.clone())), false);
    check(&|w| (0..40).for_each(|k| w.lights.push(lamp(k, DVec3::new(0.0, 2.0, -5.0)))), false);
    check(&|w| (0..5).for_each(|k| w.lights.push(lamp(k, DVec3::new(-4.0, 0.6, -2.0)))), false);
    let sphere = |radiance| {
        Light::Sphere(SphereLight { centre: DVec3::new(1.0, 1.5, -3.0), radius: 0.2, radiance })
    };
    check(&|w| w.lights.extend(vec![sphere(Rgb::ZERO); 30]), false);
    let sun = DirectionalLight { to_light: DVec3::Y, irradiance: Rgb::splat(0.1) };
    check(&|w| w.lights.extend(vec![Light::Directional(sun.clone()); 30]), false);
    let sun = SunLight::of_irradiance(DVec3::new(0.6, 0.8, 0.0), 0.1, Rgb::splat(0.1));
    check(&|w| w.lights.extend(vec![Light::Sun(sun.clone()); 30]), false);
    check(&|w| w.lights.push(sphere(Rgb::NAN)), true);
}
