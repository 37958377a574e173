//! Meshes that show the colours of their vertices, from file to picture.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Job, job, pose, render};
use std::path::Path;
use tweenray::import::{LoadOptions, convert, load};
use tweenray::math::{DVec3, Rgb, srgb_decode, srgb_encode};
use tweenray::scene::{IntersectorKind, Sky, World};

/// Colours of the corners (0, 0), (1, 0), (1, 1) and (0, 1) of a square in the plane z = 0, sRGB codes.
const CODES: [[u8; 3]; 4] = [[255, 0, 40], [10, 200, 90], [0, 0, 0], [60, 120, 255]];

/// The square as one face of a PLY file, with colours of the type `kind`, each `share` of its largest code.
fn ply(kind: &str, value: impl Fn(u8) -> String) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty {kind} blue\nproperty float x\nproperty float y\n\
         property float z\nproperty {kind} red\nproperty {kind} green\nproperty uchar alpha\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n0 9 9 9 0 0 0\n"
    );
    for ([r, g, b], (x, y)) in CODES.into_iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let [r, g, b] = [r, g, b].map(&value);
        text += &format!("{b} {x} {y} 0 {r} {g} 255\n");
    }
    text + "4 1 2 3 4\n"
}

fn obj() -> String {
    let mut text = String::new();
    for ([r, g, b], (x, y)) in CODES.into_iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
        let [r, g, b] = [r, g, b].map(|c| f64::from(c) / 255.0);
        text += &format!("v {x} {y} 0 {r:.6} {g:.6} {b:.6}\n");
    }
    text + "f 1 2 3 4\n"
}

/// The world of a scene file in `folder` whose one mesh is `file`, with further keys, and the warnings about it.
fn world_of(folder: &Path, file: &str, keys: &str) -> (World, Vec<String>) {
    let text = format!("sky.ambient = 1\n[[mesh]]\nfile = '{file}'\n{keys}\n");
    let scene = folder.join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let loaded = load(&scene, &LoadOptions::default()).unwrap();
    (loaded.world, loaded.warnings.iter().map(ToString::to_string).collect())
}

/// What the square shows at `p` by linear interpolation over its two triangles.
fn expected(p: DVec3) -> Rgb {
    let corner = |i: usize| DVec3::from_array(CODES[i].map(|c| srgb_decode(f64::from(c) / 255.0)));
    let (x, y) = (p.x, p.y);
    // A convex face fans out from its first corner.
    let mixed = match x >= y {
        true => corner(0) * (1.0 - x) + corner(1) * (x - y) + corner(2) * y,
        false => corner(0) * (1.0 - y) + corner(2) * x + corner(3) * (y - x),
    };
    mixed.as_vec3()
}

fn looking(world: World, kind: IntersectorKind) -> Job {
    let mut job = job(world, pose((0.3, 0.6, 1.5), (0.5, 0.5, 0.0)), 48, 48);
    job.settings.intersector = kind;
    job
}

/// Where the middle of a pixel meets the square, if it does.
fn on_square(job: &Job, x: u32, y: u32) -> Option<DVec3> {
    let dir = job.camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
    let p = job.camera.eye - dir * (job.camera.eye.z / dir.z);
    let inside = |c: f64| (0.03..0.97).contains(&c);
    (inside(p.x) && inside(p.y) && (p.x - p.y).abs() > 0.03).then_some(p)
}

/// The picture's largest difference from the closed form. A pixel's sample lies within a half of its middle.
fn worst(job: &Job) -> f32 {
    let film = render(job).0;
    let (mut worst, mut count) = (0f32, 0);
    for (x, y, rgb) in common::pixels(&film) {
        let Some(p) = on_square(job, x, y) else { continue };
        // Four pixels around it bound what the pixel's one sample may show.
        let around = [(0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)].map(|(dx, dy)| {
            let dir = job.camera.direction(f64::from(x) + 0.5 + dx, f64::from(y) + 0.5 + dy);
            expected(job.camera.eye - dir * (job.camera.eye.z / dir.z))
        });
        let low = around.into_iter().fold(expected(p), Rgb::min);
        let high = around.into_iter().fold(expected(p), Rgb::max);
        worst = worst.max((low - rgb).max(rgb - high).max_element());
        count += 1;
    }
    assert!(count > 500, "{count} pixels");
    worst
}

