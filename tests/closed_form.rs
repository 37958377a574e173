//! Pictures whose every pixel physics tells in closed form.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, pose, quad, render, sphere_world};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    Camera, DiskLight, Glass, IntersectorKind, Lens, Light, Material, PointLight, QuadLight, Sky,
    SpotLight, ThinLens, World, WorldSphere,
};
use tweenray::stats::RayKind;

const BOTH: [IntersectorKind; 2] = [IntersectorKind::Embree, IntersectorKind::Oracle];

fn floor(albedo: f32) -> World {
    let mut world = World::default();
    world.materials.push(Material::diffuse("floor", Rgb::splat(albedo)));
    let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
    world.meshes.push(quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0));
    world
}

/// A floor lit by a point light: radiance is albedo/π · I·cosθ/d² at each pixel's point.
#[test]
fn lambert_floor_under_a_point_light() {
    let light = DVec3::new(0.3, 1.5, -0.2);
    for kind in BOTH {
        let mut world = floor(0.6);
        world.lights.push(Light::Point(PointLight { position: light, intensity: Rgb::splat(7.0) }));
        let camera = pose((0.1, 2.0, 0.7), (0.0, 0.0, 0.0));
        let mut job = job(world, camera, 24, 18);
        job.settings.intersector = kind;
        let (film, counts) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            let to_light = light - p;
            let cos = to_light.normalize().y;
            let expected = 0.6 / std::f64::consts::PI * 7.0 * cos / to_light.length_squared();
            assert!((f64::from(rgb.x) - expected).abs() < 2e-6 * expected, "{kind:?} {x},{y}");
        }
        assert_eq!(counts[RayKind::ShadowDelta], 24 * 18);
    }
}

/// The same under a rectangle light that nothing hides: Lambert's formula, with no noise.
#[test]
fn lambert_floor_under_a_rectangle_light() {
    for kind in BOTH {
        let mut world = floor(0.5);
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let corners = corners.map(|(x, z)| DVec3::new(x, 1.0, z));
        let light = QuadLight { corners, radiance: Rgb::splat(3.0), two_sided: false };
        assert!(light.normal().y < -0.99, "the test's light faces the floor");
        world.lights.push(Light::Quad(light));
        let mut job = job(world, pose((0.0, 0.9, 2.0), (0.0, 0.0, 0.6)), 16, 12);
        job.settings.intersector = kind;
        job.settings.shadow_samples = 4;
        let (film, _) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let irradiance = 3.0 * unit_square_irradiance(common::on_plane_y(&job, x, y, 0.0));
            let expected = 0.5 / std::f64::consts::PI * irradiance;
            let error = (f64::from(rgb.x) - expected).abs();
            assert!(error < 1e-5 * expected, "{kind:?} {x},{y}: {} for {expected}", rgb.x);
        }
    }
}

/// Under a disk: on its axis the irradiance is πL sin²θ, θ being the angle to its rim.
#[test]
fn lambert_floor_under_a_disk_light() {
    for kind in BOTH {
        let mut world = floor(0.5);
        let (height, radius) = (1.5, 0.8);
        world.lights.push(Light::Disk(DiskLight {
            centre: DVec3::Y * height,
            normal: DVec3::NEG_Y,
            radius,
            radiance: Rgb::splat(3.0),
            two_sided: false,
        }));
        // Straight down past the rim at the floor's middle; the disk hides nothing of what is looked at.
        let mut job = job(world, pose((0.9, 0.4, 0.0), (0.0, 0.0, 0.0)), 9, 9);
        job.settings.intersector = kind;
        job.settings.shadow_samples = 4;
        let (film, _) = render(&job);
        let middle = f64::from(film.rgb[40].x);
        assert!(common::on_plane_y(&job, 4, 4, 0.0).length() < 1e-9, "the axis' foot");
        let expected = 0.5 * 3.0 * radius * radius / (radius * radius + height * height);
        assert!((middle - expected).abs() < 1e-6 * expected, "{kind:?}: {middle} for {expected}");
        // What is far away sees a small source: intensity times both cosines over the distance squared.
        let far = pose((8.0, 0.4, 0.0), (8.6, 0.0, 0.0));
        job.camera = Camera::new(&far, 40.0, 9, 9).unwrap();
        let (film, _) = render(&job);
        let p = common::on_plane_y(&job, 4, 4, 0.0);
        let d2 = (p - DVec3::Y * height).length_squared();
        let cos2 = height * height / d2;
        let about = 0.5 * 3.0 * radius * radius * cos2 / d2;
        let got = f64::from(film.rgb[40].x);
        assert!((got - about).abs() < 0.02 * about, "{kind:?}: {got} for about {about}");
    }
}

