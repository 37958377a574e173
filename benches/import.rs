//! Seconds and memory from a binary PLY of ten million triangles to a scene that can be traced.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

mod support;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use support::timed;
use tweenray::import::{self, LoadOptions};
use tweenray::intersect;
use tweenray::scene::{NormalPolicy, Settings};

/// Vertices along an edge of the grid: 2 · 2236² = 9,999,392 triangles.
const EDGE: u32 = 2237;
/// Reads of the file.
const TURNS: usize = 2;

fn main() {
    support::title("import: a binary PLY of ten million triangles");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("terrain.ply");
    let (written, writing) = timed(|| write_terrain(&file));
    written.expect("the temporary folder has 200 MB");
    let bytes = std::fs::metadata(&file).map_or(0, |m| m.len());
    println!("file: {:.0} MB, made in {writing:.1} s", bytes as f64 * 1e-6);
    println!("memory before: {}", support::peak_memory());
    let mut rows = read_only(&file);
    rows.extend(whole_way(&file));
    support::table(&["step", "seconds", "Mtriangles/s", "peak memory after"], &rows);
    println!("\nload average at the end {}", support::load_average());
}

/// Reading alone, the second and later times from the system's cache.
fn read_only(file: &Path) -> Vec<Vec<String>> {
    (1..=TURNS)
        .map(|turn| {
            let read = || import::load_model(file, NormalPolicy::Flat).expect("a good file");
            let (model, seconds) = timed(read);
            row(&format!("read the mesh ({turn})"), seconds, model.world.meshes[0].triangles.len())
        })
        .collect()
}

/// What `tweenray render terrain.ply` does before the first ray.
fn whole_way(file: &Path) -> Vec<Vec<String>> {
    let (loaded, loading) =
        timed(|| import::load(file, &LoadOptions::default()).expect("a good file"));
    let triangles = loaded.world.meshes[0].triangles.len();
    let mut rows = vec![row("import: read, smooth, frame", loading, triangles)];
    let (scene, seconds) = timed(|| loaded.world.into_scene(true).expect("a scene"));
    rows.push(row("into_scene", seconds, triangles));
    let settings = Settings::default();
    let (layer, seconds) = timed(|| intersect::build(&scene, &settings, 2).expect("a BVH"));
    let name = format!("BVH, 2 threads, {:.0} MB", layer.memory() as f64 * 1e-6);
    rows.push(row(&name, seconds, triangles));
    rows
}

fn row(step: &str, seconds: f64, triangles: usize) -> Vec<String> {
    vec![
        step.into(),
        format!("{seconds:.2}"),
        format!("{:.1}", triangles as f64 / seconds * 1e-6),
        support::peak_memory(),
    ]
}

/// Writes the bench terrain's heights on a grid of `EDGE`² vertices, row by row: peak memory is
/// to be the import's, not this function's.
fn write_terrain(file: &Path) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(file)?);
    let n = EDGE;
    let faces = 2 * (n - 1) * (n - 1);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n",
        n * n
    )?;
    let at = |i: u32| 20.0 * f64::from(i) / f64::from(n - 1) - 10.0;
    for k in 0..n * n {
        let (x, z) = (at(k % n), at(k / n));
        for value in [x, import::terrain_height(x, z), z] {
            out.write_all(&(value as f32).to_le_bytes())?;
        }
    }
    for cell in 0..(n - 1) * (n - 1) {
        let k = cell / (n - 1) * n + cell % (n - 1);
        for triangle in [[k, k + n, k + 1], [k + 1, k + n, k + n + 1]] {
            out.write_all(&[3])?;
            triangle.iter().try_for_each(|i| out.write_all(&i.to_le_bytes()))?;
        }
    }
    out.flush()
}
