//! Light straight through glass against closed forms.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "shows what it measured")]

mod common;
#[path = "common/moves.rs"]
mod moves;

use common::{Job, cube, plate, pose, quad, render, render_scene, uv_sphere};
use moves::{Set, codes};
use std::f64::consts::PI;
use std::path::Path;
use tweenray::math::{Bounds3, DVec3, Rgb};
use tweenray::reuse;
use tweenray::reuse::evidence::ProbeFindings;
use tweenray::reuse::store::{Compatibility, ReferenceRecord, decode};
use tweenray::scene::{
    Camera, CameraPath, DirectionalLight, Environment, EnvironmentKind, Fog, Glass, GlassShadows,
    IntersectorKind, KeyPose, Light, Material, PointLight, QuadLight, Settings, Shot, SkyGradient,
    World, WorldSphere,
};
use tweenray::shade::{FrameJob, Reuse, optics};
use tweenray::stats::{RayKind, ReuseCounts};

const TINT: Rgb = Rgb::new(0.9, 0.5, 0.2);

fn glass(glass: Glass) -> Material {
    Material { glass: Some(glass), ..Material::glass("glass", 1.5) }
}

fn pane(tint: Rgb) -> Material {
    glass(Glass { tint, thin: true, ..Glass::clear(1.5) })
}

/// A white plate with `above` over it, seen from the side below that.
fn world(above: Option<(Material, bool)>) -> World {
    let mut world = plate(Material::diffuse("white", Rgb::ONE), 4.0);
    if let Some((material, is_body)) = above {
        let id = world.add_material(material);
        world.meshes.push(match is_body {
            true => {
                let mut slab = cube(DVec3::new(0.0, 2.0, 0.0), 0.5, id);
                slab.positions.iter_mut().for_each(|p| *p *= DVec3::new(20.0, 1.0, 20.0));
                slab
            }
            false => {
                let corners = [[-9.0, 9.0], [9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]];
                quad(corners.map(|[x, z]| DVec3::new(x, 2.0, z)), id)
            }
        });
    }
    world
}

fn job(world: World) -> Job {
    let camera = Camera::new(&pose((2.0, 1.0, 0.3), (0.0, 0.0, 0.0)), 1e-3, 1, 1).unwrap();
    let glass_shadows = GlassShadows::Straight;
    Job {
        world,
        camera,
        settings: Settings { width: 1, height: 1, spp: 256, glass_shadows, ..Settings::default() },
    }
}

fn sun(cos: f64) -> Light {
    let to_light = DVec3::new((1.0 - cos * cos).sqrt(), cos, 0.0);
    Light::Directional(DirectionalLight { to_light, irradiance: Rgb::splat(2.0) })
}

fn close(found: Rgb, expected: Rgb, tolerance: f32) {
    let error = ((found - expected) / expected.max(Rgb::splat(1e-6))).abs().max_element();
    assert!(error < tolerance, "{found} for {expected}");
}

#[test]
fn panes_and_bodies_take_fresnel_tint_and_absorption() {
    let absorption = Rgb::new(0.1, 0.7, 2.0);
    let body = Glass { tint: TINT, absorption, ..Glass::clear(1.5) };
    for cos in [1.0, 0.8, 0.3] {
        let open = Rgb::splat((2.0 * cos / PI) as f32);
        let through = |material, is_body| {
            let mut world = world(Some((material, is_body)));
            world.lights.push(sun(cos));
            let mut job = job(world);
            let (film, rays) = render(&job);
            assert!(rays[RayKind::ThroughGlass] > 0);
            job.settings.intersector = IntersectorKind::Oracle;
            let scene = job.world.clone().into_scene(true).unwrap();
            close(render_scene(&scene, &job).0.rgb[0], film.rgb[0], 1e-5);
            job.settings.glass_shadows = GlassShadows::Opaque;
            let (opaque, rays) = render_scene(&scene, &job);
            assert_eq!((opaque.rgb[0], rays[RayKind::ThroughGlass]), (Rgb::ZERO, 0));
            film.rgb[0]
        };
        let found = through(pane(TINT), false);
        let expected = open * TINT * (1.0 - optics::pane_reflectance(cos, 1.5)) as f32;
        println!("cosine {cos}, pane: {found} for {expected}");
        close(found, expected, 1e-5);
        let found = through(glass(body), true);
        let faces = (1.0 - optics::reflectance(cos, 1.5)).powi(2) as f32;
        let expected = open * TINT * TINT * faces * (absorption * (-1.0 / cos) as f32).exp();
        println!("cosine {cos}, slab: {found} for {expected}");
        close(found, expected, 1e-4);
    }
}