/// Under a spot: full within the inner angle, none beyond the outer one, cubic in the cosine between, with hard
/// shadows and, from afar, with soft ones.
#[test]
fn lambert_floor_under_a_spot_light() {
    let at = DVec3::new(0.0, 4.0, 0.0);
    let [inner, outer] = [10.0f64, 25.0].map(|angle| angle.to_radians().cos());
    for (kind, radius, tolerance) in
        [(BOTH[0], 0.0, 2e-6), (BOTH[1], 0.0, 2e-6), (BOTH[0], 0.02, 1e-4), (BOTH[1], 0.02, 1e-4)]
    {
        let mut world = floor(0.6);
        world.lights.push(Light::Spot(SpotLight {
            position: at,
            direction: DVec3::NEG_Y,
            intensity: Rgb::splat(7.0),
            cos_inner: inner,
            cos_outer: outer,
            radius,
        }));
        let mut job = job(world, pose((0.1, 3.0, 1.2), (0.0, 0.0, 0.0)), 24, 18);
        job.settings.intersector = kind;
        job.settings.shadow_samples = 4;
        let (film, counts) = render(&job);
        let (mut full, mut none) = (0, 0);
        for (x, y, rgb) in common::pixels(&film) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            let to_light = at - p;
            let cos = to_light.normalize().y;
            let t = ((cos - outer) / (inner - outer)).clamp(0.0, 1.0);
            let falloff = t * t * (3.0 - 2.0 * t);
            (full, none) = (full + i32::from(t == 1.0), none + i32::from(t == 0.0));
            let expected =
                falloff * 0.6 / std::f64::consts::PI * 7.0 * cos / to_light.length_squared();
            let error = (f64::from(rgb.x) - expected).abs();
            assert!(
                error <= tolerance * expected,
                "{kind:?} {radius} {x},{y}: {} {expected}",
                rgb.x
            );
        }
        assert!(full > 10 && none > 10, "{full} {none}");
        let shadow = if radius > 0.0 { RayKind::ShadowArea } else { RayKind::ShadowDelta };
        let kinds = [RayKind::ShadowArea, RayKind::ShadowDelta, RayKind::ShadowSky];
        let cast: u64 = kinds.map(|kind| counts[kind]).iter().sum();
        assert!(counts[shadow] > 0 && cast == counts[shadow]);
    }
}

/// Irradiance per unit radiance at `p` on the plane y = 0 from the unit square over the origin at
/// y = 1: the midpoint rule over the square.
fn unit_square_irradiance(p: DVec3) -> f64 {
    let n = 400;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n) - 0.5;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let d2 = (DVec3::new(at(i), 1.0, at(j)) - p).length_squared();
            sum += 1.0 / (d2 * d2);
        }
    }
    sum / f64::from(n * n)
}

/// A mirror that faces an emitter shows its radiance times the reflectance.
#[test]
fn a_mirror_shows_a_known_emitter() {
    for kind in BOTH {
        let mut world = World::default();
        world.materials.push(Material { mirror: Rgb::new(0.9, 0.5, 0.25), ..Material::black("m") });
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        world.meshes.push(quad(corners.map(|(x, y)| DVec3::new(x, y, 0.0)), 0));
        // The emitter fills everything behind the camera, and faces the mirror.
        let far = [(-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0)];
        let corners = far.map(|(x, y)| DVec3::new(x, y, 10.0));
        let radiance = Rgb::new(2.0, 4.0, 8.0);
        world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: false }));
        let mut job = job(world, pose((0.0, 0.0, 2.0), (0.0, 0.0, 0.0)), 16, 12);
        job.settings.intersector = kind;
        let (film, counts) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            assert!(rgb.abs_diff_eq(Rgb::new(1.8, 2.0, 2.0), 1e-6), "{kind:?} {x},{y}: {rgb}");
        }
        assert_eq!((counts[RayKind::Mirror], counts[RayKind::ShadowArea]), (16 * 12, 0));
    }
}

