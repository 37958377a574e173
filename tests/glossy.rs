//! Rough mirrors against what physics tells and against themselves, sampled in another way.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, mean, pose, render};
use tweenray::math::{DMat3, DVec3, Rgb};
use tweenray::scene::{
    Corners, DiskLight, Glass, IntersectorKind, Light, Material, PointLight, QuadLight, Sky,
    SphereLight, SpotLight, SunLight, Texture, TextureMap, World, WorldSphere,
};
use tweenray::stats::RayKind;

fn rough(reflectance: Rgb, roughness: f64) -> Material {
    Material { roughness, ..Material::mirror("rough", reflectance) }
}

/// A plate in the plane y = 0.
fn plate(material: Material) -> World {
    common::plate(material, 4.0)
}

/// A white rough ball in a furnace is white, at every roughness: what single reflection loses is given back.
#[test]
fn a_rough_mirror_in_a_furnace_is_one() {
    for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
        for tenth in 0..=10 {
            let mut world = World::default();
            world.materials.push(rough(Rgb::ONE, f64::from(tenth) / 10.0));
            world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
            world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
            let mut job = job(world, pose((0.0, 0.0, 1.9), (0.0, 0.0, 0.0)), 24, 18);
            job.settings.intersector = kind;
            job.settings.spp = 256;
            let (film, counts) = render(&job);
            let mean = mean(&film);
            assert!((mean - 1.0).abs() < 0.002, "{kind:?}, roughness {tenth}/10: {mean}");
            assert_eq!((film.bad.total(), counts[RayKind::Glossy] > 0), (0, tenth > 0));
        }
    }
}

/// A rough plate under a point light: f · I cos θ / d², with the microfacet formula written out anew.
#[test]
fn a_rough_plate_reflects_a_point_light_as_the_formula_says() {
    let (light, intensity, roughness) = (DVec3::new(0.6, 1.5, -0.4), 3.0, 0.4);
    for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
        let mut world = plate(rough(Rgb::new(0.0, 1.0, 0.0), roughness));
        let intensity = Rgb::splat(intensity);
        world.lights.push(Light::Point(PointLight { position: light, intensity }));
        let mut job = job(world, pose((-0.6, 2.0, 0.7), (0.0, 0.0, 0.0)), 24, 18);
        job.settings.intersector = kind;
        let (film, _) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            let wo = (job.camera.eye - p).normalize();
            let (wi, m) = ((light - p).normalize(), ((light - p).normalize() + wo).normalize());
            let a2 = roughness.powi(4);
            let d = a2 / (std::f64::consts::PI * (m.y * m.y * (a2 - 1.0) + 1.0).powi(2));
            let root = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
            let g_over_cosines = 2.0 / (wi.y * root(wo.y) + wo.y * root(wi.y));
            let arrives = 3.0 * wi.y / (light - p).length_squared();
            let single = d * g_over_cosines / 4.0 * arrives;
            // What is given back is a few parts in a hundred at this roughness.
            let share = f64::from(rgb.y) / single;
            assert!((1.0..1.06).contains(&share), "{kind:?} {x},{y}: {rgb} for {single}");
            assert_eq!((rgb.x, rgb.z), (0.0, 0.0));
        }
    }
}

