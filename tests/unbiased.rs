//! Every kind of light, reflected or let through by every lobe, is as bright on average by few samples as by many: the means
//! of 500 short renders with 4 samples of each light and 16 of the sky, and of 500 others with 8 times as many.
//!
//! The difference of both, over its standard error, is a sample of the normal distribution (a z-test) unless there is a bias
//! that more samples take away. What no number of samples takes away is seen by the closed forms of other tests.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use common::{Job, cube, job, pose};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    Corners, DirectionalLight, DiskLight, Environment, EnvironmentKind, Fog, Fresnel, Glass, Light,
    Material, NormalMap, PointLight, QuadLight, Settings, Sky, SkyGradient, SphereLight, SpotLight,
    SunLight, SunSky, Texture, TextureMap, World, WorldMesh, WorldSphere,
};
use tweenray::shade::Renderer;

/// Renders of few samples, and as many of many. A pixel has one camera sample, in its middle.
const RENDERS: u64 = 500;
/// Samples of each light in the first, and of the sky. The ratio of an environment that shadows hide in part is a quotient of
/// sums, which few samples bias: 4 by a thousandth (decision 031).
const FEW: u32 = 4;
const FEW_OF_SKY: u32 = 16;
/// On these in the others.
const FACTOR: u32 = 8;
/// Pixels of a render.
const SIZE: (u32, u32) = (8, 6);
/// |z| that one of 227 tests passes by chance once in 70 times; seeds are the same in each run.
const MOST: f64 = 4.0;
/// Standard error of a difference, as a share of the light, beyond which a test would see too little.
const MOST_ERROR: f64 = 0.05;

type MakeLight = fn(&mut World);

/// A light of each kind, over the plate at the origin and partly behind the box beside it.
const LIGHTS: [(&str, MakeLight); 14] = [
    ("point", |w| {
        let (position, intensity) = (DVec3::new(1.5, 2.0, -0.5), Rgb::splat(6.0));
        w.lights.push(Light::Point(PointLight { position, intensity }));
    }),
    ("directional", |w| {
        let (to_light, irradiance) = (DVec3::new(1.5, 2.0, -0.5).normalize(), Rgb::splat(2.0));
        w.lights.push(Light::Directional(DirectionalLight { to_light, irradiance }));
    }),
    ("quad", |w| {
        let corners = [(1.0, 1.6), (1.0, 2.6), (2.2, 2.6), (2.2, 1.6)];
        let corners = corners.map(|(x, y)| DVec3::new(x, y, -1.2 + 0.3 * x));
        let radiance = Rgb::splat(6.0);
        w.lights.push(Light::Quad(QuadLight { corners, radiance, two_sided: true }));
    }),
    ("disk", |w| {
        let (centre, normal) =
            (DVec3::new(1.5, 2.0, -0.5), DVec3::new(-1.5, -2.0, 0.5).normalize());
        let radiance = Rgb::splat(6.0);
        w.lights.push(Light::Disk(DiskLight {
            centre,
            normal,
            radius: 0.6,
            radiance,
            two_sided: false,
        }));
    }),
    ("sphere", |w| {
        let (centre, radiance) = (DVec3::new(1.5, 2.0, -0.5), Rgb::splat(6.0));
        w.lights.push(Light::Sphere(SphereLight { centre, radius: 0.5, radiance }));
    }),
    ("spot", |w| w.lights.push(Light::Spot(spot(0.0)))),
    ("wide spot", |w| w.lights.push(Light::Spot(spot(0.4)))),
    ("sun", |w| {
        let to_light = DVec3::new(1.5, 2.0, -0.5).normalize();
        let radiance = Rgb::splat(20.0);
        w.lights.push(Light::Sun(SunLight { to_light, angular_radius: 0.2, radiance }));
    }),
    ("sky", |w| w.sky = Sky { radiance: Rgb::splat(0.5), lights: true, ..Sky::default() }),
    ("image", |w| {
        let texel = |at: u32| match at {
            50..54 => Rgb::splat(30.0),
            _ => Rgb::splat(0.1 + 0.5 * (at % 16) as f32 / 16.0),
        };
        w.textures.push(Texture::from_linear("sky", [16, 8], (0..128).map(texel).collect()));
        let number = w.textures.len() as u32 - 1;
        w.environment = Some(Environment::new(EnvironmentKind::Image(number)));
    }),
    ("gradient", |w| {
        let [zenith, horizon, ground] = [0.2, 1.5, 0.1].map(Rgb::splat);
        let gradient = SkyGradient { zenith, horizon, ground };
        w.environment = Some(Environment::new(EnvironmentKind::Gradient(gradient)));
    }),
    ("sun and sky", |w| {
        let to_sun = DVec3::new(1.5, 2.0, -0.5).normalize();
        let ground = Rgb::splat(0.2);
        let day = SunSky { to_sun, turbidity: 3.0, sun_radius: 0.1, ground };
        let strength = 0.2;
        let kind = EnvironmentKind::SunSky(day);
        w.environment = Some(Environment { strength, ..Environment::new(kind) });
    }),
    ("mesh", |w| {
        let lamp =
            Material { emission: Rgb::splat(6.0), ..Material::diffuse("lamp", Rgb::splat(0.5)) };
        let lamp = w.add_material(lamp);
        w.meshes.push(cube(DVec3::new(1.5, 2.0, -0.5), 0.4, lamp));
    }),
    ("many", |w| {
        for i in 0..12 {
            let at = f64::from(i);
            let centre = DVec3::new(1.5 + 0.5 * at.sin(), 1.6 + 0.1 * at, 0.9 * (at - 6.0));
            let radiance = Rgb::splat(6.0 + 2.0 * at as f32);
            w.lights.push(Light::Sphere(SphereLight { centre, radius: 0.2, radiance }));
        }
    }),
];