/// A convex white body under a uniform unit sky has radiance 1 everywhere.
#[test]
fn a_white_sphere_in_a_furnace_is_one() {
    for kind in BOTH {
        for tessellated in [false, true] {
            if tessellated && kind == IntersectorKind::Oracle {
                continue;
            }
            let mut world = sphere_world(Material::diffuse("white", Rgb::ONE), tessellated);
            world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
            let mut job = job(world, pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0)), 48, 36);
            job.settings.intersector = kind;
            job.settings.spp = 4;
            let (film, counts) = render(&job);
            for (x, y, rgb) in common::pixels(&film) {
                assert!(rgb.abs_diff_eq(Rgb::ONE, 0.002), "{kind:?} {x},{y}: {rgb}");
            }
            assert!(counts[RayKind::ShadowSky] > 0);
        }
    }
}

/// Clear glass in a furnace hides itself: reflected and refracted shares add up.
#[test]
fn a_glass_sphere_in_a_furnace_vanishes() {
    let glass = Glass::clear(1.5);
    let mut world = sphere_world(Material { glass: Some(glass), ..Material::black("g") }, false);
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    let mut job = job(world, pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0)), 48, 36);
    job.settings.bounces = 30;
    job.settings.cutoff = 1e-6;
    let (film, _) = render(&job);
    for (x, y, rgb) in common::pixels(&film) {
        assert!(rgb.abs_diff_eq(Rgb::ONE, 1e-4), "{x},{y}: {rgb}");
    }
}

/// A thin pane before a bright wall, in front of a bright sky: it reflects by both of its faces, and lets the rest
/// straight through with its tint. A plate with two faces, as thin as can be, looks the same.
#[test]
fn a_thin_pane_looks_as_a_plate_of_the_same_glass() {
    let (sky, wall) = (Rgb::new(0.5, 1.0, 2.0), Rgb::new(3.0, 2.0, 1.0));
    let tint = Rgb::new(1.0, 0.81, 0.64);
    let picture = |kind, thin: bool, priority: Option<u8>| {
        let mut world = World { sky: Sky { radiance: sky, ..Sky::default() }, ..World::default() };
        let of_crossing = if thin { tint } else { Rgb::new(1.0, 0.9, 0.8) };
        let glass = Glass { thin, tint: of_crossing, ..Glass::clear(1.5) };
        let pane = world.add_material(Material { glass: Some(glass), ..Material::black("pane") });
        let face = |z: f64, half: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| DVec3::new(half * x, half * y, z))
        };
        world.meshes.push(quad(face(0.0, 40.0), pane));
        if !thin {
            let [a, b, c, d] = face(-1e-3, 40.0);
            world.meshes.push(quad([d, c, b, a], pane));
        }
        let emitter = Material { emission: wall, emits_back: true, ..Material::black("wall") };
        let emitter = world.add_material(emitter);
        world.meshes.push(quad(face(-3.0, 400.0), emitter));
        if let Some(priority) = priority {
            // Elsewhere, so that paths carry a stack of bodies.
            let ranked = Glass { priority: Some(priority), ..Glass::clear(1.3) };
            let ranked = Material { glass: Some(ranked), ..Material::black("ranked") };
            let ranked = world.add_material(ranked);
            world.spheres.push(WorldSphere::new("far", DVec3::new(0.0, 0.0, 90.0), 1.0, ranked));
        }
        let mut job = job(world, pose((2.0, 1.0, 2.0), (0.0, 0.0, 0.0)), 24, 18);
        (job.settings.intersector, job.settings.bounces, job.settings.cutoff) = (kind, 40, 1e-7);
        let (film, _) = render(&job);
        let eye = DVec3::new(2.0, 1.0, 2.0);
        common::pixels(&film)
            .map(|(x, y, rgb)| {
                let dir = job.camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).normalize();
                assert!((eye + dir * (eye.z / -dir.z)).abs().max_element() < 40.0, "{x},{y}");
                (-dir.z, rgb)
            })
            .collect::<Vec<(f64, Rgb)>>()
    };
    for kind in BOTH {
        let plate = picture(kind, false, None);
        for priority in [None, Some(1)] {
            let seen = picture(kind, true, priority);
            for ((cos, rgb), (_, of_plate)) in seen.iter().zip(&plate) {
                let cos_t = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
                let parallel = (1.5 * cos - cos_t) / (1.5 * cos + cos_t);
                let perpendicular = (cos - 1.5 * cos_t) / (cos + 1.5 * cos_t);
                let r = 0.5 * (parallel * parallel + perpendicular * perpendicular);
                let reflected = (2.0 * r / (1.0 + r)) as f32;
                let expected = sky * reflected + wall * tint * (1.0 - reflected);
                assert!(rgb.abs_diff_eq(expected, 1e-5), "{kind:?} {cos}: {rgb} {expected}");
                // Red alone: what goes to and fro in a coloured plate is tinted each time.
                assert!((rgb.x - of_plate.x).abs() < 1e-5, "{kind:?} {cos}: {rgb} {of_plate}");
            }
        }
    }
}

