//! Principled materials of which a share is glass, against what physics tells.

#![allow(clippy::unwrap_used)]

mod common;

use common::{job, mean, pose, render};
use tweenray::math::{DVec3, Rgb};
use tweenray::scene::{
    Fresnel, Glass, GlassShadows, IntersectorKind, Light, Material, PointLight, Sky, SphereLight,
    Texture, TextureMap, World,
};
use tweenray::stats::RayKind;

const KINDS: [IntersectorKind; 2] = [IntersectorKind::Embree, IntersectorKind::Oracle];
const PLASTIC: Fresnel = Fresnel::PLASTIC;

/// White, and clear where it is glass.
fn part_glass(transmission: f64, roughness: f64, thin: bool) -> Material {
    Material {
        mirror: Rgb::splat(0.04),
        roughness,
        fresnel: Some(Fresnel { transmission, ..PLASTIC }),
        glass: Some(Glass { roughness, thin, ..Glass::clear(1.5) }),
        ..Material::diffuse("part glass", Rgb::ONE)
    }
}

fn with(material: Material, more: impl FnOnce(&mut Fresnel)) -> Material {
    let mut fresnel = material.fresnel.unwrap();
    more(&mut fresnel);
    Material { fresnel: Some(fresnel), ..material }
}

fn plate(material: Material) -> World {
    common::plate(material, 9.0)
}

/// White and clear parts together reflect and pass on all of a furnace, at every share and roughness, under a coat and beside
/// metal too, steep and flat, and from inside.
#[test]
fn parts_of_a_surface_in_a_furnace_are_one() {
    let places = [(true, 1.0, 1.0), (false, 1.0, 1.0), (false, 1.0, 6.0), (false, -1.0, 1.0)];
    for (thin, height, away) in places {
        for tenth in 0..=10 {
            for share in [0.25, 0.5, 1.0] {
                let roughness = f64::from(tenth) / 10.0;
                let bare = part_glass(share, roughness, thin);
                let coated = with(bare.clone(), |fresnel| {
                    fresnel.metallic = 0.3;
                    (fresnel.clearcoat, fresnel.clearcoat_roughness) = (0.8, 0.1);
                });
                for material in [bare, coated] {
                    let mut world = plate(material);
                    world.sky = Sky { radiance: Rgb::ONE, ..Sky::default() };
                    let mut job = job(world, pose((0.0, height, away), (0.0, 0.0, 0.0)), 16, 12);
                    job.settings.spp = 512;
                    let (film, _) = render(&job);
                    let mean = mean(&film);
                    let told = format!("{thin}, {tenth}/10, {share}, {height}, {away}: {mean}");
                    println!("{told}");
                    assert!((mean - 1.0).abs() < 0.002 && film.bad.total() == 0, "{told}");
                }
            }
        }
    }
}

/// Of a polished plate a share is matte under its reflection, and the rest shows what is behind: by formula, with both
/// intersectors. From inside a body it is glass alone.
#[test]
fn a_polished_part_shows_the_sky_and_a_point_light_by_formula() {
    let (lamp, share) = (DVec3::new(0.2, 1.4, -0.3), 0.3);
    for (kind, thin) in KINDS.into_iter().flat_map(|kind| [(kind, true), (kind, false)]) {
        let mut material = part_glass(share, 0.0, thin);
        let tint = Rgb::new(0.9, 0.6, 0.2);
        material.glass.as_mut().unwrap().tint = tint;
        let mut world = plate(material);
        world.lights.push(Light::Point(PointLight { position: lamp, intensity: Rgb::ONE }));
        world.sky = Sky { radiance: Rgb::splat(0.5), lights: false, ..Sky::default() };
        let mut job = job(world, pose((-1.0, 1.5, 0.8), (0.0, 0.0, 0.0)), 24, 18);
        job.settings.intersector = kind;
        let (film, _) = render(&job);
        for (x, y, rgb) in common::pixels(&film) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            let wo = (job.camera.eye - p).normalize();
            if p.x.abs().max(p.z.abs()) > 8.9 {
                continue;
            }
            let wi = (lamp - p).normalize();
            let irradiance = wi.y / (lamp - p).length_squared();
            let schlick = 0.04 + 0.96 * (1.0 - wo.y).powi(5);
            let sine = (1.0 - wo.y * wo.y) / (1.5 * 1.5);
            let below = (1.0 - sine).sqrt();
            let parallel = (1.5 * wo.y - below) / (1.5 * wo.y + below);
            let across = (wo.y - 1.5 * below) / (wo.y + 1.5 * below);
            let face = 0.5 * (parallel * parallel + across * across);
            let glass = if thin { 2.0 * face / (1.0 + face) } else { face };
            let matte = (1.0 - schlick) / std::f64::consts::PI * irradiance;
            for channel in 0..3 {
                let through = glass + (1.0 - glass) * f64::from(tint[channel]);
                let expected = (1.0 - share) * (matte + 0.5 * schlick) + share * 0.5 * through;
                let off = f64::from(rgb[channel]) - expected;
                assert!(off.abs() < 1e-4, "{kind:?} {thin} {x},{y}: {rgb} for {expected}");
            }
        }
    }
}

