//! Normal maps against closed forms: what arrives, what is reflected, and what never is.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Job, job, pose, render};
use std::f64::consts::{FRAC_1_PI, PI};
use tweenray::film::Film;
use tweenray::math::{DAffine2, DVec2, DVec3, Rgb, Vec2};
use tweenray::scene::{
    Corners, DirectionalLight, Environment, EnvironmentKind, Fresnel, IntersectorKind, Light,
    Material, NormalMap, PointLight, QuadLight, Sky, SkyGradient, SphereLight, Texture, TextureMap,
    World, WorldMesh, WorldSphere, Wrap,
};

const BOTH: [IntersectorKind; 2] = [IntersectorKind::Embree, IntersectorKind::Oracle];

/// An image that holds the normal `n` of tangent space everywhere.
fn even(n: DVec3) -> Texture {
    let code = |c: f64| ((c + 1.0) / 2.0 * 65_535.0).round() as u16;
    Texture::from_vectors16("even", [2, 2], vec![n.to_array().map(code); 4])
}

/// Bumps in all directions, up to level ones.
fn bumps() -> Texture {
    let texel = |i: u32| {
        let angle = f64::from(i * 37 % 64) / 64.0 * 2.0 * PI;
        let height = f64::from(i * 53 % 31) / 30.0;
        let level = (1.0 - height * height).sqrt();
        let n = [level * angle.cos(), level * angle.sin(), height];
        n.map(|c| ((c + 1.0) / 2.0 * 255.0).round() as u8)
    };
    Texture::from_vectors8("bumps", [16, 16], (0..256).map(texel).collect())
}

/// A plate in the plane y = 0 with u along x and v along -z.
fn plate(material: Material, image: Texture) -> World {
    let normal_map = Some(NormalMap { image: TextureMap::of(0), strength: 1.0 });
    let mut world = World::default();
    world.textures.push(image);
    world.materials.push(Material { normal_map, ..material });
    let corners = [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)];
    let mesh = common::quad(corners.map(|(x, z)| DVec3::new(x, 0.0, z)), 0);
    let uv = |p: &DVec3| Vec2::new(p.x as f32, -p.z as f32);
    let values = mesh.positions.iter().map(uv).collect();
    world.meshes.push(WorldMesh { uvs: Some(Corners { values, corners: None }), ..mesh });
    world
}

fn white() -> Material {
    Material::diffuse("white", Rgb::splat(0.5))
}

fn looking(world: World, kind: IntersectorKind) -> Job {
    let mut job = job(world, pose((-0.6, 2.0, 0.7), (0.0, 0.0, 0.0)), 24, 18);
    job.settings.intersector = kind;
    job
}

fn extremes(film: &Film) -> (f32, f32) {
    let all = film.rgb.iter().map(|c| c.y);
    (all.clone().fold(f32::INFINITY, f32::min), all.fold(0.0, f32::max))
}

/// The mapped normal of an even image, world space: red along x, green along -z, blue along y.
fn in_world(n: DVec3) -> DVec3 {
    DVec3::new(n.x, n.z, -n.y)
}

#[test]
fn a_tilted_normal_receives_what_a_tilted_surface_does() {
    for kind in BOTH {
        for n in
            [DVec3::Z, DVec3::new(0.3, 0.0, 1.0), DVec3::new(-0.1, 0.4, 0.8)].map(DVec3::normalize)
        {
            let tilted = in_world(n);
            let to_light = DVec3::new(0.2, 1.0, 0.1).normalize();
            let mut world = plate(white(), even(n));
            let irradiance = Rgb::splat(3.0);
            world.lights.push(Light::Directional(DirectionalLight { to_light, irradiance }));
            let (low, high) = extremes(&render(&looking(world, kind)).0);
            let expected = 0.5 * FRAC_1_PI * 3.0 * to_light.dot(tilted);
            let is_near = |found: f32| (f64::from(found) / expected - 1.0).abs() < 2e-4;
            assert!(is_near(low) && is_near(high), "{kind:?} {n}: {low} to {high} for {expected}");

            let (position, intensity) = (DVec3::new(0.3, 2.5, -0.2), Rgb::splat(4.0));
            let mut world = plate(white(), even(n));
            world.lights.push(Light::Point(PointLight { position, intensity }));
            let job = looking(world, kind);
            for (x, y, rgb) in common::pixels(&render(&job).0) {
                let to_light = position - common::on_plane_y(&job, x, y, 0.0);
                let cos = to_light.normalize().dot(tilted);
                let expected = 0.5 * FRAC_1_PI * 4.0 * cos / to_light.length_squared();
                // The sample lies within a half of the pixel's middle.
                let off = f64::from(rgb.y) / expected - 1.0;
                assert!(off.abs() < 0.03, "{kind:?} {n} at {x} {y}: {rgb} for {expected}");
            }
        }
    }
}