/// Light of a lamp in a body is absorbed on its way out.
#[test]
fn a_lamp_inside_of_a_body_lights_through_it() {
    let absorption = Rgb::new(0.1, 1.0, 3.0);
    let lit = |absorption| {
        let mut world = world(None);
        let material = glass(Glass { absorption, ..Glass::clear(1.5) });
        let material = world.add_material(material);
        let (centre, radius) = (DVec3::new(0.0, 2.0, 0.0), 1.0);
        let name = "body".to_owned();
        world.spheres.push(WorldSphere { name, centre, radius, material, always_traced: false });
        let lamp = PointLight { position: centre, intensity: Rgb::splat(4.0) };
        world.lights.push(Light::Point(lamp));
        render(&job(world)).0.rgb[0]
    };
    let (clear, amber) = (lit(Rgb::ZERO), lit(absorption));
    println!("a lamp in a body: {} of {clear}", amber / clear);
    close(amber, clear * (-absorption).exp(), 1e-4);
}

/// No ray of a lobe ends on lights without a surface, so that their own rays go through polished glass. Rough glass has a lobe of its own.
#[test]
fn highlights_of_lights_without_a_surface_go_through() {
    let position = DVec3::new(-2.0, 5.0, 0.3);
    let point = Light::Point(PointLight { position, intensity: Rgb::splat(30.0) });
    // Many of them are drawn by samples.
    let many = vec![Light::Point(PointLight { position, intensity: Rgb::splat(1.0) }); 30];
    for lights in [vec![point], vec![sun(0.8)], many] {
        let lit = |above: Option<(Material, bool)>| {
            let mut world = world(above);
            world.materials[0].diffuse = Rgb::ZERO;
            world.materials[0].mirror = Rgb::ONE;
            world.materials[0].roughness = 0.7;
            world.lights = lights.clone();
            render(&job(world)).0.rgb[0]
        };
        // It reflects nothing, so that no light goes to and fro.
        let pane = glass(Glass { tint: TINT, thin: true, ..Glass::clear(1.0) });
        let (open, behind) = (lit(None), lit(Some((pane, false))));
        let share = behind / open;
        println!("a highlight behind a pane: {share}");
        assert!(open.x > 0.0);
        close(share, TINT, 1e-4);
        let frosted = |glass_shadows| {
            let frost = Glass { roughness: 0.3, thin: true, ..Glass::clear(1.5) };
            let mut world = world(Some((glass(frost), false)));
            world.materials[0] = Material {
                diffuse: Rgb::ZERO,
                mirror: Rgb::ONE,
                roughness: 0.7,
                ..world.materials[0].clone()
            };
            world.lights = lights.clone();
            let mut job = job(world);
            job.settings.glass_shadows = glass_shadows;
            render(&job).0.rgb[0]
        };
        assert_eq!(frosted(GlassShadows::Straight), frosted(GlassShadows::Opaque));
    }
}

#[test]
fn every_kind_of_light_goes_through() {
    let corners = [[-0.7, 0.7], [0.7, 0.7], [0.7, -0.7], [-0.7, -0.7]];
    let corners = corners.map(|[x, z]| DVec3::new(x, 4.0, z)).map(|p| p.with_x(-p.x));
    let lamp = Light::Quad(QuadLight { corners, radiance: Rgb::splat(5.0), two_sided: true });
    let gradient =
        SkyGradient { zenith: Rgb::splat(1.5), horizon: Rgb::splat(0.9), ground: Rgb::ZERO };
    let mut lit = [(); 3].map(|()| world(None));
    lit[0].lights.push(lamp);
    lit[1].sky.radiance = Rgb::splat(0.7);
    lit[2].environment = Some(Environment::new(EnvironmentKind::Gradient(gradient)));
    for (k, open) in lit.into_iter().enumerate() {
        let mut behind = open.clone();
        let above = world(Some((pane(TINT), false)));
        let id = behind.add_material(pane(TINT));
        behind.meshes.extend(above.meshes.into_iter().skip(1).map(|mut mesh| {
            mesh.material = id;
            mesh
        }));
        let [open, behind] = [open, behind].map(|world| render(&job(world)).0.rgb[0]);
        // Grey light takes the colour of the pane; beside it some gets in below the pane from skies.
        let share = behind / open;
        println!("light {k}: {share} of {open}");
        assert!(share.x < 0.9 && share.x > 0.6, "{k}: {share}");
        match k {
            0 => close(share / share.x, TINT / TINT.x, 1e-3),
            _ => assert!(share.x > share.y && share.y > share.z, "{k}: {share}"),
        }
    }
}

