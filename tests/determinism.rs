//! The same bytes whatever the threads, the crop and the kernel.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Job, job, pose, render, render_scene, render_with_every_effect};
use std::sync::atomic::AtomicBool;
use tweenray::effects::EffectPlan;
use tweenray::embree::floating_point_mode;
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    BuildQuality, DirectionalLight, DiskLight, Filter, Glass, Lens, Light, Material, QuadLight,
    Rect, Sky, SphereLight, SpotLight, SunLight, ThinLens, VertexColours, World, WorldMesh,
    WorldSphere,
};
use tweenray::shade::Renderer;
use tweenray::stats::RayKind;

/// A bumpy floor of 3,200 triangles with spheres on it; `extras` adds lights and materials.
fn busy_world([mirror, glass, ranked, area, sky]: [bool; 5]) -> World {
    let mut world = World::default();
    let floor = Material::diffuse("floor", Rgb::new(0.6, 0.5, 0.4));
    world.materials.push(Material { vertex_colours: true, ..floor });
    world.meshes.push(bumpy_floor(40));
    let mut ball = |material: Material, x: f64| {
        world.materials.push(material);
        let material = world.materials.len() as u32 - 1;
        world.spheres.push(WorldSphere::new("ball", DVec3::new(x, 0.7, 0.0), 0.6, material));
    };
    if mirror {
        ball(Material { mirror: Rgb::splat(0.9), ..Material::black("mirror") }, -1.2);
        let satin =
            Material { mirror: Rgb::splat(0.3), ..Material::diffuse("satin", Rgb::splat(0.4)) };
        ball(Material { roughness: 0.3, ..satin }, -2.6);
    }
    if glass {
        let (tint, absorption) = (Rgb::splat(0.98), Rgb::new(0.0, 0.3, 0.1));
        let priority = ranked.then_some(1);
        let glass = Glass { tint, absorption, priority, ..Glass::clear(1.5) };
        ball(Material { glass: Some(glass), ..Material::black("glass") }, 0.1);
    }
    ball(Material::diffuse("red", Rgb::new(0.7, 0.1, 0.1)), 1.3);
    if area {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, z)| DVec3::new(x, 4.0, z));
        let radiance = Rgb::splat(8.0);
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
        let centre = DVec3::new(-3.0, 3.0, 2.0);
        world.lights.push(Light::Sphere(SphereLight {
            centre,
            radius: 0.4,
            radiance: Rgb::splat(9.0),
        }));
        world.lights.push(Light::Disk(DiskLight {
            centre: DVec3::new(2.5, 3.5, -1.0),
            normal: DVec3::NEG_Y,
            radius: 0.5,
            radiance: Rgb::splat(5.0),
            two_sided: false,
        }));
        world.lights.push(Light::Spot(SpotLight {
            position: DVec3::new(0.5, 3.0, 2.5),
            direction: DVec3::new(0.0, -1.0, -0.6).normalize(),
            intensity: Rgb::splat(6.0),
            cos_inner: 0.9,
            cos_outer: 0.8,
            radius: 0.1,
        }));
        let to_light = DVec3::new(-0.5, 0.8, 0.2).normalize();
        world.lights.push(Light::Sun(SunLight::of_irradiance(to_light, 0.05, Rgb::splat(0.3))));
    }
    world.lights.push(Light::Directional(DirectionalLight {
        to_light: DVec3::new(0.3, 1.0, 0.5).normalize(),
        irradiance: Rgb::splat(0.4),
    }));
    world.sky = Sky { radiance: Rgb::new(0.1, 0.15, 0.3), lights: sky, ambient: Rgb::ZERO };
    world
}

fn bumpy_floor(n: u32) -> WorldMesh {
    let mut positions = Vec::new();
    for z in 0..=n {
        for x in 0..=n {
            let (x, z) = (f64::from(x) / f64::from(n) - 0.5, f64::from(z) / f64::from(n) - 0.5);
            let y = 0.1 * (17.0 * x).sin() * (13.0 * z).cos();
            positions.push(DVec3::new(8.0 * x, y, 8.0 * z));
        }
    }
    let mut triangles = Vec::new();
    for z in 0..n {
        for x in 0..n {
            let k = z * (n + 1) + x;
            triangles.extend([[k, k + n + 1, k + 1], [k + 1, k + n + 1, k + n + 2]]);
        }
    }
    let share = |i: usize, period: usize| (i % period) as f32 / period as f32;
    let colours: Vec<_> =
        (0..positions.len()).map(|i| [share(i, 7), share(i, 11), share(i, 3)]).collect();
    let colours = Some(VertexColours::from_encoded(&colours));
    WorldMesh { colours, ..common::mesh(positions, triangles, 0) }
}

