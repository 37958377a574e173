//! Principled materials, plastic, metal and clear coats, against what physics tells.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, mean, pose, render};
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    Corners, Fresnel, Glass, IntersectorKind, Light, Material, PointLight, Sky, SphereLight,
    Texture, TextureMap, World, WorldSphere, Wrap,
};
use tweenray::stats::RayKind;

const PLASTIC: Fresnel = Fresnel::PLASTIC;
const METAL: Fresnel = Fresnel { metallic: 1.0, ..PLASTIC };

fn principled(base: Rgb, roughness: f64, fresnel: Fresnel) -> Material {
    let (mirror, fresnel) = (Rgb::splat(0.04), Some(fresnel));
    Material { mirror, roughness, fresnel, ..Material::diffuse("principled", base) }
}

/// A plate in the plane y = 0.
fn plate(material: Material) -> World {
    common::plate(material, 4.0)
}

/// The mean brightness of a ball in a furnace of radiance 1 all round.
fn in_furnace(material: Material, intersector: IntersectorKind) -> f64 {
    let mut world = World::default();
    world.materials.push(material);
    world.spheres.push(WorldSphere::new("ball", DVec3::ZERO, 1.0, 0));
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    let mut job = job(world, pose((0.0, 0.0, 1.9), (0.0, 0.0, 0.0)), 24, 18);
    job.settings.intersector = intersector;
    job.settings.spp = 256;
    let (film, _) = render(&job);
    assert_eq!(film.bad.total(), 0);
    mean(&film)
}

/// White in a furnace is white, at every roughness, as plastic, as metal, half of both, and under a clear coat.
#[test]
fn white_materials_in_a_furnace_are_one() {
    let half = Fresnel { metallic: 0.5, ..PLASTIC };
    let coated =
        |fresnel, roughness| Fresnel { clearcoat: 0.8, clearcoat_roughness: roughness, ..fresnel };
    let tenths = (0..=10).map(|tenth| f64::from(tenth) / 10.0);
    for roughness in tenths.chain([0.005, 0.01, 0.02, 0.03, 0.05]) {
        for fresnel in
            [PLASTIC, METAL, half, coated(PLASTIC, 0.0), coated(half, 0.03), coated(METAL, 1.0)]
        {
            let white = principled(Rgb::ONE, roughness, fresnel);
            let mean = in_furnace(white, IntersectorKind::Embree);
            assert!((mean - 1.0).abs() < 0.002, "roughness {roughness}, {fresnel:?}: {mean}");
        }
    }
    let rough = principled(Rgb::ONE, 0.3, coated(half, 0.2));
    let mean = in_furnace(rough, IntersectorKind::Oracle);
    assert!((mean - 1.0).abs() < 0.002, "{mean}");
}

/// Nor does anything reflect more than it receives where interpolated normals face away from the viewer.
#[test]
fn white_meshes_with_smooth_normals_are_not_brighter_than_the_furnace() {
    let coat = Fresnel { clearcoat: 1.0, ..PLASTIC };
    for fresnel in [PLASTIC, METAL, coat] {
        let mut world = World::default();
        world.materials.push(principled(Rgb::ONE, 0.0, fresnel));
        let mut ball = common::uv_sphere(6, 4);
        let values = ball.positions.iter().map(|p| p.as_vec3().normalize()).collect();
        ball.normals = Some(Corners { values, corners: None });
        world.meshes.push(ball);
        world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
        let mut job = job(world, pose((0.4, 0.7, 3.4), (0.0, 0.0, 0.0)), 64, 48);
        job.settings.spp = 4;
        let (film, _) = render(&job);
        let most = film.rgb.iter().map(|c| c.max_element()).fold(0.0, f32::max);
        assert!(most < 1.002, "{fresnel:?}: {most}");
    }
}

/// What is darker than white reflects less than it receives, and a coat over black little.
#[test]
fn dark_materials_in_a_furnace_are_darker() {
    for roughness in [0.0, 0.3, 1.0] {
        let of = |base, fresnel| {
            in_furnace(principled(Rgb::splat(base), roughness, fresnel), IntersectorKind::Embree)
        };
        let plastic = of(0.0, PLASTIC);
        assert!((0.012..0.12).contains(&plastic), "{roughness}: {plastic}");
        let [metal, grey] = [of(0.5, METAL), of(0.5, PLASTIC)];
        assert!((0.3..0.62).contains(&metal), "{roughness}: {metal}");
        // Half of what passes the surface comes back.
        assert!((grey - plastic - 0.5 * (1.0 - plastic)).abs() < 0.003, "{grey} {plastic}");
    }
}

