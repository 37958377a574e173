//! Rough glass against what physics tells and against itself, sampled in another way.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, mean, pose, render};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    Glass, IntersectorKind, Light, Material, PointLight, QuadLight, Sky, Texture, TextureMap,
    World, WorldSphere,
};
use tweenray::stats::RayKind;

const KINDS: [IntersectorKind; 2] = [IntersectorKind::Embree, IntersectorKind::Oracle];

fn glass(roughness: f64, thin: bool) -> Material {
    let glass = Glass { roughness, thin, ..Glass::clear(1.5) };
    Material { glass: Some(glass), ..Material::black("glass") }
}

/// A plate in the plane y = 0.
fn plate(material: Material) -> World {
    common::plate(material, 9.0)
}

/// Clear glass in a furnace is not seen: one crossing from outside and from inside, steep and flat, at every roughness.
#[test]
fn a_rough_boundary_in_a_furnace_is_one() {
    for (thin, height) in [(true, 1.0), (false, 1.0), (false, -1.0)] {
        for tenth in 0..=10 {
            for away in [0.01, 1.0, 6.0] {
                let mut world = plate(glass(f64::from(tenth) / 10.0, thin));
                world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
                let mut job = job(world, pose((0.0, height, away), (0.0, 0.0, 0.0)), 16, 12);
                // From inside what is reflected wholly and what is not differ most.
                job.settings.spp = if height < 0.0 { 4096 } else { 1024 };
                let (film, counts) = render(&job);
                let told = format!("thin {thin}, roughness {tenth}/10, {height}, {away}");
                let mean = mean(&film);
                println!("{told}: {mean}");
                assert!((mean - 1.0).abs() < 0.002, "{told}: {mean}");
                assert_eq!((film.bad.total(), counts[RayKind::Glossy] > 0), (0, tenth > 0));
            }
        }
    }
}

/// A whole ball of clear glass gives back what enters it, but for what its paths are too short for.
#[test]
fn a_rough_ball_in_a_furnace_is_never_above_one() {
    for tenth in [0, 1, 3, 6, 10] {
        let mut world = World::default();
        world.materials.push(glass(f64::from(tenth) / 10.0, false));
        world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
        world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
        let mut job = job(world, pose((0.0, 0.0, 1.9), (0.0, 0.0, 0.0)), 16, 12);
        (job.settings.spp, job.settings.bounces) = (2048, 20);
        let mean = mean(&render(&job).0);
        println!("roughness {tenth}/10: {mean}");
        assert!((0.97..1.002).contains(&mean), "roughness {tenth}/10: {mean}");
    }
}

/// A point light behind a rough boundary: f · I cos θ / d², with the microfacet formula written out anew.
#[test]
fn a_point_light_is_seen_through_rough_glass_as_the_formula_says() {
    let (lamp, intensity, roughness) = (DVec3::new(0.3, -1.5, -0.2), 3.0, 0.4);
    for (kind, thin) in KINDS.into_iter().flat_map(|kind| [(kind, true), (kind, false)]) {
        let mut world = plate(glass(roughness, thin));
        let intensity = Rgb::splat(intensity);
        world.lights.push(Light::Point(PointLight { position: lamp, intensity }));
        let mut job = job(world, pose((-0.4, 2.0, 0.5), (0.0, 0.0, 0.0)), 24, 18);
        job.settings.intersector = kind;
        let (film, _) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            let wo = (job.camera.eye - p).normalize();
            let wi = (lamp - p).normalize();
            let a2: f64 = f64::powi(roughness, 4);
            let masked = |c: f64| 2.0 * c / (c + (a2 + (1.0 - a2) * c * c).sqrt());
            let single = if thin {
                let mirrored = DVec3::new(wi.x, -wi.y, wi.z);
                let m = (mirrored + wo).normalize();
                let d = a2 / (std::f64::consts::PI * (m.y * m.y * (a2 - 1.0) + 1.0).powi(2));
                let root = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
                let g_over = 2.0 / (mirrored.y * root(wo.y) + wo.y * root(mirrored.y));
                let face = fresnel(wo.dot(m), 1.5);
                let through = 1.0 - 2.0 * face / (1.0 + face);
                d * g_over / 4.0 * through
            } else {
                let m = -(wo + wi * 1.5).normalize();
                let d = a2 / (std::f64::consts::PI * (m.y * m.y * (a2 - 1.0) + 1.0).powi(2));
                let (o, i) = (wo.dot(m), wi.dot(m).abs());
                if o <= 0.0 {
                    // No microfacet bends light that far.
                    assert_eq!(rgb, Rgb::ZERO);
                    continue;
                }
                let g = masked(wo.y) * masked(-wi.y);
                let bend = 1.5 * 1.5 / (o - 1.5 * i).powi(2);
                o * i / (wo.y * -wi.y) * (1.0 - fresnel(o, 1.5)) * g * d * bend
            };
            let arrives = 3.0 * -wi.y / (lamp - p).length_squared();
            // What is given back is a few parts in a hundred at this roughness.
            let share = f64::from(rgb.y) / (single * arrives);
            assert!((1.0..1.06).contains(&share), "{kind:?} thin {thin} {x},{y}: {share}");
        }
    }
}

/// Fresnel's equations for light that enters, unpolarised.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let below = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let s = (cos - eta * below) / (cos + eta * below);
    let p = (eta * cos - below) / (eta * cos + below);
    0.5 * (s * s + p * p)
}