/// A share of 1 is glass, to the byte but for the sum of a mirror that reflects nothing.
#[test]
fn a_share_of_one_is_glass() {
    for (roughness, thin) in [(0.0, true), (0.0, false), (0.4, true), (0.4, false)] {
        let of = |material| {
            let mut world = plate(material);
            let (centre, radiance) = (DVec3::new(0.1, -1.2, 0.0), Rgb::splat(5.0));
            world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.3, radiance }));
            world.sky = Sky { radiance: Rgb::splat(0.2), ..Sky::default() };
            let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 32, 24);
            job.settings.spp = 4;
            render(&job).0.rgb
        };
        let part = part_glass(1.0, roughness, thin);
        let whole = Material { glass: part.glass, ..Material::black("glass") };
        let pairs = of(part).into_iter().zip(of(whole));
        let most = pairs.map(|(a, b)| (a - b).abs().max_element()).fold(0.0, f32::max);
        assert!(most < 1e-5, "{roughness} {thin}: {most}");
    }
}

/// Light samples joined with the lobes' rays and the lobes' rays alone see the same light, from above and through the surface.
#[test]
fn light_samples_and_lobe_samples_agree() {
    for (thin, height) in [(true, 1.2), (true, -1.2), (false, 1.2), (false, -1.2)] {
        let coated = with(part_glass(0.6, 0.5, thin), |fresnel| {
            (fresnel.clearcoat, fresnel.clearcoat_roughness) = (1.0, 0.3);
            fresnel.metallic = 0.2;
        });
        // No diffuse part: that is lit by light samples alone.
        let mut world = plate(Material { diffuse: Rgb::ZERO, ..coated });
        let (centre, radiance) = (DVec3::new(0.1, height, 0.0), Rgb::splat(5.0));
        world.lights.push(Light::Sphere(SphereLight { centre, radius: 0.3, radiance }));
        let mut job = job(world, pose((-0.8, 0.9, 0.9), (0.0, 0.0, 0.0)), 16, 12);
        job.settings.spp = 1024;
        job.settings.shadow_samples = 2;
        let (joined, counts) = render(&job);
        assert!(counts[RayKind::ShadowArea] > 0);
        job.settings.shadow_samples = 0;
        let (alone, _) = render(&job);
        let (joined, alone) = (mean(&joined), mean(&alone));
        println!("thin {thin}, {height}: {joined} {alone}");
        assert!((joined / alone - 1.0).abs() < 0.01, "{thin} {height}: {joined} and {alone}");
    }
}

/// Image and metal map tell where and how much light passes: one lookup, one tint.
#[test]
fn an_image_tints_the_glass_of_a_surface() {
    let of = |textured: bool| {
        let mut material = part_glass(1.0, 0.0, true);
        let grey = Rgb::splat(0.25);
        let mut world = World::default();
        if textured {
            world.textures.push(Texture::from_linear("grey", [1, 1], vec![grey]));
            material.texture = Some(TextureMap::of(0));
        } else {
            material.glass.as_mut().unwrap().tint = grey;
        }
        let world = World { textures: world.textures, ..plate(material) };
        let world = World { sky: Sky { radiance: Rgb::ONE, ..Sky::default() }, ..world };
        mean(&render(&job(world, pose((0.0, 1.0, 0.5), (0.0, 0.0, 0.0)), 16, 12)).0)
    };
    let (image, tint) = (of(true), of(false));
    assert!((image - tint).abs() < 1e-5 && image < 0.4, "{image} {tint}");
}

/// Straight shadow rays pass the part of a surface that is glass: of light behind a pane that is not metal by 0.8 and glass by
/// 0.3 of that, 0.24 of what a pane of glass leaves.
#[test]
fn straight_shadows_pass_the_part_that_is_glass() {
    let of = |material| {
        let mut world = plate(material);
        world.materials.push(Material::diffuse("floor", Rgb::splat(0.5)));
        let corners = [(-2.0, -2.0), (-2.0, 2.0), (2.0, 2.0), (2.0, -2.0)];
        let corners = corners.map(|(x, z)| DVec3::new(x, -1.0, z));
        world.meshes.push(common::quad(corners, 1));
        let position = DVec3::new(0.3, 1.0, 0.2);
        world.lights.push(Light::Point(PointLight { position, intensity: Rgb::ONE }));
        let mut job = job(world, pose((0.1, -0.2, 0.1), (0.0, -1.0, 0.0)), 16, 12);
        job.settings.glass_shadows = GlassShadows::Straight;
        render(&job).0.rgb
    };
    let part = with(part_glass(0.3, 0.0, true), |fresnel| fresnel.metallic = 0.2);
    let whole = Material { glass: part.glass, ..Material::black("glass") };
    for (part, whole) in of(part).into_iter().zip(of(whole)) {
        assert!(whole.y > 0.0 && (part.y / whole.y - 0.24).abs() < 1e-4, "{part} of {whole}");
    }
}