/// A polished plate shows the sky by Schlick's formula: black plastic, gold, and a coat over black.
#[test]
fn a_polished_plate_reflects_the_sky_by_its_angle() {
    let gold = Rgb::new(1.0, 0.75, 0.3);
    let half_coat = Fresnel { grazing: 0.0, clearcoat: 0.5, ..PLASTIC };
    let bare = Material { mirror: Rgb::ZERO, ..principled(Rgb::ZERO, 0.0, half_coat) };
    let cases = [
        (principled(Rgb::ZERO, 0.0, PLASTIC), Rgb::splat(0.04), 1.0),
        (principled(gold, 0.0, METAL), gold, 1.0),
        (bare, Rgb::splat(0.04), 0.5),
    ];
    for (material, normal, share) in cases {
        for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
            let mut world = plate(material.clone());
            world.sky = Sky { radiance: Rgb::ONE, lights: false, ..Sky::default() };
            let mut job = job(world, pose((-1.5, 0.8, 1.2), (0.0, 0.0, 0.0)), 24, 18);
            job.settings.intersector = kind;
            let (film, _) = render(&job);
            let mut seen = 0;
            for (x, y, rgb) in common::pixels(&film) {
                let p = common::on_plane_y(&job, x, y, 0.0);
                if p.x.abs().max(p.z.abs()) > 3.9 || !(job.camera.eye - p).is_finite() {
                    continue;
                }
                let cos = (job.camera.eye - p).normalize().y;
                let grown = (1.0 - cos).powi(5) as f32;
                let expected = (normal + (Rgb::ONE - normal) * grown) * share;
                let off = (rgb - expected).abs().max_element();
                assert!(off < 1e-4, "{kind:?} {x},{y}: {rgb} for {expected}");
                seen += 1;
            }
            assert!(seen > 100, "{seen}");
        }
    }
}

/// A rough metal plate under a point light, with the microfacet formula written out anew.
#[test]
fn a_rough_metal_reflects_a_point_light_as_the_formula_says() {
    let (light, roughness) = (DVec3::new(0.9, 0.6, -0.7), 0.4);
    let base = Rgb::new(0.9, 0.5, 0.1);
    let mut world = plate(principled(base, roughness, METAL));
    world.lights.push(Light::Point(PointLight { position: light, intensity: Rgb::ONE }));
    let job = job(world, pose((-1.0, 1.5, 0.8), (0.0, 0.0, 0.0)), 24, 18);
    let (film, _) = render(&job);
    for (x, y, rgb) in common::pixels(&film) {
        let p = common::on_plane_y(&job, x, y, 0.0);
        let wo = (job.camera.eye - p).normalize();
        let wi = (light - p).normalize();
        // What is given back is more where the surface is seen flat.
        if wo.y <= 0.4 || p.x.abs().max(p.z.abs()) > 3.9 {
            continue;
        }
        let m = (wi + wo).normalize();
        let a2 = roughness.powi(4);
        let d = a2 / (std::f64::consts::PI * (m.y * m.y * (a2 - 1.0) + 1.0).powi(2));
        let root = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
        let g_over_cosines = 2.0 / (wi.y * root(wo.y) + wo.y * root(wi.y));
        let single = d * g_over_cosines / 4.0 * wi.y / (light - p).length_squared();
        let grown = (1.0 - wo.dot(m)).powi(5);
        for channel in 0..3 {
            let normal = f64::from(base[channel]);
            let expected = single * (normal + (1.0 - normal) * grown);
            // What is given back is a few parts in a hundred at this roughness.
            let share = f64::from(rgb[channel]) / expected;
            assert!((0.999..1.08).contains(&share), "{x},{y}: {rgb}, {expected}");
        }
    }
}

