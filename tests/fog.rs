//! Fog against numerical integration: what it takes on the way, and what it scatters once.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;

use common::{Job, mean, plate, pose, quad, render, render_scene, render_with_every_effect};
use std::f64::consts::{PI, TAU};
use tweenray::math::{Bounds3, DVec3, Rgb};
use tweenray::scene::{
    Camera, DirectionalLight, DiskLight, Environment, EnvironmentKind, Fog, IntersectorKind, Light,
    Material, PointLight, QuadLight, Settings, Sky, SkyGradient, SphereLight, SpotLight, SunLight,
    World, WorldSphere,
};
use tweenray::stats::RayKind;

const EYE: DVec3 = DVec3::new(0.2, 0.1, 5.0);
/// Where the wall ends every ray.
const WALL: f64 = -4.0;

fn fog() -> Fog {
    let bounds = Bounds3 { min: DVec3::new(-2.0, -2.0, -3.0), max: DVec3::new(3.0, 4.0, 3.5) };
    Fog { extinction: 0.35, albedo: Rgb::new(0.9, 0.8, 0.6), anisotropy: 0.4, bounds: Some(bounds) }
}

/// A black wall in `fog`.
fn world(fog: Fog) -> World {
    let mut world = World::default();
    let black = world.add_material(Material::diffuse("black", Rgb::ZERO));
    let corner = |x: f64, y: f64| DVec3::new(x, y, WALL);
    let corners = [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)];
    world.meshes.push(quad(corners, black));
    world.fog = Some(fog);
    world
}

/// One pixel, that looks along -z.
fn one_pixel(world: World, spp: u32) -> Job {
    let at = pose((EYE.x, EYE.y, EYE.z), (EYE.x, EYE.y, 0.0));
    let camera = Camera::new(&at, 1e-3, 1, 1).unwrap();
    Job { world, camera, settings: Settings { width: 1, height: 1, spp, ..Settings::default() } }
}

/// The part of light that is left between two points, or of parallel light that comes from a direction.
fn left(fog: &Fog, from: DVec3, way: DVec3) -> f64 {
    let (mut near, mut far) = (0.0, 1.0);
    if let Some(bounds) = &fog.bounds {
        for axis in 0..3 {
            let [a, b] = [bounds.min, bounds.max].map(|end| (end[axis] - from[axis]) / way[axis]);
            if way[axis] != 0.0 {
                (near, far) = (f64::max(near, a.min(b)), f64::min(far, a.max(b)));
            }
        }
    }
    (-fog.extinction * (far - near).max(0.0) * way.length()).exp()
}