#[test]
fn fog_is_lit_through_glass() {
    let lit = |tint: Option<Rgb>| {
        let mut world = world(tint.map(|tint| (pane(tint), false)));
        world.materials[0] = Material::diffuse("black", Rgb::ZERO);
        world.lights.push(sun(1.0));
        let bounds = Some(Bounds3 { min: DVec3::splat(-3.0), max: DVec3::splat(1.9) });
        world.fog = Some(Fog { extinction: 0.2, albedo: Rgb::ONE, anisotropy: 0.0, bounds });
        render(&job(world)).0.rgb[0]
    };
    let share = lit(Some(TINT)) / lit(None);
    close(share, TINT * (1.0 - optics::pane_reflectance(1.0, 1.5)) as f32, 1e-4);
}

/// What lights a scene.
#[derive(Default)]
struct Lit {
    lights: Vec<Light>,
    sky: Rgb,
    environment: Option<Environment>,
}

/// A floor under panes of glass, past which a camera moves.
fn below_panes(lit: Lit, floor: Rgb, tint: Rgb) -> Set {
    let mut world = plate(Material::diffuse("floor", floor), 6.0);
    let coloured = world.add_material(pane(tint));
    for x in [-2.4, -1.2, 0.0, 1.2, 2.4] {
        let [west, east] = [x - 0.4, x + 0.4];
        let corners = [[west, 0.4], [east, 0.4], [east, -0.4], [west, -0.4]];
        world.meshes.push(quad(corners.map(|[x, z]| DVec3::new(x, 1.5, z)), coloured));
    }
    // Out of sight, so that a shadow ray counts as dear enough to be saved.
    let mut ball = uv_sphere(600, 400);
    ball.positions.iter_mut().for_each(|p| p.y -= 9.0);
    world.meshes.push(ball);
    (world.lights, world.sky.radiance, world.environment) = (lit.lights, lit.sky, lit.environment);
    let key = |at: f64, x: f64| KeyPose { at, pose: pose((x, 1.2, 4.0), (x, 0.0, 0.0)) };
    Set::of(world, Shot::new(CameraPath::Keys(vec![key(0.0, -0.2), key(1.0, 0.2)]), 9, 40.0))
}

/// A lamp above the panes, of this half width.
fn lamp(x: f64, half: f64, radiance: Rgb) -> Light {
    let corners = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
    let corners = corners.map(|[u, v]| DVec3::new(x + half * u, 3.0, half * v));
    Light::Quad(QuadLight { corners, radiance, two_sided: true })
}

fn lamps(radiance: Rgb) -> Lit {
    let lights = (0..24).map(|k| lamp(-4.6 + 0.4 * f64::from(k), 0.1, radiance)).collect();
    Lit { lights, ..Lit::default() }
}

fn straight(set: &Set, size: (u32, u32)) -> Settings {
    let own = set.settings(size, 1, 16);
    Settings { glass_shadows: GlassShadows::Straight, ..own }
}