/// Light samples joined with the lobes' rays and the lobes' rays alone see the same light, with two rough lobes at one
/// point.
#[test]
fn light_samples_and_lobe_samples_agree() {
    let coated = Fresnel { clearcoat: 1.0, clearcoat_roughness: 0.25, ..METAL };
    for (fresnel, roughness) in [(PLASTIC, 0.3), (METAL, 0.5), (coated, 0.6)] {
        // No diffuse part: that is lit by light samples alone.
        let mut world = plate(principled(Rgb::splat(0.7), roughness, fresnel));
        if fresnel == PLASTIC {
            world.materials[0].diffuse = Rgb::ZERO;
        }
        let (centre, radiance) = (DVec3::new(0.1, 1.2, 0.0), Rgb::splat(5.0));
        world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.3, radiance }));
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 16, 12);
        job.settings.spp = 1024;
        job.settings.shadow_samples = 2;
        let (joined, counts) = render(&job);
        assert!(counts[RayKind::ShadowArea] > 0);
        job.settings.shadow_samples = 0;
        let (alone, counts) = render(&job);
        assert_eq!(counts[RayKind::ShadowArea], 0);
        let (joined, alone) = (mean(&joined), mean(&alone));
        assert!((joined / alone - 1.0).abs() < 0.01, "{fresnel:?}: {joined} and {alone}");
    }
}

/// An image of a share.
type MapOf = fn(&mut Fresnel) -> &mut Option<TextureMap>;

/// The image that the plates below have, clamped, so that its halves do not meet at the sides too.
fn halves() -> TextureMap {
    TextureMap { wrap: [Wrap::Clamp; 2], ..TextureMap::of(0) }
}

/// An image makes the left half of a plate metal and the right one plastic, seen straight down.
#[test]
fn a_metallic_map_tells_metal_from_plastic() {
    let texels = vec![255, 0];
    let base = Rgb::new(0.8, 0.4, 0.2);
    let fresnel = Fresnel { metallic_map: Some(halves()), ..METAL };
    let mut world = plate(principled(base, 0.0, fresnel));
    world.textures.push(Texture::from_data8("halves", [2, 1], texels));
    let uvs = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)];
    let values = uvs.map(|(u, v)| Vec2::new(u, v)).to_vec();
    world.meshes[0].uvs = Some(Corners { values, corners: None });
    // What is seen in a mirror, and what lights the diffuse part.
    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
    let mut job = job(world, pose((0.0, 9.0, 0.01), (0.0, 0.0, 0.0)), 32, 24);
    job.settings.sky_samples = 4;
    let (film, _) = render(&job);
    let mut counts = [0; 2];
    for (x, y, rgb) in common::pixels(&film) {
        let p = common::on_plane_y(&job, x, y, 0.0);
        let grown = (1.0 - (job.camera.eye - p).normalize().y).powi(5) as f32;
        let by_angle = |normal: Rgb| normal + (Rgb::ONE - normal) * grown;
        let of_plastic = by_angle(Rgb::splat(0.04));
        // Texels have their middles at the quarters.
        let expected = match p.x {
            x if x.abs() > 3.9 => continue,
            x if x < -2.1 => by_angle(base),
            x if x > 2.1 => of_plastic + base * (Rgb::ONE - of_plastic),
            _ => continue,
        };
        let off = (rgb - expected).abs().max_element();
        assert!(off < 2e-3, "{x},{y}: {rgb} for {expected}");
        counts[usize::from(p.x > 0.0)] += 1;
    }
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
}