/// Light samples joined with the lobe's rays and the lobe's rays alone see the same light, of every kind that
/// rays can meet, at every roughness.
#[test]
fn light_samples_and_lobe_samples_agree() {
    let radiance = Rgb::splat(5.0);
    let corners = [(-0.4, -0.2), (0.5, -0.3), (0.4, 0.4), (-0.3, 0.2)];
    let corners = corners.map(|(x, z)| DVec3::new(x, 1.2, z));
    let (centre, normal) = (DVec3::new(0.1, 1.2, 0.0), DVec3::new(0.3, -1.0, 0.1).normalize());
    // Where the plate's middle mirrors the eye.
    let to_light = DVec3::new(0.8, 0.9, -0.9).normalize();
    let lights = [
        Light::Quad(QuadLight { corners, radiance, two_sided: true }),
        Light::Disk(DiskLight { centre, normal, radius: 0.4, radiance, two_sided: false }),
        Light::Sphere(SphereLight { centre, radius: 0.3, radiance }),
        Light::Sun(SunLight { to_light, angular_radius: 0.25, radiance }),
    ];
    for light in lights {
        for roughness in [0.15, 0.4, 0.8] {
            let mut world = plate(rough(Rgb::splat(0.9), roughness));
            let occluder = world.add_material(Material::black("occluder"));
            world.spheres.push(WorldSphere::new("o", DVec3::new(0.4, 0.5, 0.1), 0.2, occluder));
            world.lights.push(light.clone());
            let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 16, 12);
            job.settings.spp = 1024;
            job.settings.shadow_samples = 2;
            let (joined, counts) = render(&job);
            assert!(counts[RayKind::ShadowArea] > 0);
            job.settings.shadow_samples = 0;
            let (alone, counts) = render(&job);
            assert_eq!(counts[RayKind::ShadowArea], 0);
            let (joined, alone) = (mean(&joined), mean(&alone));
            let off = (joined / alone - 1.0).abs();
            assert!(off < 0.01, "{} at {roughness}: {joined} and {alone}", light.name());
        }
    }
}

/// A light that shines on the whole plate of the next tests.
fn lamp() -> Light {
    Light::Sphere(SphereLight {
        centre: DVec3::new(0.1, 1.2, 0.0),
        radius: 0.3,
        radiance: Rgb::splat(5.0),
    })
}

/// A plate that is tilted against the axes.
fn tilted(material: Material) -> World {
    let mut world = plate(material);
    let turn = DMat3::from_rotation_x(0.13) * DMat3::from_rotation_z(-0.21);
    world.meshes[0].positions.iter_mut().for_each(|p| *p = turn * *p);
    world
}

/// However many light samples there are, where interpolated normals send rays below coarse facets.
#[test]
fn light_samples_change_nothing_at_smooth_normals() {
    let mut world = World::default();
    world.materials.push(rough(Rgb::splat(0.9), 0.5));
    let mut ball = common::uv_sphere(10, 6);
    let values = ball.positions.iter().map(|p| p.as_vec3().normalize()).collect();
    ball.normals = Some(Corners { values, corners: None });
    world.meshes.push(ball);
    let corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)];
    let corners = corners.map(|(y, z)| DVec3::new(-2.5, y, z));
    world.lights.push(Light::Quad(QuadLight { corners, radiance: Rgb::ONE, two_sided: true }));
    let mut job = job(world, pose((0.0, 0.4, 3.4), (0.0, 0.0, 0.0)), 24, 18);
    job.settings.spp = 1024;
    let [none, few, many] = [0, 2, 8].map(|samples| {
        job.settings.shadow_samples = samples;
        mean(&render(&job).0)
    });
    assert!(
        (few / none - 1.0).abs() < 0.01 && (many / none - 1.0).abs() < 0.01,
        "{none} {few} {many}"
    );
}

/// Light samples do not reach through glass, whose shadows are opaque: what rays see there counts whole.
#[test]
fn a_lamp_beyond_a_boundary_that_rays_pass_is_seen_whole() {
    let mut world = World::default();
    world.materials.push(rough(Rgb::splat(0.9), 0.4));
    world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 0.4, 0));
    let mut body = |priority: u8, radius: f64| {
        let glass = Glass { priority: Some(priority), ..Glass::clear(1.2) };
        let material = Material { glass: Some(glass), ..Material::black("glass") };
        let material = world.add_material(material);
        world.spheres.push(WorldSphere::new("body", DVec3::ZERO, radius, material));
    };
    body(2, 3.0);
    // Within the other: no boundary is there, but its surface is met.
    body(1, 0.55);
    let centre = DVec3::new(-0.8, 1.2, 0.5);
    let radiance = Rgb::splat(5.0);
    world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.4, radiance }));
    let mut job = job(world, pose((0.0, 0.0, 6.0), (0.0, 0.0, 0.0)), 24, 18);
    (job.settings.spp, job.settings.bounces) = (256, 8);
    let [none, some] = [0, 4].map(|samples| {
        job.settings.shadow_samples = samples;
        mean(&render(&job).0)
    });
    assert!(none > 0.01 && (some / none - 1.0).abs() < 0.02, "{none} {some}");
}