fn spot(radius: f64) -> SpotLight {
    let position = DVec3::new(1.5, 2.0, -0.5);
    let direction = -position.normalize();
    let intensity = Rgb::splat(8.0);
    SpotLight { position, direction, intensity, cos_inner: 0.95, cos_outer: 0.8, radius }
}

/// A material of each lobe, and of several together.
fn materials() -> Vec<(&'static str, Material)> {
    let mirror = |roughness| Material { roughness, ..Material::mirror("", Rgb::splat(0.8)) };
    let layered = |roughness, fresnel| Material {
        mirror: Rgb::splat(0.04),
        roughness,
        fresnel: Some(fresnel),
        ..Material::diffuse("", Rgb::splat(0.6))
    };
    let metal = Fresnel { metallic: 1.0, ..Fresnel::PLASTIC };
    let coat =
        Fresnel { clearcoat: 1.0, clearcoat_roughness: 0.3, metallic: 0.5, ..Fresnel::PLASTIC };
    let glass = |roughness, thin| {
        let glass = Glass { roughness, thin, tint: Rgb::splat(0.9), ..Glass::clear(1.5) };
        Material { glass: Some(glass), ..Material::black("") }
    };
    let part = |roughness, thin| {
        let fresnel = Fresnel { transmission: 0.5, ..Fresnel::PLASTIC };
        let Material { glass, .. } = glass(roughness, thin);
        Material { glass, ..layered(roughness, fresnel) }
    };
    let bumpy = |material| {
        let normal_map = Some(NormalMap { image: TextureMap::of(0), strength: 0.7 });
        Material { normal_map, ..material }
    };
    let bumpy_coat = |mut material: Material| {
        let normals = NormalMap { image: TextureMap::of(0), strength: 0.7 };
        material.fresnel.as_mut().unwrap().clearcoat_normal_map = Some(normals);
        material
    };
    vec![
        ("diffuse", Material::diffuse("", Rgb::splat(0.6))),
        ("bumpy diffuse", bumpy(Material::diffuse("", Rgb::splat(0.6)))),
        ("mirror", mirror(0.0)),
        ("rough mirror", mirror(0.3)),
        ("nearly smooth mirror", mirror(0.15)),
        ("bumpy rough mirror", bumpy(mirror(0.4))),
        ("plastic", layered(0.3, Fresnel::PLASTIC)),
        ("metal", layered(0.5, metal)),
        ("coated", layered(0.6, coat)),
        ("bumpy coat", bumpy_coat(layered(0.6, coat))),
        ("pane", glass(0.0, true)),
        ("rough pane", glass(0.4, true)),
        ("glass", glass(0.0, false)),
        ("rough glass", glass(0.4, false)),
        ("part pane", part(0.0, true)),
        ("part glass", part(0.0, false)),
        ("part rough pane", part(0.3, true)),
        ("part rough glass", part(0.3, false)),
    ]
}

/// A plate, or of what has an inside a slab, with a box on it and another below it. The camera looks down on the plate.
fn stage(material: &Material, light: MakeLight) -> Job {
    let mut world = World::default();
    world.textures.push(bumps());
    world.materials.push(material.clone());
    let grey = world.add_material(Material::diffuse("grey", Rgb::splat(0.4)));
    match material.glass.is_some_and(|glass| !glass.thin) {
        true => world.meshes.push(slab()),
        false => {
            let corners = [(-2.0, 2.0), (2.0, 2.0), (2.0, -2.0), (-2.0, -2.0)];
            let mesh = common::quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0);
            let values = corners.map(|(x, z)| Vec2::new(x as f32, -z as f32)).to_vec();
            world.meshes.push(WorldMesh { uvs: Some(Corners { values, corners: None }), ..mesh });
        }
    }
    world.meshes.push(cube(DVec3::new(0.6, 0.4, -0.2), 0.3, grey));
    world.spheres.push(WorldSphere::new("below", DVec3::new(-0.2, -1.0, -0.4), 0.3, grey));
    light(&mut world);
    let mut job = job(world, pose((-0.8, 1.6, 1.4), (0.0, 0.0, -0.1)), SIZE.0, SIZE.1);
    (job.settings.shadow_samples, job.settings.sky_samples) = (FEW, FEW_OF_SKY);
    job.settings.bounces = 3;
    job
}