/// An image of the right half's 0 and the left half's 1 is as good as two materials.
#[test]
fn images_multiply_every_share() {
    let coat = Fresnel { clearcoat: 0.9, clearcoat_roughness: 0.4, ..PLASTIC };
    let part = Fresnel { transmission: 0.7, ..PLASTIC };
    let (shiny, dull) = (Rgb::splat(0.04), Rgb::ZERO);
    let smooth = Fresnel { clearcoat_roughness: 0.0, ..coat };
    let maps: [(Fresnel, (Fresnel, Rgb), MapOf); 5] = [
        (PLASTIC, (Fresnel { grazing: 0.0, ..PLASTIC }, dull), |f| &mut f.specular_map),
        (PLASTIC, (PLASTIC, dull), |f| &mut f.specular_colour_map),
        (coat, (Fresnel { clearcoat: 0.0, ..coat }, shiny), |f| &mut f.clearcoat_map),
        (coat, (smooth, shiny), |f| &mut f.clearcoat_roughness_map),
        (part, (Fresnel { transmission: 0.0, ..part }, shiny), |f| &mut f.transmission_map),
    ];
    for (at, (all, (none, bare), map)) in maps.into_iter().enumerate() {
        let film = |fresnel: Fresnel, mirror| {
            let base = principled(Rgb::new(0.8, 0.4, 0.2), 0.0, fresnel);
            let mut material = Material { mirror, ..base };
            let tint = Rgb::new(0.1, 0.9, 0.4);
            let glass = Glass { thin: true, tint, ..Glass::clear(1.5) };
            material.glass = (fresnel.transmission != 0.0).then_some(glass);
            let mut world = plate(material);
            world.textures.push(Texture::from_data8("halves", [2, 1], vec![255, 0]));
            let uvs = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)];
            let values = uvs.map(|(u, v)| Vec2::new(u, v)).to_vec();
            world.meshes[0].uvs = Some(Corners { values, corners: None });
            world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
            let light =
                PointLight { position: DVec3::new(0.5, 2.0, 0.2), intensity: Rgb::splat(3.0) };
            world.lights.push(Light::Point(light));
            let job = job(world, pose((0.0, 9.0, 0.01), (0.0, 0.0, 0.0)), 32, 24);
            let at = |(x, y, _)| common::on_plane_y(&job, x, y, 0.0).x;
            let (film, _) = render(&job);
            let places: Vec<f64> = common::pixels(&film).map(at).collect();
            (film.rgb, places)
        };
        let mut mapped = all;
        *map(&mut mapped) = Some(halves());
        let ((mapped, places), (all, _)) = (film(mapped, shiny), film(all, shiny));
        let (none, _) = film(none, bare);
        let mut counts = [0; 2];
        for (i, x) in places.into_iter().enumerate() {
            if !(2.1..3.9).contains(&x.abs()) {
                continue;
            }
            let (expected, other) = if x < 0.0 { (all[i], none[i]) } else { (none[i], all[i]) };
            let off = (mapped[i] - expected).abs().max_element();
            assert!(off < 1e-5, "map {at} at {x}: {} for {expected}", mapped[i]);
            counts[usize::from(x > 0.0)] +=
                usize::from((expected - other).abs().max_element() > 1e-4);
        }
        assert!(counts.iter().all(|count| *count > 20), "map {at}: {counts:?}");
    }
}

/// An image of one colour is as good as a reflectance of that colour, and no image makes a surface reflect more than all.
#[test]
fn an_image_colours_the_reflection() {
    let film = |mirror: Rgb, image: Option<Rgb>| {
        let specular_colour_map = image.map(|_| TextureMap::of(0));
        let fresnel = Fresnel { specular_colour_map, ..PLASTIC };
        let mut world = plate(Material { mirror, ..principled(Rgb::ZERO, 0.0, fresnel) });
        let colour = image.unwrap_or(Rgb::ONE);
        world.textures.push(Texture::from_linear("colour", [1, 1], vec![colour]));
        let values = vec![Vec2::ZERO; 4];
        world.meshes[0].uvs = Some(Corners { values, corners: None });
        world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
        render(&job(world, pose((0.0, 3.0, 2.0), (0.0, 0.0, 0.0)), 16, 12)).0
    };
    let colour = Rgb::new(1.0, 0.5, 0.25);
    let (image, plain) =
        (film(Rgb::splat(0.2), Some(colour)), film(Rgb::splat(0.2) * colour, None));
    assert_eq!(image.rgb, plain.rgb);
    let [r, g, b] = image.rgb[0].to_array();
    assert!(r > 1.5 * g && g > 1.3 * b, "{r} {g} {b}");
    let bright = film(Rgb::splat(0.2), Some(Rgb::splat(40.0)));
    assert!(bright.rgb.iter().all(|c| c.max_element() <= 1.0001));
}

/// The diffuse part of plastic is looked up in other frames, its reflection traced; the kernel that leaves no effect out
/// makes the same picture.
#[test]
fn plastic_is_the_same_by_every_kernel() {
    let mut world = plate(principled(Rgb::new(0.2, 0.5, 0.7), 0.3, PLASTIC));
    let coated = Fresnel { clearcoat: 1.0, clearcoat_roughness: 0.1, ..METAL };
    world.materials.push(principled(Rgb::new(0.9, 0.6, 0.2), 0.4, coated));
    world.spheres.push(WorldSphere::new("ball", DVec3::new(0.0, 0.7, 0.0), 0.7, 1));
    let (centre, radiance) = (DVec3::new(1.0, 2.5, 1.0), Rgb::splat(9.0));
    world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.4, radiance }));
    world.sky.radiance = Rgb::splat(0.2);
    let mut job = job(world, pose((-1.5, 1.6, 2.2), (0.0, 0.4, 0.0)), 24, 18);
    job.settings.spp = 4;
    let (film, counts) = render(&job);
    let scene = job.world.clone().into_scene(true).unwrap();
    let (other, _) = common::render_with_every_effect(&scene, &job);
    assert!(counts[RayKind::Glossy] > 0);
    assert_eq!(film.rgb, other.rgb);
}