#[test]
fn an_area_light_and_the_sky_shine_on_the_tilted_normal() {
    let n = DVec3::new(0.3, 0.2, 1.0).normalize();
    for kind in BOTH {
        let mut world = plate(white(), even(n));
        let (centre, radius) = (DVec3::new(0.5, 30.0, -3.0), 1.0);
        world.lights.push(Light::Sphere(SphereLight {
            centre,
            radius,
            radiance: Rgb::splat(900.0),
        }));
        let film = render(&looking(world, kind)).0;
        // Far away and wholly above: π r² / d² times the cosine; nothing is in the way, so nothing is noisy.
        let expected = 0.5 * 900.0 * centre.normalize().dot(in_world(n)) / centre.length_squared();
        let (low, high) = extremes(&film);
        let is_near = |found: f32| (f64::from(found) / expected - 1.0).abs() < 0.05;
        assert!(is_near(low) && is_near(high), "{kind:?}: {low} to {high} for {expected}");

        let mut world = plate(white(), even(n));
        world.sky = Sky { radiance: Rgb::ONE, lights: true, ..Sky::default() };
        let (low, high) = extremes(&render(&looking(world, kind)).0);
        // What of the hemisphere over the tilted normal lies over the plate.
        let expected = 0.5 * 0.5 * (1.0 + n.z) as f32;
        assert!((low / expected - 1.0).abs() < 1e-4 && (high / expected - 1.0).abs() < 1e-4);
    }
}

/// Light from below the surface, or level with it, lights nothing, however the normal is tilted towards it.
#[test]
fn no_light_comes_from_behind_the_surface() {
    let n = DVec3::new(0.9, 0.0, 0.2).normalize();
    let sun = |height: f64| {
        let to_light = DVec3::new(1.0, height, 0.0).normalize();
        Light::Directional(DirectionalLight { to_light, irradiance: Rgb::ONE })
    };
    let lamp = |height: f64| {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(y, z)| DVec3::new(9.0, height + y, z));
        Light::Quad(QuadLight { corners, radiance: Rgb::splat(5.0), two_sided: true })
    };
    let brightest = |light: Light, kind| {
        let mut world = plate(white(), even(n));
        world.lights.push(light);
        extremes(&render(&looking(world, kind)).0).1
    };
    for kind in BOTH {
        for light in [sun(0.0), sun(-0.1), sun(-3.0), lamp(-1.01), lamp(-5.0)] {
            assert_eq!(brightest(light, kind), 0.0);
        }
        // It sinks, it is not cut off.
        let sinking: Vec<f32> = [0.15, 0.1, 0.05, 0.01].map(|h| brightest(sun(h), kind)).to_vec();
        assert!(sinking.windows(2).all(|pair| pair[0] > pair[1] && pair[1] > 0.0), "{sinking:?}");
        assert!(sinking[3] < 0.1 * sinking[0], "{sinking:?}");
    }
}

/// What a mirror or rough mirror reflects lies above the surface.
#[test]
fn reflected_rays_never_go_into_the_surface() {
    for roughness in [0.0, 0.3] {
        let mut world = plate(Material { roughness, ..Material::mirror("m", Rgb::ONE) }, bumps());
        world.sky = Sky { radiance: Rgb::ZERO, ..Sky::default() };
        // All that shines lies below.
        let glow =
            Material { emission: Rgb::splat(9.0), emits_back: true, ..Material::black("glow") };
        let glow = world.add_material(glow);
        world.spheres.push(WorldSphere::new("cellar", DVec3::new(0.0, -60.0, 0.0), 50.0, glow));
        for kind in BOTH {
            let mut job = looking(world.clone(), kind);
            job.settings.spp = 16;
            let film = render(&job).0;
            assert_eq!((extremes(&film).1, film.bad.total()), (0.0, 0));
        }
    }
}