fn busy_job(width: u32, height: u32) -> Job {
    let world = busy_world([true, true, false, true, true]);
    let mut job = job(world, pose((0.5, 2.0, 5.0), (0.0, 0.5, 0.0)), width, height);
    job.settings.spp = 3;
    job.settings.filter = Filter::Gaussian;
    job.settings.shadow_samples = 5;
    job.settings.sky_samples = 3;
    job
}

/// The same job through a lens that blurs nearly everything.
fn through_lens(job: Job) -> Job {
    let lens = ThinLens { radius: 0.5, focus: 5.0, blades: 5, blade_rotation_degrees: 10.0 };
    Job { camera: job.camera.with_lens(Lens::Thin(lens)), ..job }
}

/// The same job with more samples where they differ.
fn adaptive(mut job: Job) -> Job {
    job.settings.most_spp = Some(10);
    job
}

/// The same job with pilots.
fn with_pilots(mut job: Job) -> Job {
    (job.settings.least_shadow_samples, job.settings.least_sky_samples) = (Some(2), Some(1));
    job
}

fn on_threads(job: &Job, threads: usize) -> Film {
    let scene = job.world.clone().into_scene(true).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let before = floating_point_mode();
    let intersector = pool.install(|| intersect::build(&scene, &job.settings, threads)).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    let stop = AtomicBool::new(false);
    let film = pool.install(|| renderer.render(&job.camera, 7, true, &stop, &())).unwrap().0;
    assert!(pool.broadcast(|_| floating_point_mode()).iter().all(|mode| *mode == before));
    film
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    // Not a multiple of the block or the tile.
    let busy = || busy_job(101, 77);
    let lens = || through_lens(busy());
    let busier = adaptive(with_pilots(busy()));
    for job in [busy(), lens(), adaptive(busy()), adaptive(lens()), with_pilots(busy()), busier] {
        let one = on_threads(&job, 1);
        for threads in [2, 3, 8] {
            assert!(one == on_threads(&job, threads), "{threads} threads differ");
        }
    }
}

#[test]
fn other_trees_see_the_same_and_a_compact_one_is_smaller() {
    let plain = on_threads(&busy_job(101, 77), 2);
    let memory = |job: &Job| {
        let scene = job.world.clone().into_scene(true).unwrap();
        intersect::build(&scene, &job.settings, 2).unwrap().memory()
    };
    for quality in [BuildQuality::Low, BuildQuality::Medium, BuildQuality::High] {
        for compact in [false, true] {
            let mut job = busy_job(101, 77);
            job.settings.build_quality = quality;
            job.settings.compact = compact;
            let one = on_threads(&job, 1);
            assert!(one == on_threads(&job, 3), "{quality:?} {compact}: 3 threads differ");
            let differing = one.rgb.iter().zip(&plain.rgb).filter(|(a, b)| a != b).count();
            // A ray that meets two triangles at their common edge may take either.
            assert!(differing <= 8, "{quality:?} {compact}: {differing} pixels");
        }
    }
    let mut job = busy_job(101, 77);
    let was = memory(&job);
    job.settings.compact = true;
    assert!(memory(&job) < was, "{} {was}", memory(&job));
}

#[test]
fn a_crop_has_the_bytes_of_the_whole() {
    check_crops(&busy_job(101, 77));
    check_crops(&through_lens(busy_job(101, 77)));
    check_crops(&adaptive(busy_job(101, 77)));
    check_crops(&adaptive(with_pilots(busy_job(101, 77))));
}

fn check_crops(job: &Job) {
    let whole = on_threads(job, 2);
    for (x0, y0, x1, y1) in [(3, 5, 60, 41), (8, 8, 16, 16), (95, 70, 101, 77), (50, 40, 51, 41)] {
        let mut job = job.clone();
        job.settings.crop = Some(Rect { x0, y0, x1, y1 });
        let part = on_threads(&job, 2);
        let (records, all) = (part.gbuffer.as_ref().unwrap(), whole.gbuffer.as_ref().unwrap());
        for (x, y, rgb) in common::pixels(&part) {
            let inside = x >= x0 && x < x1 && y >= y0 && y < y1;
            let i = part.index(x, y);
            assert_eq!(rgb, if inside { whole.rgb[i] } else { Rgb::ZERO }, "{x},{y}");
            assert!(!inside || records.depth[i] == all.depth[i]);
        }
    }
}