#[test]
fn inferred_light_has_the_colour_that_glass_gives_it() {
    let grey = Rgb::splat(0.5);
    let gradient = SkyGradient { zenith: grey, horizon: 0.5 * grey, ground: Rgb::ZERO };
    let gradient = Environment::new(EnvironmentKind::Gradient(gradient));
    let one = Lit { lights: vec![lamp(0.0, 0.8, Rgb::splat(5.0))], ..Lit::default() };
    let sky = || Lit { sky: grey, ..Lit::default() };
    let outside = Lit { environment: Some(gradient), ..Lit::default() };
    let dim = Rgb::new(12.0, 9.0, 0.0);
    let [red, yellow, blue] =
        [[1.0, 0.02, 0.02], [1.0, 1.0, 0.02], [0.02, 0.02, 1.0]].map(Rgb::from_array);
    let white = Rgb::splat(0.6);
    let sets = [
        ("lamp, red", one, white, red),
        ("sky, red", sky(), white, red),
        ("sky, yellow", sky(), white, yellow),
        ("sky, blue", sky(), white, blue),
        ("lamps, red", lamps(Rgb::splat(12.0)), white, red),
        ("lamps on red, red", lamps(Rgb::splat(12.0)), Rgb::new(0.6, 0.0, 0.0), red),
        ("yellow lamps, red", lamps(dim), white, red),
        ("gradient, red", outside, white, red),
    ];
    for (name, lit, floor, tint) in sets {
        let set = below_panes(lit, floor, tint);
        let settings = straight(&set, (96, 64));
        let stage = set.stage(2);
        let frames: Vec<u32> = (1..=9).collect();
        let made = stage.frames(&settings, &set.shot, &frames);
        let (mut error, mut counts) = (DVec3::ZERO, ReuseCounts::default());
        for (frame, made) in frames.iter().zip(&made).skip(1).step_by(3) {
            counts += made.reuse;
            let truth = stage.converged(&settings, &set.shot, *frame, 256);
            let [own, truth] = [&made.film, &truth].map(|film| codes(&settings, film));
            let pixels = own.len() as f64 / 255.0;
            let off = own.iter().zip(&truth).map(|(a, b)| DVec3::from(*a) - DVec3::from(*b));
            error += off.sum::<DVec3>() / pixels / 3.0;
        }
        let inferred = counts.direct_inferred as f64 / counts.direct as f64;
        println!("{name}: {error:.3} of 255, {inferred:.2} inferred");
        assert!(inferred > 0.2, "{name}: {inferred}");
        assert!(error.abs().max_element() < 0.12, "{name}: {error}");
    }
}

#[test]
fn what_is_kept_behind_coloured_glass_can_be_read_back() {
    let one = Lit { lights: vec![lamp(0.0, 0.8, Rgb::splat(5.0))], ..Lit::default() };
    let set = below_panes(one, Rgb::splat(0.6), TINT);
    let settings = straight(&set, (96, 64));
    let channels = reuse::channels(&set.scene, &settings);
    assert_eq!((channels.len(), channels.colours()), (3, 3));
    let camera = &set.shot.camera(1, 96, 64).unwrap();
    let stage = set.stage(2);
    let kept = Reuse { channels: &channels, inference: None, is_source: true };
    let job = FrameJob { reuse: Some(kept), ..FrameJob::whole(camera, 1) };
    let traced = &stage.renderer(&settings).render_job(&job, &stage.stop, &()).unwrap().sources;
    let colours = traced.ratios.chunks(3).filter(|ratios| ratios[0] > ratios[2] + 0.1);
    assert!(colours.count() > 100);
    let terms = &Compatibility::of("world", &channels, &settings);
    let (crop, findings, settings) = (None, &ProbeFindings::default(), "");
    let record = ReferenceRecord { terms, frame: 1, camera, crop, traced, findings, settings };
    let bytes = record.encode().expect("few");
    let recentring = &set.scene.recentring;
    decode(Path::new("frame"), &bytes, terms, recentring, 96 * 64).expect("undamaged");
}

#[test]
fn lamps_that_all_count_leave_no_tail() {
    let far = |k: i32| {
        let light = lamp(40.0 * f64::from(k - 4), 20.0, Rgb::splat(0.1));
        let Light::Quad(mut quad) = light else { panic!("a quad") };
        quad.corners.iter_mut().for_each(|corner| corner.y = 400.0);
        Light::Quad(quad)
    };
    for tint in [Rgb::splat(0.5), TINT] {
        let lit = Lit { lights: (0..9).map(far).collect(), sky: Rgb::splat(0.1), ..Lit::default() };
        let set = below_panes(lit, Rgb::splat(0.6), tint);
        let settings = straight(&set, (48, 32));
        let stage = set.stage(2);
        let made = stage.frames(&settings, &set.shot, &[4]);
        assert!(made[0].reuse.direct > 0);
    }
}
