//! Rough mirrors against what physics tells and against themselves, sampled in another way.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, pose, quad, render};
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    DiskLight, IntersectorKind, Light, Material, PointLight, QuadLight, Sky, SphereLight,
    SpotLight, World, WorldSphere,
};
use tweenray::stats::RayKind;

fn rough(reflectance: Rgb, roughness: f64) -> Material {
    Material { roughness, ..Material::mirror("rough", reflectance) }
}

/// A plate in the plane y = 0.
fn plate(material: Material) -> World {
    let mut world = World::default();
    world.materials.push(material);
    let corners = [(-4.0, -4.0), (-4.0, 4.0), (4.0, 4.0), (4.0, -4.0)];
    world.meshes.push(quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0));
    world
}

fn mean(film: &Film) -> f64 {
    film.rgb.iter().map(|c| f64::from(c.y)).sum::<f64>() / film.rgb.len() as f64
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
    let lights = [
        Light::Quad(QuadLight { corners, radiance, two_sided: true }),
        Light::Disk(DiskLight { centre, normal, radius: 0.4, radiance, two_sided: false }),
        Light::Sphere(SphereLight { centre, radius: 0.3, radiance }),
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
