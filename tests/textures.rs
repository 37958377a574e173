//! Textures as rays see them: filtered by what each ray stands for, in the air, in mirrors and behind glass.

#![allow(clippy::unwrap_used)]

#[path = "common/checkerboard.rs"]
mod checkerboard;
mod common;

use checkerboard::{colour_at, floor, hall};
use common::{Job, job, pose, render};
use tweenray::film::Film;
use tweenray::import;
use tweenray::math::{DVec3, Rgb, srgb_decode};
use tweenray::output::exr::{self, ExrChannel, ExrSamples};
use tweenray::scene::{Glass, IntersectorKind, Material, World, WorldSphere};

const BOTH: [IntersectorKind; 2] = [IntersectorKind::Embree, IntersectorKind::Oracle];

fn with_samples(job: &Job, spp: u32) -> Film {
    let mut job = job.clone();
    job.settings.spp = spp;
    render(&job).0
}

/// Root mean square difference of two pictures over pixels that `is_seen`.
fn rmse(a: &Film, b: &Film, is_seen: impl Fn(u32, u32) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for ((x, y, a), (_, _, b)) in common::pixels(a).zip(common::pixels(b)) {
        if is_seen(x, y) {
            sum += f64::from((a.x - b.x).powi(2));
            count += 1;
        }
    }
    assert!(count > 0, "nothing is seen");
    (sum / f64::from(count)).sqrt()
}

/// One sample a pixel, looked up at a point, as a picture without filter would be.
fn unfiltered(job: &Job) -> Film {
    let mut film = render(job).0;
    for y in 0..job.settings.height {
        for x in 0..job.settings.width {
            let at = film.index(x, y);
            if film.rgb[at] != Rgb::ZERO {
                film.rgb[at] = colour_at(common::on_plane_y(job, x, y, 0.0));
            }
        }
    }
    film
}

#[test]
fn a_checkerboard_is_grey_at_the_horizon_and_sharp_in_front() {
    for kind in BOTH {
        let mut job = job(floor(), pose((0.0, 1.0, 0.0), (0.3, 0.8, -1.0)), 96, 72);
        job.settings.intersector = kind;
        let film = render(&job).0;
        let (mut near, mut far) = (Vec::new(), Vec::new());
        for (x, y, rgb) in common::pixels(&film).filter(|(_, _, rgb)| *rgb != Rgb::ZERO) {
            let p = common::on_plane_y(&job, x, y, 0.0);
            match p.length() {
                // A pixel is 9 long there, along the view, and squares are 0.5 wide.
                30.0..200.0 => far.push(rgb.x),
                0.0..2.0 => near.push(rgb.x),
                _ => {}
            }
        }
        assert!(near.len() > 200 && far.len() > 100, "{} {}", near.len(), far.len());
        let ends = near.iter().filter(|c| **c < 0.01 || **c > 0.99).count();
        assert!(10 * ends > 7 * near.len(), "{kind:?}: {ends} of {}", near.len());
        assert!(far.iter().all(|c| (c - 0.5).abs() < 0.15), "{kind:?}: {far:?}");
    }
}

/// From frame to frame a picture of one sample a pixel changes as the converged one does, up to a small part of what it
/// would without a filter.
#[test]
fn a_slow_pan_over_a_checkerboard_does_not_shimmer() {
    let frame = |k: u32| {
        let turn = f64::from(k) * 0.004;
        let target = (turn, 0.85, -1.0);
        job(floor(), pose((0.0, 1.0, 0.0), target), 96, 72)
    };
    let mut errors = Vec::new();
    for k in 0..6 {
        let job = frame(k);
        let truth = with_samples(&job, 256);
        let off = |film: &Film| -> Vec<f32> {
            film.rgb.iter().zip(&truth.rgb).map(|(a, b)| a.x - b.x).collect()
        };
        errors.push([off(&render(&job).0), off(&unfiltered(&job))]);
    }
    let flicker = |which: usize| -> f64 {
        let changes = errors.windows(2).flat_map(|two| {
            two[1][which].iter().zip(&two[0][which]).map(|(b, a)| f64::from((b - a).powi(2)))
        });
        changes.sum::<f64>().sqrt()
    };
    let ratio = flicker(0) / flicker(1);
    assert!(ratio < 0.25, "{ratio}");
}

/// A flat mirror shows what is seen from behind it.
#[test]
fn a_flat_mirror_filters_as_the_air_does() {
    for kind in BOTH {
        let mut with_mirror = hall();
        let mirror = with_mirror.materials.len() as u32;
        with_mirror.materials.push(Material::mirror("mirror", Rgb::ONE));
        let p = |x: f64, y: f64| DVec3::new(x, y, 2.0);
        let wall = [p(-50.0, 0.0), p(-50.0, 50.0), p(50.0, 50.0), p(50.0, 0.0)];
        with_mirror.meshes.push(common::quad(wall, mirror));
        // The mirror is the plane z = 2; eyes at 1 and 3 are images of one another.
        let mut seen = job(with_mirror, pose((0.3, 1.0, 1.0), (0.5, 0.8, 2.0)), 64, 48);
        let mut direct = job(hall(), pose((0.3, 1.0, 3.0), (0.5, 0.8, 2.0)), 64, 48);
        for job in [&mut seen, &mut direct] {
            job.settings.intersector = kind;
            job.settings.bounces = 1;
        }
        let (seen, direct) = (with_samples(&seen, 1), with_samples(&direct, 1));
        // The mirrored picture is the other one, left and right exchanged: only its statistics are the same, since samples
        // lie elsewhere in the pixels. Far away they agree.
        let mirrored = |x: u32, y: u32| direct.rgb[direct.index(63 - x, y)];
        let mut off: f32 = 0.0;
        let mut count = 0;
        for (x, y, rgb) in common::pixels(&seen).filter(|(_, y, _)| (18..22).contains(y)) {
            off += (rgb.x - mirrored(x, y).x).abs();
            count += 1;
        }
        assert!(off / (count as f32) < 0.05, "{kind:?}: {}", off / count as f32);
    }
}