/// A mirror in an even sky shows it, a white surface no more than it.
#[test]
fn a_furnace_shows_no_bumps_in_mirrors_and_no_gain_anywhere() {
    for kind in BOTH {
        let furnace = |material: Material, spp| {
            let mut world = plate(material, bumps());
            world.sky = Sky { radiance: Rgb::ONE, lights: true, ..Sky::default() };
            let mut job = looking(world, kind);
            job.settings.spp = spp;
            let film = render(&job).0;
            assert_eq!(film.bad.total(), 0);
            film
        };
        let mean = |film: &Film| {
            film.rgb.iter().map(|c| f64::from(c.y)).sum::<f64>() / film.rgb.len() as f64
        };
        assert_eq!(extremes(&furnace(Material::mirror("m", Rgb::ONE), 1)), (1.0, 1.0));
        for roughness in [0.1, 0.4, 0.7, 1.0] {
            let rough = Material { roughness, ..Material::mirror("m", Rgb::ONE) };
            let mean = mean(&furnace(rough, 64));
            // A lobe cut off at the horizon of a tilted normal loses light.
            assert!(mean < 1.002 && mean > 0.9, "{kind:?} {roughness}: {mean}");
        }
        let (low, high) = extremes(&furnace(Material::diffuse("w", Rgb::ONE), 4));
        assert!(low > 0.5 && high < 1.000_1, "{kind:?}: {low} to {high}");
    }
}

/// Without strength a map says nothing; an image that is turned on the surface turns its normals.
#[test]
fn strength_and_placement_count() {
    let to_light = DVec3::new(0.4, 1.0, 0.0).normalize();
    let lit = |n: DVec3, change: &dyn Fn(&mut NormalMap)| {
        let mut world = plate(white(), even(n.normalize()));
        change(world.materials[0].normal_map.as_mut().unwrap());
        world.lights.push(Light::Directional(DirectionalLight { to_light, irradiance: Rgb::ONE }));
        let (low, high) = extremes(&render(&looking(world, IntersectorKind::Embree)).0);
        assert!(high / low < 1.0001);
        f64::from(low) / (0.5 * FRAC_1_PI)
    };
    let is_that_of = |found: f64, tilted: DVec3| {
        let tilted = tilted.normalize();
        // Dimmed a little, since the light is lower over the plate than over the normal.
        let g = (to_light.y / (to_light.dot(tilted) * tilted.y)).min(1.0);
        let expected = to_light.dot(tilted) * (g + g * g - g * g * g);
        assert!((found - expected).abs() < 2e-4, "{found} {expected}");
    };
    let n = DVec3::new(0.5, 0.0, 1.0);
    is_that_of(lit(n, &|_| ()), DVec3::new(0.5, 1.0, 0.0));
    is_that_of(lit(n, &|map| map.strength = 0.0), DVec3::Y);
    is_that_of(lit(n, &|map| map.strength = 0.5), DVec3::new(0.25, 1.0, 0.0));
    // Turned by 90 degrees: the image's u is the surface's -v, which is z, and its v the surface's u.
    let turned = |map: &mut NormalMap| map.image.transform = DAffine2::from_angle(0.5 * PI);
    is_that_of(lit(n, &turned), DVec3::new(0.0, 1.0, 0.5));
    is_that_of(lit(DVec3::new(0.0, 0.5, 1.0), &turned), DVec3::new(0.5, 1.0, 0.0));
    let mirrored = |map: &mut NormalMap| {
        map.image.transform = DAffine2::from_scale(DVec2::new(-3.0, 1.0));
    };
    is_that_of(lit(n, &mirrored), DVec3::new(-0.5, 1.0, 0.0));
    let within = |place| DAffine2::from_scale_angle_translation(DVec2::splat(0.01), 0.0, place);
    // The second copy of an image that is mirrored at its edges.
    let second = |map: &mut NormalMap| {
        map.image.wrap = [Wrap::Mirror; 2];
        map.image.transform = within(DVec2::new(1.5, 0.5));
    };
    is_that_of(lit(n, &second), DVec3::new(-0.5, 1.0, 0.0));
    let third = |map: &mut NormalMap| {
        map.image.wrap = [Wrap::Mirror; 2];
        map.image.transform = within(DVec2::new(2.5, -3.5));
    };
    is_that_of(lit(n, &third), DVec3::new(0.5, 1.0, 0.0));
}