fn phase(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

/// What `fog` scatters towards the pixel where `arriving` gives direction, fluence and the part that is left of light at a point.
fn scattered(fog: &Fog, arriving: impl Fn(DVec3) -> Vec<(DVec3, f64, f64)>) -> f64 {
    let length = EYE.z - WALL;
    let n = 600;
    let sum: f64 = (0..n)
        .map(|k| {
            let p = EYE - DVec3::Z * (length * (f64::from(k) + 0.5) / f64::from(n));
            let inside = fog.bounds.is_none_or(|bounds| bounds.contains(p));
            let here: f64 = arriving(p)
                .iter()
                .map(|(wi, fluence, left)| fluence * left * phase(fog.anisotropy, -wi.z))
                .sum();
            let along = left(fog, EYE, p - EYE);
            if inside { fog.extinction * along * here } else { 0.0 }
        })
        .sum();
    sum * length / f64::from(n)
}

/// A grid of `n` times `n` points of the unit square.
fn grid(n: u32) -> impl Iterator<Item = [f64; 2]> {
    let at = move |k: u32| (f64::from(k) + 0.5) / f64::from(n);
    (0..n * n).map(move |k| [at(k % n), at(k / n)])
}

fn towards(fog: &Fog, p: DVec3, light: DVec3, intensity: f64) -> (DVec3, f64, f64) {
    let way = light - p;
    (way.normalize(), intensity / way.length_squared(), left(fog, p, way))
}

/// Lights of every kind with what arrives from them at a point.
type Arriving = Box<dyn Fn(&Fog, DVec3) -> Vec<(DVec3, f64, f64)>>;

fn lights() -> Vec<(&'static str, Light, Arriving)> {
    let white = Rgb::ONE;
    let place = DVec3::new(1.1, 0.9, 0.4);
    let to_light = DVec3::new(0.4, 0.8, 0.3).normalize();
    let spot = SpotLight {
        position: place,
        direction: DVec3::new(-1.0, -0.8, 0.1).normalize(),
        intensity: white,
        cos_inner: 0.9,
        cos_outer: 0.6,
        radius: 0.0,
    };
    let cone = spot.clone();
    let corners = [[-0.6, -0.4], [0.6, -0.4], [0.6, 0.4], [-0.6, 0.4]]
        .map(|[x, z]| DVec3::new(0.8 + x, 2.0, z));
    let (centre, normal) = (DVec3::new(0.5, 1.6, -1.0), DVec3::new(-0.3, -0.9, 0.2).normalize());
    let flat = |fog: &Fog, p: DVec3, point: DVec3, normal: DVec3, area: f64| {
        let cos = (p - point).normalize().dot(normal).max(0.0);
        towards(fog, p, point, area * cos)
    };
    let tangent = normal.any_orthonormal_vector();
    vec![
        (
            "point",
            Light::Point(PointLight { position: place, intensity: white }),
            Box::new(move |fog, p| vec![towards(fog, p, place, 1.0)]),
        ),
        (
            "spot",
            Light::Spot(spot),
            Box::new(move |fog, p| {
                let cos = (p - place).normalize().dot(cone.direction);
                vec![towards(fog, p, place, cone.falloff(cos))]
            }),
        ),
        (
            "directional",
            Light::Directional(DirectionalLight { to_light, irradiance: white }),
            Box::new(move |fog, p| vec![(to_light, 1.0, left(fog, p, to_light * 1e3))]),
        ),
        (
            "sun",
            Light::Sun(SunLight::of_irradiance(to_light, 0.01, white)),
            Box::new(move |fog, p| vec![(to_light, 1.0, left(fog, p, to_light * 1e3))]),
        ),
        (
            "quad",
            Light::Quad(QuadLight { corners, radiance: white, two_sided: false }),
            Box::new(move |fog, p| {
                let point = |[u, v]: [f64; 2]| DVec3::new(0.2 + 1.2 * u, 2.0, 0.8 * v - 0.4);
                grid(16).map(|u| flat(fog, p, point(u), DVec3::NEG_Y, 1.2 * 0.8 / 256.0)).collect()
            }),
        ),
        (
            "disk",
            Light::Disk(DiskLight {
                centre,
                normal,
                radius: 0.5,
                radiance: white,
                two_sided: false,
            }),
            Box::new(move |fog, p| {
                let point = |[u, v]: [f64; 2]| {
                    let (sin, cos) = (TAU * v).sin_cos();
                    let across = normal.cross(tangent);
                    centre + (tangent * cos + across * sin) * (0.5 * u.sqrt())
                };
                grid(16).map(|u| flat(fog, p, point(u), normal, PI * 0.25 / 256.0)).collect()
            }),
        ),
        (
            "sphere",
            Light::Sphere(SphereLight { centre, radius: 0.3, radiance: white }),
            Box::new(move |fog, p| {
                let point = |[u, v]: [f64; 2]| {
                    let z = 2.0 * u - 1.0;
                    let (sin, cos) = (TAU * v).sin_cos();
                    DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
                };
                let area = 4.0 * PI * 0.09 / 1024.0;
                grid(32).map(|u| flat(fog, p, centre + point(u) * 0.3, point(u), area)).collect()
            }),
        ),
    ]
}

#[test]
fn light_of_every_kind_is_scattered_once_as_the_integral_says() {
    for (name, light, arriving) in lights() {
        for (everywhere, anisotropy) in [(false, 0.4), (true, 0.0), (true, -0.5)] {
            let is_distant = matches!(light, Light::Directional(_) | Light::Sun(_));
            let bounds = fog().bounds.filter(|_| !everywhere);
            let fog = Fog { bounds, anisotropy, ..fog() };
            let expected = match is_distant && everywhere {
                true => 0.0,
                false => scattered(&fog, |p| arriving(&fog, p)),
            };
            let mut world = world(fog.clone());
            world.lights.push(light.clone());
            let (film, rays) = render(&one_pixel(world, 16_384));
            let found = film.rgb[0];
            println!(
                "{name}, everywhere {everywhere}: {:.6} for {expected:.6} times albedo",
                found.x / 0.9
            );
            let albedo = fog.albedo.as_dvec3();
            let error = (found.as_dvec3() - albedo * expected).abs().max_element();
            assert!(error <= 4e-3 * expected, "{name}: {found} for {expected} times {albedo}");
            assert_eq!(rays[RayKind::ShadowFog] > 0, expected > 0.0);
        }
    }
}

#[test]
fn skies_are_scattered_in_a_box() {
    let gradient = SkyGradient {
        zenith: Rgb::new(0.2, 0.5, 1.5),
        horizon: Rgb::new(0.9, 0.8, 0.6),
        ground: Rgb::new(0.1, 0.2, 0.05),
    };
    let seen = |d: DVec3| {
        let [low, high, t] = match d.y < 0.0 {
            true => [gradient.horizon.z, gradient.ground.z, -d.y as f32],
            false => [gradient.horizon.z, gradient.zenith.z, d.y as f32],
        };
        f64::from(low + (high - low) * t)
    };
    let directions = |fog: &Fog, p: DVec3, radiance: &dyn Fn(DVec3) -> f64| {
        let all = grid(24).map(|[u, v]| {
            let z = 2.0 * u - 1.0;
            let (sin, cos) = (TAU * v).sin_cos();
            let d = DVec3::new((1.0 - z * z).sqrt() * cos, z, (1.0 - z * z).sqrt() * sin);
            // The wall hides what lies behind it.
            let free = d.z >= 0.0 || (p + d * ((WALL - p.z) / d.z)).abs().max_element() > 9.0;
            let shown = if free { radiance(d) } else { 0.0 };
            (d, shown * 4.0 * PI / 576.0, left(fog, p, d * 1e3))
        });
        all.collect::<Vec<_>>()
    };
    let fog = fog();
    let constant = scattered(&fog, |p| directions(&fog, p, &|_| 0.7));
    let graded = scattered(&fog, |p| directions(&fog, p, &seen));
    let mut of_one_colour = world(fog.clone());
    of_one_colour.sky = Sky { radiance: Rgb::splat(0.7), ..Sky::default() };
    let mut of_many = world(fog);
    of_many.environment = Some(Environment::new(EnvironmentKind::Gradient(gradient)));
    for (name, world, expected) in [("one", of_one_colour, constant), ("many", of_many, graded)] {
        let (film, _) = render(&one_pixel(world, 16_384));
        let found = f64::from(film.rgb[0].z) / 0.6;
        println!("a sky of {name} colours: {found:.6} for {expected:.6}");
        assert!((found / expected - 1.0).abs() < 5e-3, "{name}: {found} for {expected}");
    }
}

#[test]
fn the_ambient_term_is_scattered_in_closed_form() {
    let mut world = world(fog());
    world.sky.ambient = Rgb::splat(0.5);
    let (film, rays) = render(&one_pixel(world, 1));
    let lost = 1.0 - (-0.35f64 * 6.5).exp();
    let expected = fog().albedo * (0.5 * lost) as f32;
    assert!((film.rgb[0] - expected).abs().max_element() < 1e-6, "{} for {expected}", film.rgb[0]);
    assert_eq!(rays[RayKind::ShadowFog], 0);
}

/// Absorbing fog alone: surfaces get what is left of light on its way to them, and the camera what is left of that.
#[test]
fn surfaces_are_lit_through_fog() {
    let absorbing = |extinction| Fog {
        extinction,
        albedo: Rgb::ZERO,
        anisotropy: 0.0,
        bounds: Some(Bounds3 { min: DVec3::splat(-4.0), max: DVec3::new(4.0, 1.5, 4.0) }),
    };
    let at = |eye: DVec3, world: World| Job {
        world,
        camera: Camera::new(&pose((eye.x, eye.y, eye.z), (0.0, 0.0, 0.0)), 1e-3, 1, 1).unwrap(),
        settings: Settings { width: 1, height: 1, spp: 1024, ..Settings::default() },
    };
    let eye = DVec3::new(0.4, 2.4, 0.2);
    let big = [[-1.5, -0.5], [1.0, -0.5], [1.0, 1.5], [-1.5, 1.5]];
    let corners = big.map(|[x, z]| DVec3::new(x, 1.2, z));
    let lamp = Light::Quad(QuadLight { corners, radiance: Rgb::ONE, two_sided: false });
    for extinction in [0.2, 1.0, 3.0] {
        let fog = absorbing(extinction);
        let irradiance: f64 = grid(200)
            .map(|[u, v]| DVec3::new(2.5 * u - 1.5, 1.2, 2.0 * v - 0.5))
            .map(|q| {
                let (d2, cos) = (q.length_squared(), q.y / q.length());
                5.0 / 4e4 * cos * cos / d2 * left(&fog, DVec3::ZERO, q)
            })
            .sum();
        let camera = left(&fog, DVec3::ZERO, eye);
        let mut lit = plate(Material::diffuse("white", Rgb::ONE), 5.0);
        lit.lights.push(lamp.clone());
        lit.fog = Some(fog.clone());
        // The lamp must not hide the plate.
        let seen_from_below = at(DVec3::new(2.0, 0.9, 2.2), lit.clone());
        let (film, _) = render(&seen_from_below);
        let camera_below = left(&fog, DVec3::ZERO, DVec3::new(2.0, 0.9, 2.2));
        let expected = irradiance / PI * camera_below;
        let found = f64::from(film.rgb[0].x);
        println!("extinction {extinction}: {found:.3e} for {expected:.3e}");
        // A lamp of 2.5 units is dimmed by the mean over 16 of its points.
        let tolerance = 1e-3 + 2e-3 * extinction;
        assert!((found / expected - 1.0).abs() < tolerance, "{extinction}: {found} for {expected}");

        // A sky through a layer of fog: the integral over the cosine to the normal.
        let mut open = plate(Material::diffuse("white", Rgb::ONE), 1.0);
        open.sky.radiance = Rgb::ONE;
        let wide = Bounds3 { min: DVec3::splat(-1e4), max: DVec3::new(1e4, 1.5, 1e4) };
        open.fog = Some(Fog { bounds: Some(wide), ..fog.clone() });
        let n = 100_000;
        let cos = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
        let through = |k| 2.0 * cos(k) * (-extinction * 1.5 / cos(k)).exp() / f64::from(n);
        let expected = (0..n).map(through).sum::<f64>() * camera;
        let (film, _) = render(&at(eye, open));
        let found = f64::from(film.rgb[0].x);
        println!("extinction {extinction}, sky: {found:.6} for {expected:.6}");
        assert!((found / expected - 1.0).abs() < 2e-2, "{extinction}: {found} for {expected}");
    }
}

/// Glass keeps fog out, and mirrors show it.
#[test]
fn paths_lose_light_outside_of_glass_alone() {
    let everywhere = Fog { bounds: None, albedo: Rgb::ZERO, extinction: 0.5, ..fog() };
    let render_of = |material: Material| {
        let mut world = World::default();
        world.sky.radiance = Rgb::ZERO;
        let ball = world.add_material(material);
        world.spheres.push(WorldSphere::new("ball", DVec3::new(EYE.x, EYE.y, 0.0), 1.0, ball));
        let glow = world
            .add_material(Material { emission: Rgb::ONE, ..Material::diffuse("glow", Rgb::ZERO) });
        // Both face the ball.
        for (z, x) in [(WALL, 9.0), (7.0, -9.0)] {
            let corners = [[-x, -9.0], [x, -9.0], [x, 9.0], [-x, 9.0]];
            world.meshes.push(quad(corners.map(|[x, y]| DVec3::new(x, y, z)), glow));
        }
        world.fog = Some(everywhere.clone());
        f64::from(render(&one_pixel(world, 16)).0.rgb[0].x)
    };
    // Through the middle of a ball of index 1: five units of fog before it and three behind, less its own radius.
    let found = render_of(Material::glass("air", 1.0));
    assert!((found - (-0.5f64 * 7.0).exp()).abs() < 1e-4, "{found}");
    // To the mirror and back to the wall behind the camera.
    let found = render_of(Material::mirror("mirror", Rgb::ONE));
    assert!((found - (-0.5f64 * (4.0 + 6.0)).exp()).abs() < 1e-4, "{found}");
}

fn small_lamps() -> World {
    let mut world = world(fog());
    for k in 0..24 {
        let angle = f64::from(k) * 2.4;
        let position = DVec3::new(
            1.5 * angle.cos(),
            0.3 + 0.1 * f64::from(k % 7),
            1.8 * angle.sin() - 0.3 * f64::from(k % 3),
        );
        let intensity = Rgb::splat(0.05 + 0.04 * (k % 5) as f32);
        world.lights.push(Light::Point(PointLight { position, intensity }));
    }
    world
}

#[test]
fn samples_that_choose_lights_find_what_all_samples_find() {
    let mut job = one_pixel(small_lamps(), 16_384);
    let (chosen, few) = render(&job);
    job.settings.all_lights = true;
    let (all, many) = render(&job);
    let [chosen, all] = [chosen, all].map(|film| f64::from(film.rgb[0].x));
    println!("{chosen:.6} for {all:.6}");
    assert!((chosen / all - 1.0).abs() < 5e-3, "{chosen} for {all}");
    assert!(few[RayKind::ShadowFog] < many[RayKind::ShadowFog]);
}

#[test]
fn both_intersectors_and_every_kernel_agree() {
    let mut world = small_lamps();
    let red = world.add_material(Material::diffuse("red", Rgb::new(0.7, 0.1, 0.1)));
    world.spheres.push(WorldSphere::new("ball", DVec3::new(0.0, -0.3, 1.0), 0.8, red));
    world.sky.radiance = Rgb::splat(0.1);
    let mut job = common::job(world, pose((EYE.x, EYE.y, EYE.z), (0.0, 0.0, 0.0)), 40, 30);
    let (embree, rays) = render(&job);
    let scene = job.world.clone().into_scene(true).unwrap();
    let (every, same) = render_with_every_effect(&scene, &job);
    assert_eq!((&every.rgb, same), (&embree.rgb, rays));
    job.settings.intersector = IntersectorKind::Oracle;
    let (oracle, _) = render_scene(&scene, &job);
    let apart =
        embree.rgb.iter().zip(&oracle.rgb).filter(|(a, b)| (**a - **b).abs().max_element() > 1e-3);
    let count = apart.count();
    assert!(count <= 6, "{count} of 1200 pixels");
    assert!(mean(&embree) > 0.01);
}

#[test]
fn fog_that_is_unlit_only_takes() {
    let mut world = small_lamps();
    world.fog = Some(fog());
    let mut job = one_pixel(world, 1);
    job.settings.fog_samples = 0;
    let (film, rays) = render(&job);
    assert_eq!((film.rgb[0], rays[RayKind::ShadowFog]), (Rgb::ZERO, 0));
}