/// A ball of coloured glass that does not bend light, before a bright sky: what is left after a chord `x` is
/// exp(-absorption x), in world units, whatever the scene is scaled by.
#[test]
fn coloured_glass_absorbs_along_the_way() {
    let absorption = Rgb::new(0.0, 0.4, 1.7);
    for kind in BOTH {
        for priority in [None, Some(1)] {
            for radius in [1.0, 50.0] {
                let (centre, eye) =
                    (DVec3::new(2.0, 1.0, -1.0), DVec3::new(2.0, 1.0, 3.0 * radius));
                let mut world = World::default();
                let absorption = absorption / radius as f32;
                let glass = Glass { absorption, priority, ..Glass::clear(1.0) };
                let tea = Material { glass: Some(glass), ..Material::black("tea") };
                let tea = world.add_material(tea);
                world.spheres.push(WorldSphere::new("ball", centre, radius, tea));
                world.sky.radiance = Rgb::splat(2.0);
                let mut job = job(world, pose(eye.into(), centre.into()), 24, 18);
                job.settings.intersector = kind;
                let (film, _) = render(&job);
                let mut met = 0;
                for (x, y, rgb) in common::pixels(&film) {
                    let dir = job.camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let off = (centre - eye).cross(dir).length();
                    let half = (radius * radius - off * off).max(0.0).sqrt();
                    met += u32::from(half > 0.0);
                    let left = absorption.to_array().map(|a| (-f64::from(a) * 2.0 * half).exp());
                    let expected = Rgb::from_array(left.map(|l| 2.0 * l as f32));
                    assert!(rgb.abs_diff_eq(expected, 1e-5), "{kind:?} {x},{y}: {rgb} {expected}");
                }
                assert!(met > 100, "{met} pixels of the ball");
            }
        }
    }
}