/// On an exact sphere u grows with the longitude, v with the latitude.
#[test]
fn spheres_have_the_frame_of_longitude_and_latitude() {
    for kind in BOTH {
        let n = DVec3::new(0.2, 0.3, 1.0).normalize();
        let mut world = World::default();
        world.textures.push(even(n));
        let normal_map = Some(NormalMap { image: TextureMap::of(0), strength: 1.0 });
        world.materials.push(Material { normal_map, ..white() });
        world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
        let to_light = DVec3::new(0.1, 0.2, 1.0).normalize();
        world.lights.push(Light::Directional(DirectionalLight { to_light, irradiance: Rgb::ONE }));
        let mut job = job(world, pose((0.0, 0.0, 60.0), (0.0, 0.0, 0.0)), 33, 33);
        job.settings.intersector = kind;
        let middle = render(&job).0.rgb[33 * 16 + 16].y;
        // In the middle of the image: u along x, v along y.
        let expected = 0.5 * FRAC_1_PI * to_light.dot(n);
        assert!((f64::from(middle) / expected - 1.0).abs() < 0.03, "{kind:?}: {middle} {expected}");
    }
}

/// A clear coat follows its own image of normals, and no other: with it a coat over black is the mirror of plastic with
/// that image, without it the coat of a smooth mesh.
#[test]
fn a_coat_has_normals_of_its_own() {
    let bare = Fresnel { grazing: 0.0, ..Fresnel::PLASTIC };
    let coat = |roughness| Fresnel { clearcoat: 1.0, clearcoat_roughness: roughness, ..bare };
    let map = || Some(NormalMap { image: TextureMap::of(0), strength: 1.0 });
    for (kind, roughness) in BOTH.into_iter().flat_map(|kind| [(kind, 0.0), (kind, 0.3)]) {
        let film = |fresnel: Fresnel, [base, of_coat]: [Option<NormalMap>; 2]| {
            let mirror = Rgb::splat(if fresnel.grazing == 0.0 { 0.0 } else { 0.04 });
            let black = Material { mirror, roughness, ..Material::black("black") };
            let fresnel = Fresnel { clearcoat_normal_map: of_coat, ..fresnel };
            let mut world = plate(Material { fresnel: Some(fresnel), ..black }, bumps());
            world.materials[0].normal_map = base;
            let lamp = Material { emission: Rgb::splat(20.0), ..Material::black("lamp") };
            let lamp = world.add_material(lamp);
            world.spheres.push(WorldSphere::new("lamp", DVec3::new(0.5, 3.0, -1.0), 0.8, lamp));
            world.sky = Sky { radiance: Rgb::new(0.2, 0.3, 0.5), ..Sky::default() };
            let mut job = looking(world, kind);
            job.settings.spp = if roughness == 0.0 { 1 } else { 4096 };
            render(&job).0
        };
        let mean = |film: &Film| film.rgb.iter().sum::<Rgb>() / film.rgb.len() as f32;
        let off = |a: &Film, b: &Film| {
            let pixels = a.rgb.iter().zip(&b.rgb);
            match roughness {
                0.0 => pixels.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max),
                _ => ((mean(a) - mean(b)) / mean(b)).abs().max_element(),
            }
        };
        let smooth = film(coat(roughness), [None; 2]);
        let own = film(coat(roughness), [None, map()]);
        let of_plastic = film(Fresnel::PLASTIC, [map(), None]);
        assert!(off(&own, &of_plastic) < 0.01, "{kind:?}: {}", off(&own, &of_plastic));
        assert!(off(&own, &smooth) > 0.05, "{kind:?}: {}", off(&own, &smooth));
        assert_eq!(film(coat(roughness), [map(), None]).rgb, smooth.rgb);
    }
}