#[test]
fn a_lamp_seen_in_its_own_plane_makes_no_invalid_sample() {
    let mut world = plate(rough(Rgb::splat(0.9), 0.3));
    let turn = DMat3::from_rotation_x(0.4);
    world.meshes[0].positions.iter_mut().for_each(|p| *p = turn * *p);
    let corners = [(1.0, -0.5), (1.0, 0.5), (2.0, 0.5), (2.0, -0.5)];
    let corners = corners.map(|(y, z)| DVec3::new(0.0, y, z));
    world.lights.push(Light::Quad(QuadLight { corners, radiance: Rgb::ONE, two_sided: true }));
    let mut job = job(world, pose((0.0, 3.0, 4.0), (0.0, 0.0, 0.0)), 65, 37);
    job.settings.shadow_samples = 4;
    assert_eq!(render(&job).0.bad.total(), 0);
}

#[test]
fn the_smoothest_rough_mirrors_are_mirrors() {
    let [perfect, rest @ ..] = [0.0, 1e-12, 1e-9, 1e-7, 1e-4, 5e-3].map(|roughness| {
        let mut world = tilted(rough(Rgb::splat(0.9), roughness));
        world.lights.push(lamp());
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 48, 36);
        (job.settings.spp, job.settings.shadow_samples) = (64, 4);
        let (film, _) = render(&job);
        assert_eq!(film.bad.total(), 0);
        mean(&film)
    });
    assert!(rest.iter().all(|m| (m / perfect - 1.0).abs() < 0.01), "{perfect} {rest:?}");
}

/// A spot light with a small radius lights like one without, at the edge of its cone, too.
#[test]
fn a_small_spot_light_is_a_spot_light_without_a_radius() {
    let [small, point] = [0.01, 0.0].map(|radius| {
        let mut world = plate(rough(Rgb::splat(0.9), 0.5));
        let (position, direction) = (DVec3::new(0.1, 1.2, 0.0), DVec3::NEG_Y);
        let (intensity, cos_inner, cos_outer) = (Rgb::splat(2.0), 0.97, 0.8);
        let spot = SpotLight { position, direction, intensity, cos_inner, cos_outer, radius };
        world.lights.push(Light::Spot(spot));
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.3, 0.0, -0.2)), 16, 12);
        job.settings.spp = 64;
        render(&job).0
    });
    let edge = point.rgb.iter().filter(|c| c.y == 0.0).count();
    assert!(edge > 10 && edge < point.rgb.len() - 10, "{edge} pixels out of the cone");
    let (small, point) = (mean(&small), mean(&point));
    assert!((small / point - 1.0).abs() < 0.01, "{small} {point}");
}

/// On its axis a spot light with a radius lights like a sphere light of the same radius.
#[test]
fn a_spot_with_a_radius_is_a_sphere_within_its_cone() {
    let (position, radius, intensity) = (DVec3::new(0.1, 1.2, 0.0), 0.3, Rgb::splat(2.0));
    let area = (std::f64::consts::PI * radius * radius) as f32;
    let direction = DVec3::NEG_Y;
    let spot =
        SpotLight { position, direction, intensity, cos_inner: -0.9, cos_outer: -1.0, radius };
    let sphere = SphereLight { centre: position, radius, radiance: intensity / area };
    let [spot, sphere] = [Light::Spot(spot), Light::Sphere(sphere)].map(|light| {
        let mut world = plate(rough(Rgb::splat(0.9), 0.5));
        world.lights.push(light);
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.3, 0.0, -0.2)), 16, 12);
        (job.settings.spp, job.settings.shadow_samples) = (64, 16);
        mean(&render(&job).0)
    });
    assert!((spot / sphere - 1.0).abs() < 0.01, "{spot} {sphere}");
}