/// A bright lamp before a dark sky: a pixel's colour is the lamp's times the share of its samples that see
/// it, clamped or not, and the share is the same.
#[test]
fn a_clamped_sample_contributes_the_clamp() {
    let (radiance, exposure, clamp) = (Rgb::new(40.0, 20.0, 0.25), 0.5, 1.5);
    let corners = [(-1.0, -0.7), (0.9, -0.8), (1.0, 0.8), (-0.8, 0.9)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
    let mut world = World::default();
    world.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
    let mut job = job(world, pose((0.1, 0.2, 5.0), (0.0, 0.0, 0.0)), 48, 36);
    // More than a chunk of samples holds of a block.
    (job.settings.spp, job.settings.exposure) = (16, exposure);
    let plain = render(&job).0;
    job.settings.clamp = Some(clamp);
    let clamped = render(&job).0;
    let shown = (radiance * exposure).min(Rgb::splat(clamp)) / exposure;
    let mut edges = 0;
    for ((x, y, a), b) in common::pixels(&plain).zip(&clamped.rgb) {
        let share = a.x / radiance.x;
        edges += u32::from(share > 0.0 && share < 1.0);
        assert!((share * 16.0 - (share * 16.0).round()).abs() < 1e-4, "{x},{y}: {a}");
        assert!(b.abs_diff_eq(shown * share, 1e-5), "{x},{y}: {b}, share {share}");
    }
    assert!(edges > 50, "{edges} pixels at the lamp's edge");
}

/// What counts is the whole of a sample, not each light's part of it; and an invalid sample
/// stays what it is.
#[test]
fn the_clamp_applies_to_a_samples_sum() {
    let mut world = sphere_world(
        Material { mirror: Rgb::splat(0.5), ..Material::diffuse("satin", Rgb::splat(0.5)) },
        false,
    );
    world.sky = Sky { radiance: Rgb::splat(1.6), lights: false, ambient: Rgb::splat(0.8) };
    let mut job = job(world, pose((0.0, 0.0, 1.5), (0.0, 0.0, 0.0)), 16, 12);
    let middle = |job: &common::Job| render(job).0.rgb[6 * 16 + 8];
    assert!(middle(&job).abs_diff_eq(Rgb::splat(1.2), 1e-5), "{}", middle(&job));
    job.settings.clamp = Some(1.0);
    assert_eq!(middle(&job), Rgb::ONE);
    job.world.sky.radiance.y = f32::NAN;
    let film = render(&job).0;
    assert!(film.rgb[6 * 16 + 8].y.is_nan() && film.bad.total() > 0);
}

#[test]
fn an_empty_scene_is_sky() {
    for kind in BOTH {
        let sky = Sky { radiance: Rgb::new(0.1, 0.2, 0.3), ..Sky::default() };
        let world = World { sky, ..World::default() };
        let mut job = job(world, pose((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), 16, 12);
        job.settings.intersector = kind;
        let (film, counts) = render(&job);
        assert!(film.rgb.iter().all(|c| *c == sky.radiance));
        assert_eq!(counts.total(), 16 * 12);
    }
}

/// A camera inside a closed box with a light inside too: no ray gets out, whatever it aims at.
#[test]
fn from_inside_a_box_no_sky_is_seen() {
    for kind in BOTH {
        let mut world = World::default();
        world.materials.push(Material::diffuse("wall", Rgb::splat(0.5)));
        world.meshes.push(common::cube(DVec3::ZERO, 1.0, 0));
        world.sky = Sky { radiance: Rgb::splat(1000.0), ..Sky::default() };
        let position = DVec3::new(0.0, 0.5, 0.0);
        world.lights.push(Light::Point(PointLight { position, intensity: Rgb::ONE }));
        for target in [(1.0, 1.0, 1.0), (-1.0, 0.0, 0.2), (0.0, -1.0, 0.0), (1.0, 0.0, 1.0)] {
            let mut job = job(world.clone(), pose((0.1, 0.0, -0.1), target), 32, 24);
            job.settings.intersector = kind;
            let (film, _) = render(&job);
            for (x, y, rgb) in common::pixels(&film) {
                let lit = rgb.min_element() > 0.0 && rgb.max_element() < 10.0;
                assert!(lit, "{kind:?} towards {target:?}: {x},{y} is {rgb}");
            }
        }
    }
}

/// A thin lens spreads a point out of focus evenly over a disk of the aperture's radius times |1/focus − 1/depth|,
/// or over its polygon: size, evenness and the light of all of it together.
#[test]
fn a_point_out_of_focus_is_a_disk_of_the_size_of_the_circle_of_confusion() {
    let (depth, ball, size, radius, spp) = (6.0, 0.1, 97, 1.2, 256);
    for kind in BOTH {
        // In front of the focus, behind it, and from blades.
        for (focus, blades) in [(12.0, 0), (4.0, 0), (4.0, 6)] {
            let mut world = World::default();
            world.materials.push(Material { emission: Rgb::ONE, ..Material::black("ball") });
            world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, ball, 0));
            let mut job = job(world, pose((0.0, 0.0, depth), (0.0, 0.0, 0.0)), size, size);
            let blade_rotation_degrees = 0.0;
            let lens = ThinLens { radius, focus, blades, blade_rotation_degrees };
            job.camera = job.camera.with_lens(Lens::Thin(lens));
            (job.settings.intersector, job.settings.spp) = (kind, spp);
            let (film, _) = render(&job);
            let pixel = job.camera.pixel_size();
            let blur = radius * (1.0 / focus - 1.0 / depth).abs() / pixel;
            assert!(blur > 10.0 && blur < 45.0, "the test's disk is {blur} pixels");
            let middle = f64::from(size) / 2.0;
            let off = |x: u32, y: u32| {
                let place = |x: u32| f64::from(x) + 0.5 - middle;
                (place(x), place(y))
            };
            let (mut all, mut second, mut beyond) = (0.0, 0.0, 0.0f64);
            for (x, y, rgb) in common::pixels(&film) {
                let (x, y) = off(x, y);
                let light = f64::from(rgb.x);
                all += light;
                second += light * (x * x + y * y);
                // The ball's own image, and the pixel filter.
                if x.hypot(y) > blur + 1.0 + ball / (depth * pixel) + 1.5 {
                    beyond = beyond.max(light);
                }
            }
            // As many pixels' light as the sharp ball covers, to second order in its size.
            let sharp = std::f64::consts::PI * (ball / (depth * pixel)).powi(2);
            assert!((all / sharp - 1.0).abs() < 0.03, "{kind:?} {focus}: {all} for {sharp}");
            // Mean square distance of a uniform disk, or regular polygon, of circumradius 1.
            let of_one = match blades {
                0 => 0.5,
                n => {
                    let half = std::f64::consts::PI / f64::from(n);
                    (2.0 + (2.0 * half).cos()) / 6.0
                }
            };
            let spread = second / all;
            // The ball's own image and the filter blur a little more.
            let own = 0.5 * (ball / (depth * pixel)).powi(2) + 0.5;
            let expected = of_one * blur * blur;
            assert!(
                (spread - expected).abs() < 0.02 * expected + own,
                "{kind:?} {focus} {blades}: {spread} for {expected}"
            );
            assert_eq!(beyond, 0.0, "{kind:?} {focus}: light beyond the disk");
        }
    }
}

