//! Scenes of many lights: what points look at is a choice, and the picture is that of all lights.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;
#[path = "common/moves.rs"]
mod moves;

use common::{Job, job, pose, render, render_scene, render_with_every_effect};
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    DirectionalLight, DiskLight, IntersectorKind, Light, Material, PointLight, QuadLight, Rect,
    Settings, SphereLight, SpotLight, World, WorldSphere,
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

fn hall_job(count: u32, glossy: bool, (width, height): (u32, u32)) -> Job {
    let mut job = job(hall(count, glossy), pose((0.5, 1.7, 3.5), (0.0, 0.4, -6.0)), width, height);
    (job.settings.spp, job.settings.shadow_samples, job.settings.bounces) = (2, 4, 2);
    job
}

fn with_all(job: &Job) -> Job {
    Job { settings: Settings { all_lights: true, ..job.settings.clone() }, ..job.clone() }
}

/// The mean over frames of the same view with other random numbers, and of each pixel's variance.
fn mean(job: &Job, frames: u32) -> (Vec<Rgb>, Vec<Rgb>) {
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    let (mut sum, mut squares) = (Vec::new(), Vec::new());
    for frame in 1..=frames {
        let whole = FrameJob::whole(&job.camera, frame);
        let film = renderer.render_job(&whole, &AtomicBool::new(false), &()).unwrap().film;
        sum.resize(film.rgb.len(), Rgb::ZERO);
        squares.resize(film.rgb.len(), Rgb::ZERO);
        for ((sum, squares), rgb) in sum.iter_mut().zip(&mut squares).zip(&film.rgb) {
            *sum += *rgb;
            *squares += *rgb * *rgb;
        }
    }
    let n = frames as f32;
    let mean: Vec<Rgb> = sum.iter().map(|sum| *sum / n).collect();
    let variance = squares.iter().zip(&mean).map(|(s, m)| (*s / n - *m * *m) / n);
    let variance = variance.collect();
    (mean, variance)
}

/// Sums over squares of this edge: a pixel's own variance is badly known where bright samples are rare.
const SQUARE: usize = 8;

/// The means of many renders with selected lights and with all differ by chance alone, in each part of the picture and
/// in sum.
fn is_unbiased(glossy: bool) {
    let (width, height) = (24, 16);
    let job = hall_job(64, glossy, (width, height));
    let (ours, our_variance) = mean(&job, 200);
    let (all, all_variance) = mean(&with_all(&job), 100);
    let across = width as usize / SQUARE;
    let mut squares = vec![[0.0; 3]; across * height as usize / SQUARE];
    for i in 0..ours.len() {
        let (x, y) = (i % width as usize, i / width as usize);
        let [apart, variance, bright] = &mut squares[y / SQUARE * across + x / SQUARE];
        *apart += f64::from((ours[i] - all[i]).y);
        *variance += f64::from((our_variance[i] + all_variance[i]).y);
        *bright += f64::from(all[i].y);
    }
    let z = |[apart, variance, _]: [f64; 3]| apart / variance.sqrt();
    let sum = |k: usize| squares.iter().map(|square| square[k]).sum::<f64>();
    let whole = [0, 1, 2].map(sum);
    let off = whole[0] / whole[2];
    let worst = squares.iter().map(|square| z(*square).abs()).fold(0.0, f64::max);
    println!("glossy {glossy}: off by {off:.1e} of all light, z {:.2}, worst {worst:.2}", z(whole));
    assert!(z(whole).abs() < 4.0 && off.abs() < 4e-3 && worst < 4.5, "{off} {worst}");
}

#[test]
fn selected_lights_are_as_bright_as_all() {
    is_unbiased(false);
}

#[test]
fn selected_lights_are_as_bright_as_all_on_glossy_surfaces() {
    is_unbiased(true);
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
    check(&|w| w.lights.push(sphere(Rgb::NAN)), true);
}