/// In a ball the floor looks tiny; a filter that took the ball for flat would alias there, and one that did not know the
/// distance would blur.
#[test]
fn balls_of_mirror_and_glass_show_a_filtered_floor() {
    let glass = Material { glass: Some(Glass::clear(1.5)), ..Material::black("glass") };
    for (name, material) in [("mirror", Material::mirror("mirror", Rgb::ONE)), ("glass", glass)] {
        let with = |material: &Material| -> World {
            let mut world = hall();
            let id = world.materials.len() as u32;
            world.materials.push(material.clone());
            world.spheres.push(WorldSphere::new("ball", DVec3::new(0.0, 1.0, -3.0), 0.9, id));
            world
        };
        let mut job = job(with(&material), pose((0.0, 1.4, 1.0), (0.0, 1.0, -3.0)), 64, 64);
        job.settings.bounces = 4;
        let truth = with_samples(&job, 256);
        let centre = |x: u32, y: u32| {
            let (dx, dy) = (f64::from(x) - 31.5, f64::from(y) - 31.5);
            dx.hypot(dy) < 17.0
        };
        let off = [1, 4, 16].map(|spp| rmse(&with_samples(&job, spp), &truth, centre));
        assert!(off[0] < 0.1 && off[1] < 0.07 && off[2] < 0.03, "{name}: {off:?}");
    }
}

/// Every format gives the same picture: codes of 8 bits exactly, more bits as far as they go.
#[test]
fn images_of_all_formats_are_read() {
    use image::{DynamicImage, ImageFormat, Rgb as Pixel, Rgb32FImage, RgbImage};
    let codes = [[0, 128, 255], [255, 0, 64], [10, 20, 30], [200, 100, 50]];
    let small = RgbImage::from_fn(2, 2, |x, y| Pixel(codes[(2 * y + x) as usize]));
    let eight = DynamicImage::ImageRgb8(small);
    let sixteen = DynamicImage::ImageRgb16(eight.to_rgb16());
    let linear = |code: u8| srgb_decode(f64::from(code) / 255.0);
    let float = Rgb32FImage::from_fn(2, 2, |x, y| {
        Pixel(codes[(2 * y + x) as usize].map(|code| linear(code) as f32))
    });
    let float = DynamicImage::ImageRgb32F(float);
    let folder = tempfile::tempdir().unwrap();
    for (name, image, format, error) in [
        ("a.png", &eight, ImageFormat::Png, 1e-7),
        ("a.bmp", &eight, ImageFormat::Bmp, 1e-7),
        ("a.tga", &eight, ImageFormat::Tga, 1e-7),
        ("a.ppm", &eight, ImageFormat::Pnm, 1e-7),
        ("sixteen.png", &sixteen, ImageFormat::Png, 1e-7),
        ("a.exr", &float, ImageFormat::OpenExr, 1e-7),
        ("a.hdr", &float, ImageFormat::Hdr, 5e-3),
    ] {
        let path = folder.path().join(name);
        image.save_with_format(&path, format).unwrap();
        let texture = import::load_texture(&path).unwrap();
        let level = &texture.levels()[0];
        assert_eq!((level.width, level.height), (2, 2), "{name}");
        for (i, code) in codes.iter().enumerate() {
            let texel = level.texel(i % 2, i / 2).to_array();
            for (found, code) in texel.iter().zip(code) {
                assert!((f64::from(*found) - linear(*code)).abs() <= error, "{name}: {texel:?}");
            }
        }
        // Cut short, it is refused by name.
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let refused = import::load_texture(&path).unwrap_err().to_string();
        assert!(refused.contains(name), "{refused}");
    }
}

/// An OpenEXR file of one channel, whatever its name, is a grey image, as colour and as data; one that ends early is refused.
#[test]
fn an_exr_file_of_one_channel_is_grey() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grey.exr");
    let samples = ExrSamples::F32(vec![0.25, 0.5, 0.75, 1.0, 0.0, 0.125]);
    let bytes = exr::encode(3, 2, &[ExrChannel { name: "V".into(), samples }], "").unwrap();
    std::fs::write(&path, &bytes).unwrap();
    let texture = import::load_texture(&path).unwrap();
    let level = &texture.levels()[0];
    assert_eq!((level.width, level.height), (3, 2));
    assert_eq!((level.texel(0, 0), level.texel(2, 1)), (Rgb::splat(0.25), Rgb::splat(0.125)));
    let scene = "sky.radiance = 1\n[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'm'\n[material.m]\n\
                 mirror = 0.5\nroughness = 'grey.exr'\n";
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, scene).unwrap();
    let world = import::load(&file, &import::LoadOptions::default()).unwrap().world;
    let rough = world.textures[0].levels()[0].texel(1, 0).x;
    assert!((rough - 0.5).abs() < 1e-5, "{rough}");
    for end in [bytes.len() / 2, bytes.len() - 1, 12] {
        std::fs::write(&path, &bytes[..end]).unwrap();
        let refused = import::load_texture(&path).unwrap_err().to_string();
        assert!(refused.contains("grey.exr"), "{refused}");
    }
}