#[test]
fn colours_of_every_type_are_interpolated_as_light() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("bytes.ply"), ply("uchar", |c| c.to_string())).unwrap();
    std::fs::write(at("ints.ply"), ply("int", |c| c.to_string())).unwrap();
    std::fs::write(at("words.ply"), ply("ushort", |c| (257 * u32::from(c)).to_string())).unwrap();
    std::fs::write(at("floats.ply"), ply("float", |c| (f64::from(c) / 255.0).to_string())).unwrap();
    std::fs::write(at("square.obj"), obj()).unwrap();
    convert(&at("square.obj"), &at("converted.ply"), None).unwrap();
    let files = ["bytes.ply", "ints.ply", "words.ply", "floats.ply", "square.obj", "converted.ply"];
    for file in files {
        // Far from the origin, and back.
        for keys in ["", "transform = [{ scale = 2 }, { translate = [1000, 0, 0] }]"] {
            let (mut world, warnings) = world_of(folder.path(), file, keys);
            assert_eq!(warnings, [""; 0], "{file}");
            let [mesh] = &mut world.meshes[..] else { panic!("one mesh") };
            let codes = mesh.colours.as_ref().unwrap().codes().unwrap();
            assert_eq!(codes, &CODES[..], "{file}");
            if !keys.is_empty() {
                mesh.positions.iter_mut().for_each(|p| *p = (*p - DVec3::X * 1000.0) / 2.0);
            }
            for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
                let worst = worst(&looking(world.clone(), kind));
                assert!(worst < 2e-6, "{file} {keys} {kind:?}: {worst}");
            }
        }
    }
}

#[test]
fn finer_colours_stay_fine() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fine.ply");
    std::fs::write(&path, ply("float", |c| ((f64::from(c) + 0.4) / 256.0).to_string())).unwrap();
    convert(&path, &folder.path().join("again.ply"), None).unwrap();
    for file in ["fine.ply", "again.ply"] {
        let (world, _) = world_of(folder.path(), file, "");
        let colours = world.meshes[0].colours.as_ref().unwrap();
        assert_eq!(colours.codes(), None);
        let share = srgb_encode(f64::from(colours.of_vertex(1).y));
        assert!((share - 200.4 / 256.0).abs() < 1e-6, "{share}");
    }
}

#[test]
fn a_material_of_the_scene_file_wins_unless_it_asks_for_the_colours() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.ply"), ply("uchar", |c| c.to_string())).unwrap();
    std::fs::write(folder.path().join("plain.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .unwrap();
    let with = |file, material| {
        let keys = format!("material = 'm'\n[material.m]\n{material}");
        world_of(folder.path(), file, &keys)
    };
    let (world, warnings) = with("a.ply", "diffuse = 0.3");
    assert!(world.meshes[0].colours.is_none() && warnings.is_empty());
    let (world, warnings) = with("a.ply", "vertex_colours = true");
    assert!(warnings.is_empty());
    assert!(worst(&looking(world, IntersectorKind::Embree)) < 2e-6);
    let (mut world, _) = with("a.ply", "vertex_colours = true\ndiffuse = 0.5");
    world.sky = Sky { ambient: Rgb::splat(2.0), ..world.sky };
    assert!(worst(&looking(world, IntersectorKind::Embree)) < 2e-6);
    let (_, warnings) = with("plain.obj", "vertex_colours = true");
    assert!(warnings[0].contains("`plain` has no vertex colours"), "{warnings:?}");
}

#[test]
fn meshes_without_colours_hold_nothing_for_them() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plain.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .unwrap();
    let (world, _) = world_of(folder.path(), "plain.obj", "");
    assert!(world.materials.iter().all(|m| !m.vertex_colours));
    assert!(world.into_scene(true).unwrap().meshes[0].colours.is_none());
}