fn slab() -> WorldMesh {
    let mut slab = cube(DVec3::ZERO, 1.0, 0);
    for p in &mut slab.positions {
        *p = *p * DVec3::new(2.0, 0.15, 2.0) - DVec3::Y * 0.15;
    }
    slab
}

/// Normals of waves.
fn bumps() -> Texture {
    let texel = |i: u32| {
        let wave = |x: u32| f64::from(x) / 8.0 * std::f64::consts::TAU;
        let n = DVec3::new(wave(i % 8).sin(), wave(i / 8).cos(), 1.5).normalize();
        n.to_array().map(|c| ((c + 1.0) * 127.5).round() as u8)
    };
    Texture::from_vectors8("bumps", [8, 8], (0..64).map(texel).collect())
}

/// The mean of numbers, and its standard error.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// What few samples see less what many do, and its standard error, as shares of the latter.
fn off(job: &Job) -> (f64, f64) {
    let scene = job.world.clone().into_scene(true).unwrap();
    let intersector = intersect::build(&scene, &job.settings, 1).unwrap();
    let of = |first: u64, factor: u32| {
        let renders = first..first + RENDERS;
        let means: Vec<f64> = renders
            .into_par_iter()
            .map(|seed| {
                let mut settings = Settings { seed, ..job.settings.clone() };
                settings.shadow_samples *= factor;
                settings.sky_samples *= factor;
                settings.fog_samples *= factor;
                let renderer = Renderer::new(&scene, &settings, &*intersector);
                let stop = AtomicBool::new(false);
                let (film, _) = renderer.render(&job.camera, 1, false, &stop, &()).unwrap();
                assert_eq!(film.bad.total(), 0);
                common::mean(&film)
            })
            .collect();
        mean(&means)
    };
    let ((few, error), (many, error_of_many)) = (of(0, 1), of(1_000_000, FACTOR));
    ((few - many) / many, error.hypot(error_of_many) / many)
}

/// Fails by name where a z or an error is too large, or where the z of all are larger than those of chance.
fn check(jobs: impl Iterator<Item = (String, Job)>) {
    let (mut broken, mut squares, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    let mut exact = 0;
    for (name, job) in jobs {
        let (share, error) = off(&job);
        // Rounding of the sums, where nothing is left to chance.
        let is_exact = error < 1e-6;
        let z = share / error.max(1e-6);
        let told = format!("{name}: off by {share:+.1e}, z {z:+.2}");
        println!("{told}");
        if !(z.abs() < MOST && error < MOST_ERROR) {
            broken.push(told);
        }
        if is_exact {
            exact += 1;
        } else {
            squares.push(z * z);
            errors.push(error);
        }
    }
    errors.sort_by(f64::total_cmp);
    let (count, square) = (squares.len(), mean(&squares).0);
    let (middle, largest) = (errors[count / 2], errors[count - 1]);
    println!(
        "{count} tests of chance and {exact} without: mean square of z {square:.2}, standard error of the share {middle:.1e} in \
         the median, {largest:.1e} at most"
    );
    assert!(broken.is_empty(), "{broken:#?}");
    assert!(square < 1.0 + 3.0 * (2.0 / count as f64).sqrt(), "mean square of z {square}");
}

#[test]
fn every_light_is_as_bright_by_every_lobe() {
    let materials = materials();
    check(LIGHTS.into_iter().flat_map(|(light, make)| {
        let of = move |(name, material): &(&str, Material)| {
            (format!("{light}, {name}"), stage(material, make))
        };
        materials.iter().map(of).collect::<Vec<_>>()
    }));
}

#[test]
fn every_light_is_as_bright_in_fog() {
    check(LIGHTS.into_iter().map(|(light, make)| {
        let mut job = stage(&Material::diffuse("", Rgb::splat(0.6)), make);
        let bounds = tweenray::math::Bounds3 {
            min: DVec3::new(-2.0, -0.5, -2.0),
            max: DVec3::new(3.0, 3.0, 2.0),
        };
        job.world.fog = Some(Fog {
            extinction: 0.3,
            albedo: Rgb::splat(0.8),
            anisotropy: 0.4,
            bounds: Some(bounds),
        });
        (format!("{light}, fog"), job)
    }));
}