#[test]
fn each_specialised_kernel_equals_the_one_with_everything_on() {
    let mut kernels = std::collections::BTreeSet::new();
    for bits in 0..64u32 {
        let on = |bit: u32| bits >> bit & 1 == 1;
        let (mirror, glass, ranked, area, sky) = (on(0), on(1), on(1) && on(2), on(3), on(4));
        let world = busy_world([mirror, glass, ranked, area, sky]);
        let mut job = job(world, pose((0.5, 2.0, 5.0), (0.0, 0.5, 0.0)), 40, 30);
        job.settings.spp = 2;
        let scene = job.world.clone().into_scene(true).unwrap();
        let plan = EffectPlan::of(&scene, &job.settings);
        assert_eq!(
            [plan.mirror, plan.glass, plan.nested_glass, plan.area_lights, plan.sky_light],
            [mirror, glass, ranked, area, sky]
        );
        kernels.insert([mirror, glass, ranked]);
        if on(5) {
            job = through_lens(job);
        }
        let (film, counts) = render_scene(&scene, &job);
        let (full, full_counts) = render_with_every_effect(&scene, &job);
        assert!(film == full, "kernel {bits:06b} differs");
        assert_eq!(counts, full_counts, "kernel {bits:06b} casts other rays");
        let absent = [
            (mirror, counts[RayKind::Mirror]),
            (mirror, counts[RayKind::Glossy]),
            (glass, counts[RayKind::Glass]),
            (area, counts[RayKind::ShadowArea]),
            (sky, counts[RayKind::ShadowSky]),
        ];
        for (present, rays) in absent {
            assert_eq!(present, rays > 0, "kernel {bits:06b}: {counts:?}");
        }
    }
    assert_eq!(kernels.len(), 6, "all kernels");
}

#[test]
fn camera_samples_do_not_depend_on_the_frame_but_shading_does() {
    let job = busy_job(64, 48);
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    let stop = AtomicBool::new(false);
    let frame = |n| renderer.render(&job.camera, n, true, &stop, &()).unwrap().0;
    let (one, two) = (frame(1), frame(2));
    assert!(one.gbuffer == two.gbuffer && one.rgb != two.rgb);
}

#[test]
fn a_stopped_frame_is_no_frame() {
    let job = busy_job(64, 48);
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
    let renderer = Renderer::new(&scene, &job.settings, &*intersector);
    assert!(renderer.render(&job.camera, 1, true, &AtomicBool::new(true), &()).is_none());
}

#[test]
fn scaling_the_world_by_a_power_of_two_changes_no_byte() {
    let at = |k: i32| {
        let mut job = busy_job(40, 30);
        let s = 2f64.powi(k);
        let w = &mut job.world;
        w.meshes.iter_mut().flat_map(|m| &mut m.positions).for_each(|p| *p *= s);
        for sphere in &mut w.spheres {
            sphere.centre *= s;
            sphere.radius *= s;
        }
        for light in &mut w.lights {
            match light {
                Light::Quad(q) => q.corners.iter_mut().for_each(|c| *c *= s),
                Light::Sphere(SphereLight { centre, radius, .. }) => {
                    *centre *= s;
                    *radius *= s;
                }
                Light::Disk(disk) => {
                    disk.centre *= s;
                    disk.radius *= s;
                }
                Light::Spot(spot) => {
                    spot.position *= s;
                    spot.radius *= s;
                    spot.intensity *= (s * s) as f32;
                }
                Light::Point(point) => {
                    point.position *= s;
                    point.intensity *= (s * s) as f32;
                }
                Light::Directional(_) | Light::Sun(_) | Light::Face(_) => {}
            }
        }
        let glass = w.materials.iter_mut().filter_map(|m| m.glass.as_mut());
        glass.for_each(|g| g.absorption /= s as f32);
        job.camera.eye *= s;
        render(&job).0.rgb
    };
    let plain = at(0);
    for k in [-40, -7, 1, 40] {
        assert!(plain == at(k), "2^{k} differs");
    }
}