/// What lies under a coat follows its own normals, and receives what the coat lets through by the coat's.
#[test]
fn base_and_coat_follow_different_normals() {
    let coat_normal = DVec3::new(0.0, 0.35, 1.0).normalize();
    let film = |base: Rgb, clearcoat: f64, kind| {
        let fresnel = Fresnel {
            clearcoat,
            clearcoat_normal_map: Some(NormalMap { image: TextureMap::of(1), strength: 1.0 }),
            metallic: 1.0,
            ..Fresnel::PLASTIC
        };
        let metal = Material { fresnel: Some(fresnel), ..Material::diffuse("metal", base) };
        let mut world = plate(metal, even(DVec3::new(0.3, 0.0, 1.0).normalize()));
        world.textures.push(even(coat_normal));
        let [zenith, horizon, ground] = [0.1, 1.5, 0.3].map(Rgb::splat);
        let gradient = SkyGradient { zenith, horizon, ground };
        world.environment = Some(Environment::new(EnvironmentKind::Gradient(gradient)));
        let mut job = looking(world, kind);
        // The edges of black metal reflect less than a thousandth.
        job.settings.cutoff = 0.0;
        (render(&job).0, job)
    };
    for kind in BOTH {
        // Metal reflects all light at grazing angles, and black one nothing else.
        let (both, job) = film(Rgb::ONE, 1.0, kind);
        let (metal, _) = film(Rgb::ONE, 0.0, kind);
        let schlick = |cos: f64| 0.04 + 0.96 * (1.0 - cos).powi(5);
        let black = |cos: f64| (1.0 - cos).powi(5);
        let (of_black, _) = film(Rgb::ZERO, 1.0, kind);
        let (edges, _) = film(Rgb::ZERO, 0.0, kind);
        for (i, (x, y, both)) in common::pixels(&both).enumerate() {
            let wo = (job.camera.eye - common::on_plane_y(&job, x, y, 0.0)).normalize();
            let passed = 1.0 - schlick(wo.dot(in_world(coat_normal)));
            // What the coat itself reflects is what black metal under it shows, less the metal's edges.
            let coat = of_black.rgb[i].as_dvec3() - edges.rgb[i].as_dvec3() * passed;
            let expected = metal.rgb[i].as_dvec3() * passed + coat;
            let off = (both.as_dvec3() - expected).abs().max_element();
            assert!(off < 2e-4, "{kind:?} {x} {y}: {both} for {expected}");
            let edge = black(wo.dot(in_world(DVec3::new(0.3, 0.0, 1.0).normalize())));
            let all = f64::from(edges.rgb[i].x / metal.rgb[i].x);
            assert!((all - edge).abs() < 1e-3, "{kind:?} {x} {y}: {all} {edge}");
        }
        assert!(off_by_most(&both, &metal) > 0.02, "the coat is seen");
    }
}

fn off_by_most(a: &Film, b: &Film) -> f32 {
    let pixels = a.rgb.iter().zip(&b.rgb);
    pixels.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max)
}

/// In a furnace no coat shows its normals over white, polished or rough.
#[test]
fn a_furnace_shows_no_gain_under_bumpy_coats() {
    for (clearcoat_roughness, spp) in [(0.0, 4), (0.4, 64)] {
        let normals = NormalMap { image: TextureMap::of(0), strength: 1.0 };
        let fresnel = Fresnel {
            clearcoat: 1.0,
            clearcoat_roughness,
            clearcoat_normal_map: Some(normals),
            ..Fresnel::PLASTIC
        };
        let white = Material { fresnel: Some(fresnel), ..Material::diffuse("white", Rgb::ONE) };
        let mut world = plate(white, bumps());
        world.materials[0].normal_map = None;
        world.sky = Sky { radiance: Rgb::ONE, lights: true, ..Sky::default() };
        let mut job = looking(world, IntersectorKind::Embree);
        job.settings.spp = spp;
        let film = render(&job).0;
        let mean = common::mean(&film);
        assert!(film.bad.total() == 0 && mean < 1.002 && mean > 0.97, "{mean}");
    }
}
