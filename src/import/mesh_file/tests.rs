//! The real meshes beside the project, where they exist.

#![allow(clippy::print_stderr)]

use super::*;
use crate::math::DVec3;
use crate::math::Rgb;
use crate::scene::World;
use crate::scene::{Light, WorldMesh};
use std::collections::HashMap;

const SMOOTH: NormalPolicy = NormalPolicy::Auto { crease_degrees: 30.0 };

fn shared(name: &str) -> Option<Model> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not on this machine", path.display());
        return None;
    }
    Some(load_model(&path, SMOOTH).expect("a good mesh"))
}

/// Edges that lack a partner which runs the other way, by place.
fn open_edges(mesh: &WorldMesh) -> usize {
    let key = |i: u32| (mesh.positions[i as usize] + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut balance = HashMap::new();
    for t in &mesh.triangles {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (key(a), key(b));
            *balance.entry((a.min(b), a.max(b))).or_insert(0i32) += if a < b { 1 } else { -1 };
        }
    }
    balance.values().filter(|sum| **sum != 0).count()
}

#[test]
fn real_meshes_are_read_whole() {
    // Name, vertices that triangles use, triangles, edges without a partner.
    let known = [
        ("meshes/fandisk.obj", 6475, 12_946, 0),
        ("meshes/spot.obj", 2930, 5856, 0),
        // The scan's own holes at the base; 1113 of its 35,947 vertices belong to no face.
        ("meshes/stanford-bunny.obj", 34_834, 69_451, 223),
        ("meshes/teapot.obj", 3644, 6320, 160),
        // V − E + F = 2: strips make a closed surface of genus 0, wound alike.
        ("meshes/igea.ply", 134_345, 268_686, 0),
    ];
    for (name, vertices, triangles, open) in known {
        let Some(model) = shared(name) else { return };
        let [mesh] = &model.world.meshes[..] else { panic!("{name}: one mesh") };
        let found = (mesh.positions.len(), mesh.triangles.len(), open_edges(mesh));
        assert_eq!(found, (vertices, triangles, open), "{name}");
        assert_eq!(model.warnings, [], "{name}");
        assert_eq!(mesh.uvs.is_some(), name.contains("spot"), "{name}");
        assert!(volume(mesh) > 0.0, "{name} is inside out");
    }
}

/// Volume within; positive when the faces wind counter-clockwise seen from outside.
fn volume(mesh: &WorldMesh) -> f64 {
    let centre = mesh.positions.iter().sum::<DVec3>() / mesh.positions.len() as f64;
    let parts = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize] - centre);
        a.dot(b.cross(c)) / 6.0
    });
    parts.sum()
}

#[test]
fn the_course_scene_is_read_whole() {
    let Some(Model { world, warnings, .. }) = shared("course/reflective_spheres.obj") else {
        return;
    };
    assert_eq!(warnings, []);
    assert_eq!((world.materials.len(), world.meshes.len(), world.spheres.len()), (4, 1, 2));
    assert_eq!((world.meshes[0].triangles.len(), world.meshes[0].material), (2, 1));
    assert_eq!((world.spheres[1].radius, world.spheres[1].material), (0.4, 3));
    assert_eq!(world.materials[3].mirror, Rgb::new(0.8, 0.0, 0.0));
    let [Light::Quad(light)] = &world.lights[..] else { panic!("one light") };
    assert_eq!((light.area(), light.normal(), light.two_sided), (4.0, DVec3::NEG_Y, true));
    assert_eq!(light.radiance, Rgb::splat(2.0));
}

#[test]
fn colours_above_one_of_a_course_texture_are_cut_with_a_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let bright = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([0.5, 1.0, 3.0]));
    bright.save(folder.path().join("bright.exr")).expect("written");
    let obj = folder.path().join("a.obj");
    let text = "material\nmaterial\ntexture_file bright.exr\nm 1\ns 0 0 0 1\n";
    std::fs::write(&obj, text).expect("written");
    let Model { world, warnings, .. } = load_model(&obj, SMOOTH).expect("read");
    assert_eq!(world.textures[0].levels()[0].texel(0, 0), Rgb::new(0.5, 1.0, 1.0));
    let [warning] = &warnings[..] else { panic!("{warnings:?}") };
    let message = "material 1: `texture_file` bright.exr: colours above 1 are cut to 1: ";
    assert!(warning.message.starts_with(message) && warning.line == Some(3), "{warning}");
}

/// `cargo test --release --lib ten_million -- --ignored --nocapture` says how long import takes.
#[test]
#[ignore = "takes a minute and a gigabyte of disk"]
fn ten_million_triangles() {
    let folder = tempfile::tempdir().expect("a folder");
    let terrain = crate::import::bench_terrain("terrain", 2237, 10.0, 0).expect("a terrain");
    let count = terrain.triangles.len();
    let obj = folder.path().join("terrain.obj");
    write_obj(&terrain, &obj);
    let world = World { meshes: vec![terrain], ..World::default() };
    let ply = folder.path().join("terrain.ply");
    let mut file = std::fs::File::create(&ply).expect("a file");
    crate::import::write_ply(&world, &mut file, &ply).expect("written");
    for (path, policy) in
        [(&ply, NormalPolicy::Flat), (&ply, SMOOTH), (&obj, NormalPolicy::Flat), (&obj, SMOOTH)]
    {
        for _ in 0..3 {
            let start = Start::now();
            let model = load_model(path, policy).expect("read");
            eprintln!("{count} triangles, {policy:?}, {}: {start}", path.display());
            assert_eq!(model.world.meshes[0].triangles.len(), count);
        }
    }
    let start = Start::now();
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(&obj, &options).expect("read");
    eprintln!("{count} triangles, tobj alone on the same OBJ: {start}");
    assert_eq!(models[0].mesh.indices.len(), 3 * count);
}

/// Wall and processor time since a moment; the latter tells more on a busy machine.
struct Start(std::time::Instant, f64);

impl Start {
    fn now() -> Self {
        Self(std::time::Instant::now(), Self::processor_seconds())
    }

    /// User and system time of this process, of Linux; elsewhere 0.
    fn processor_seconds() -> f64 {
        let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
        let after_name = stat.rsplit(") ").next().unwrap_or("");
        let ticks = after_name.split(' ').skip(11).take(2).filter_map(|t| t.parse::<f64>().ok());
        ticks.sum::<f64>() / 100.0
    }
}

impl std::fmt::Display for Start {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let processor = Self::processor_seconds() - self.1;
        write!(f, "{:.2} s, {processor:.2} s of processor", self.0.elapsed().as_secs_f64())
    }
}

fn write_obj(mesh: &WorldMesh, path: &Path) {
    use std::io::Write;
    let mut out = std::io::BufWriter::new(std::fs::File::create(path).expect("a file"));
    for p in &mesh.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z).expect("written");
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1).expect("written");
    }
}