/// A plate whose roughness lies in an image of `texels`, once over it.
fn mapped_plate(image: Texture) -> World {
    let map = Some(TextureMap::of(0));
    let material = Material { roughness_map: map, ..rough(Rgb::splat(0.9), 1.0) };
    common::imaged_plate(material, 4.0, image)
}

/// An image that is the same all over gives the picture of the number, at 8 and at 16 bits; one with two halves gives each half's
/// away from the border.
#[test]
fn a_roughness_map_is_the_roughness_that_it_holds() {
    // Pixels with the place that their middles show.
    let seen = |mut world: World, kind: IntersectorKind| {
        world.lights.push(lamp());
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 32, 24);
        (job.settings.spp, job.settings.shadow_samples) = (4, 4);
        job.settings.intersector = kind;
        let film = render(&job).0;
        let place = |x, y| common::on_plane_y(&job, x, y, 0.0).x;
        common::pixels(&film).map(|(x, y, rgb)| (place(x, y), rgb.x)).collect::<Vec<_>>()
    };
    // Interpolation between equal texels rounds.
    let is_near = |a: f32, b: f32| (a - b).abs() < 1e-4 * b + 1e-6;
    for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
        let number = |code: u8| {
            let roughness = f64::from(f32::from(code) / 255.0);
            seen(plate(rough(Rgb::splat(0.9), roughness)), kind)
        };
        let row = |texels: Vec<u8>| Texture::from_data8("t", [texels.len() as u32, 1], texels);
        let sixteen = Texture::from_data16("t", [2, 2], vec![102 * 257; 4]);
        for image in [row(vec![102; 7]), sixteen] {
            let found = seen(mapped_plate(image), kind);
            assert!(found.iter().zip(number(102)).all(|(a, b)| is_near(a.1, b.1)), "{kind:?}");
        }
        // 40 texels of each roughness; the border is at x = 0.
        let halves = seen(mapped_plate(row([vec![51; 40], vec![204; 40]].concat())), kind);
        let (left, right) = (number(51), number(204));
        let mut count = [0; 2];
        for ((x, found), (left, right)) in halves.into_iter().zip(left.into_iter().zip(right)) {
            if (0.3..3.5).contains(&x.abs()) {
                let expected = if x < 0.0 { left.1 } else { right.1 };
                assert!(is_near(found, expected), "{kind:?} at {x}: {found} {expected}");
                count[usize::from(x > 0.0)] += 1;
            }
        }
        assert!(count[0] > 100 && count[1] > 50, "{count:?}");
    }
}

/// From perfect to matte side by side, a furnace shows nothing.
#[test]
fn a_roughness_map_in_a_furnace_is_one() {
    let texels = (0..=255u8).collect();
    let mut world = mapped_plate(Texture::from_data8("t", [16, 16], texels));
    world.materials[0].mirror = Rgb::ONE;
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 32, 24);
    job.settings.spp = 256;
    let film = render(&job).0;
    assert!((mean(&film) - 1.0).abs() < 0.002, "{}", mean(&film));
    assert_eq!(film.bad.total(), 0);
}

/// Far away a pixel covers many texels, and has their mean roughness.
#[test]
fn a_roughness_map_is_filtered_by_what_a_ray_covers() {
    let checker = (0..256 * 256).map(|i| if (i % 256 + i / 256) % 2 == 0 { 51 } else { 153 });
    let image = Texture::from_data8("t", [256, 256], checker.collect());
    let film = |mut world: World| {
        world.lights.push(lamp());
        let mut job = job(world, pose((-6.0, 12.0, 6.0), (0.0, 0.0, 0.0)), 16, 12);
        (job.settings.spp, job.settings.shadow_samples) = (64, 16);
        mean(&render(&job).0)
    };
    let mapped = film(mapped_plate(image));
    let number = film(plate(rough(Rgb::splat(0.9), 0.4)));
    assert!((mapped / number - 1.0).abs() < 1e-3, "{mapped} {number}");
}
