//! Furnaces: light from everywhere, so every right picture is known.

use crate::common::{self, Job};
use crate::shapes;
use crate::suite::{Outcome, Size};
use rayon::prelude::*;
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    Corners, Glass, Material, Sky, Texture, TextureMap, World, WorldMesh, WorldSphere,
};

fn glass(tint: f32, priority: Option<u8>) -> Material {
    let glass = Glass { tint: Rgb::splat(tint), priority, ..Glass::clear(1.5) };
    Material { glass: Some(glass), ..Material::black("glass") }
}

/// A unit sphere, exact or of triangles with smooth normals and texture coordinates.
fn unit_sphere(material: Material, exact: bool) -> World {
    let mut world = World::default();
    world.materials.push(material);
    world.textures.push(Texture::from_linear("white", [2, 2], vec![Rgb::ONE; 4]));
    if exact {
        world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
    } else {
        world.meshes.push(fine_sphere());
    }
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    world
}

fn fine_sphere() -> WorldMesh {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, 128, 64);
    let values = mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect();
    mesh.normals = Some(Corners { values, corners: None });
    let values = mesh.positions.iter().map(|p| p.truncate().as_vec2()).collect();
    mesh.uvs = Some(Corners { values, corners: None });
    mesh
}

/// Name, world, and the radiance that its surface must have.
fn furnaces() -> Vec<(String, World, f32)> {
    let mut list = Vec::new();
    for albedo in [0.5f32, 1.0] {
        let grey = Rgb::splat(albedo);
        for exact in [true, false] {
            let kind = if exact { "exact" } else { "mesh" };
            let mut add = |name: &str, material: Material| {
                let world = unit_sphere(material, exact);
                list.push((format!("{name} {albedo}, {kind}"), world, albedo));
            };
            add("diffuse", Material::diffuse("d", grey));
            add("mirror", Material { mirror: grey, ..Material::black("m") });
            let half = grey * 0.5;
            add("diffuse and mirror", Material { mirror: half, ..Material::diffuse("dm", half) });
            if !exact {
                add(
                    "textured",
                    Material { texture: Some(TextureMap::of(0)), ..Material::diffuse("t", grey) },
                );
            }
        }
    }
    list.push(("glass, exact".into(), unit_sphere(glass(1.0, None), true), 1.0));
    list.push(("glass, mesh".into(), unit_sphere(glass(1.0, None), false), 1.0));
    let mut nested = unit_sphere(glass(1.0, Some(1)), true);
    nested.materials.push(glass(1.0, Some(2)));
    nested.spheres.push(WorldSphere::new("core", DVec3::new(0.3, 0.2, 0.1), 0.8, 1));
    list.push(("nested glass, overlapping".into(), nested, 1.0));
    list
}

fn pixels_on(film: &Film) -> impl Iterator<Item = Rgb> + '_ {
    let ids = &film.gbuffer.as_ref().unwrap().mesh_id;
    film.rgb.iter().zip(ids).filter(|(_, id)| **id != 0).map(|(c, _)| *c)
}

fn job(world: World, edge: u32) -> Job {
    let mut job = common::job(world, common::pose((0.0, 1.0, 3.0), (0.0, 0.0, 0.0)), edge, edge);
    job.settings.bounces = 400;
    job.settings.cutoff = 1e-6;
    job
}

/// Mean and half the width of its 95 % interval.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, 1.96 * (variance / n).sqrt())
}

pub fn white_furnace(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let mut judge = |name: &str, film: &Film, target: f32| {
        let values: Vec<f64> = pixels_on(film).map(|c| f64::from(c.x / target)).collect();
        let (mean, half) = mean(&values);
        let off = (mean - 1.0).abs() + half;
        let bad = film.bad.total();
        outcome.check(off <= 0.002 && bad == 0, || format!("{name}: {mean} ± {half}, {bad} bad"));
        outcome.show(format!("{name}: mean {mean:.6} ± {half:.1e} of 1, {} pixels", values.len()));
    };
    for (name, world, target) in furnaces() {
        let mut job = job(world, size.of(24, 128));
        // One camera sample, at the pixel's middle: with more, the sky would be in the rim's pixels.
        job.settings.sky_samples = size.of(16, 256);
        judge(&name, &common::render(&job).0, target);
    }
    // From inside: what is not reflected is emitted, so reflections upon reflections add up to 1.
    for reflectance in [0.5f32, 0.9] {
        for exact in [true, false] {
            let material = Material {
                mirror: Rgb::splat(reflectance),
                emission: Rgb::splat(1.0 - reflectance),
                emits_back: true,
                ..Material::black("m")
            };
            let mut job = job(unit_sphere(material, exact), size.of(24, 128));
            let pose = common::pose((0.1, 0.2, 0.3), (0.5, 0.4, -1.0));
            job.camera = tweenray::scene::Camera::new(&pose, 90.0, 24, 24).unwrap();
            job.settings.bounces = 150;
            judge(
                &format!("closed mirror {reflectance}, exact {exact}"),
                &common::render(&job).0,
                1.0,
            );
        }
    }
    outcome
}

/// Reflected and transmitted light of each material, seen from over a hundred directions of a
/// sphere, never exceeds what comes in: 1.
pub fn energy(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let (spp, sky) = size.of((4, 64), (256, 4096));
    // Small pictures are one thread's work, so materials run side by side.
    let full: Vec<_> = furnaces().into_iter().filter(|(_, _, target)| *target == 1.0).collect();
    let seen = full.into_par_iter().map(|(name, world, target)| {
        let mut job = job(world, 14);
        // Close enough that the grazing rim fills pixels of its own.
        let pose = common::pose((0.0, 0.8, 2.6), (0.0, 0.0, 0.0));
        job.camera = tweenray::scene::Camera::new(&pose, 45.0, 14, 14).unwrap();
        let diffuse = job.world.materials[0].diffuse != Rgb::ZERO;
        // Mirrors and glass draw no samples but those within the pixel.
        (job.settings.spp, job.settings.sky_samples) =
            if diffuse { (spp, sky) } else { (size.of(64, 4096), 1) };
        (name, target, common::render(&job))
    });
    let mut samples = 0;
    for (name, target, (film, counts)) in seen.collect::<Vec<_>>() {
        samples += counts.total();
        let values: Vec<f64> = pixels_on(&film).map(|c| f64::from(c.max_element())).collect();
        let most = values.iter().fold(0.0, |a: f64, b| a.max(*b));
        let least = values.iter().fold(f64::MAX, |a: f64, b| a.min(*b));
        for value in &values {
            outcome.check(*value <= 1.0005, || format!("{name}: {value}"));
        }
        outcome.show(format!(
            "{name}: albedo {least:.6} to {most:.6} over {} directions (target {target})",
            values.len()
        ));
        if values.len() < 100 {
            outcome.complain(format!("{name}: only {} directions", values.len()));
        }
    }
    outcome.show(format!("{samples} rays"));
    outcome
}