/// A lamp behind rough glass by samples of the lamp, and by the glass's own rays alone.
#[test]
fn light_samples_and_lobe_samples_agree() {
    for (thin, roughness) in [(true, 0.2), (true, 0.6), (false, 0.3), (false, 0.8)] {
        let mut world = plate(glass(roughness, thin));
        // Above and below, so that both reflection and transmission see one.
        for (height, side) in [(1.2, 0.7), (-1.5, -0.6)] {
            let at = |x: f64, z: f64| DVec3::new(x + side, height, z);
            world.lights.push(Light::Quad(QuadLight {
                corners: [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)],
                radiance: Rgb::splat(2.0),
                two_sided: true,
            }));
        }
        let mut job = job(world, pose((-1.0, 1.5, 1.6), (0.0, 0.0, 0.0)), 24, 18);
        let mut means = [0.0; 2];
        for (samples, mean_of) in [(2, 0), (0, 1)] {
            job.settings.shadow_samples = samples;
            job.settings.spp = if samples == 0 { 8192 } else { 2048 };
            means[mean_of] = mean(&render(&job).0);
        }
        let off = (means[0] / means[1] - 1.0).abs();
        println!("thin {thin}, roughness {roughness}: {means:?}");
        assert!(off < 0.01, "thin {thin}, roughness {roughness}: {means:?}");
    }
}

/// Glass without roughness, and a body of the index of what is around it, are what they were.
#[test]
fn what_bends_no_light_is_not_rough() {
    let seen = |roughness: f64, ior: f64| {
        let body = Glass { roughness, ..Glass::clear(ior) };
        let mut world = plate(Material { glass: Some(body), ..Material::black("glass") });
        world.sky = Sky { radiance: Rgb::new(0.2, 0.5, 1.0), ..Sky::default() };
        render(&job(world, pose((0.0, 1.0, 1.0), (0.0, 0.0, 0.0)), 16, 12))
    };
    let ((matte, counts), (clear, _)) = (seen(0.7, 1.0), seen(0.0, 1.0));
    assert_eq!((matte.rgb, counts[RayKind::Glossy]), (clear.rgb, 0));
}

/// A plate of glass whose roughness lies in an image of `texels`, 16 in a row.
fn mapped_plate(texels: Vec<u8>, thin: bool) -> World {
    let image = Texture::from_data8("t", [16, (texels.len() / 16) as u32], texels);
    let map = Some(TextureMap::of(0));
    common::imaged_plate(Material { roughness_map: map, ..glass(1.0, thin) }, 9.0, image)
}

/// An image that is the same all over gives the picture of the number, from both sides; one of other roughness does not.
#[test]
fn an_image_of_roughness_is_the_roughness_that_it_holds() {
    for (kind, thin, height) in KINDS
        .into_iter()
        .flat_map(|kind| [(kind, true, 2.0), (kind, false, 2.0), (kind, false, -2.0)])
    {
        let seen = |mut world: World| {
            for height in [-1.5, 1.5] {
                let position = DVec3::new(0.3, height, -0.2);
                world
                    .lights
                    .push(Light::Point(PointLight { position, intensity: Rgb::splat(3.0) }));
            }
            world.sky = Sky { radiance: Rgb::splat(0.1), ..Sky::default() };
            let mut job = job(world, pose((-0.4, height, 0.5), (0.0, 0.0, 0.0)), 24, 18);
            (job.settings.intersector, job.settings.spp) = (kind, 4);
            render(&job).0.rgb
        };
        let number = seen(plate(glass(f64::from(f32::from(102_u8) / 255.0), thin)));
        let told = format!("{kind:?} thin {thin} from {height}");
        let off = |found: Vec<Rgb>| {
            let each = found.iter().zip(&number).map(|(a, b)| (a.y / b.y - 1.0).abs());
            each.fold(0.0, f32::max)
        };
        // Interpolation between equal texels rounds.
        let same = off(seen(mapped_plate(vec![102; 64], thin)));
        assert!(same < 1e-3, "{told}: {same}");
        let other = off(seen(mapped_plate(vec![160; 64], thin)));
        assert!(other > 0.1, "{told}: {other}");
    }
}

/// From polished to ground side by side, a furnace shows nothing.
#[test]
fn an_image_of_roughness_in_a_furnace_is_one() {
    for (thin, height) in [(true, 1.0), (false, 1.0), (false, -1.0)] {
        let mut world = mapped_plate((0..=255).collect(), thin);
        world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
        let mut job = job(world, pose((0.0, height, 3.0), (0.0, 0.0, 0.0)), 32, 24);
        job.settings.spp = 256;
        let film = render(&job).0;
        let mean = mean(&film);
        assert!((mean - 1.0).abs() < 0.002, "thin {thin} from {height}: {mean}");
        assert_eq!(film.bad.total(), 0);
    }
}

/// Paths that are reflected many times within a body keep their weight: no pixel of a furnace is far above one.
#[test]
fn trapped_paths_do_not_grow() {
    for (ior, roughness) in [(2.4, 0.5), (2.4, 0.8), (2.4, 1.0), (4.0, 0.5), (1.5, 0.3)] {
        let mut world = World::default();
        let glass = Glass { roughness, ..Glass::clear(ior) };
        world.materials.push(Material { glass: Some(glass), ..Material::black("glass") });
        world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
        world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
        let mut job = job(world, pose((0.0, 0.0, 4.0), (0.0, 0.0, 0.0)), 32, 24);
        (job.settings.spp, job.settings.bounces) = (64, 1024);
        let film = render(&job).0;
        let most = film.rgb.iter().map(|rgb| rgb.y).fold(0.0, f32::max);
        let mean = mean(&film);
        println!("index {ior}, roughness {roughness}: mean {mean}, most {most}");
        assert!((mean - 1.0).abs() < 0.01 && most < 2.0, "{ior} {roughness}: {mean} {most}");
    }
}