/// What is at the focus is as sharp as through a pinhole, whatever the lens.
#[test]
fn points_in_focus_are_as_through_a_pinhole() {
    let mut world = floor(0.6);
    world.materials[0].diffuse = Rgb::ZERO;
    world.materials[0].emission = Rgb::ONE;
    let mut job = job(world, pose((0.0, 0.0, 5.0), (0.0, 0.0, 0.0)), 32, 32);
    // The floor's far edge is 9 behind the middle.
    job.camera = Camera::new(&pose((0.0, 5.0, 5.0), (0.0, 0.0, -9.0)), 20.0, 32, 32).unwrap();
    job.settings.spp = 64;
    let (pinhole, _) = render(&job);
    let focus = DVec3::new(0.0, -5.0, -14.0).length();
    let lens = |focus| ThinLens { radius: 0.4, focus, blades: 0, blade_rotation_degrees: 0.0 };
    let pinhole_camera = job.camera;
    let mut worst = |focus| {
        job.camera = pinhole_camera.with_lens(Lens::Thin(lens(focus)));
        let (film, _) = render(&job);
        let pairs = film.rgb.iter().zip(&pinhole.rgb);
        pairs.map(|(a, b)| (a.x - b.x).abs()).fold(0.0, f32::max)
    };
    let (sharp, blurred) = (worst(focus), worst(0.5 * focus));
    assert!(sharp < 0.06 && blurred > 0.2, "off by {sharp} in focus, by {blurred} out of it");
}
