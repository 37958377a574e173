//! Seconds and memory from a binary PLY of ten million triangles to a scene that can be traced, and to read the same mesh as glTF.
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
    let glb = folder.path().join("terrain.glb");
    write_glb(&file, &glb).expect("the temporary folder has 200 MB more");
    // In turns, so that what else the machine does falls on both.
    let mut rows = Vec::new();
    for turn in 1..=TURNS {
        rows.push(read_only(&file, &format!("read the mesh ({turn})")));
        rows.push(read_only(&glb, &format!("read the mesh as glTF ({turn})")));
    }
    rows.extend(whole_way(&file));
    support::table(&["step", "seconds", "Mtriangles/s", "peak memory after"], &rows);
    println!("\nload average at the end {}", support::load_average());
}

/// Reading alone, the second and later times from the system's cache.
fn read_only(file: &Path, step: &str) -> Vec<String> {
    let read = || import::load_model(file, NormalPolicy::Flat).expect("a good file");
    let (model, seconds) = timed(read);
    row(step, seconds, model.world.meshes[0].triangles.len())
}

/// Writes the mesh of the PLY file `from` as a `.glb`.
fn write_glb(from: &Path, to: &Path) -> io::Result<()> {
    let mesh =
        import::load_model(from, NormalPolicy::Flat).expect("a good file").world.meshes.remove(0);
    let (vertices, indices) = (mesh.positions.len(), 3 * mesh.triangles.len());
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}}}],"bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3"}},{{"bufferView":1,"componentType":5125,"count":{indices},"type":"SCALAR"}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"nodes":[{{"mesh":0}}]}}"#,
        12 * vertices + 4 * indices,
        12 * vertices,
        12 * vertices,
        4 * indices,
    );
    let padding = json.len().next_multiple_of(4) - json.len();
    let (head, body) = ((json.len() + padding) as u32, (12 * vertices + 4 * indices) as u32);
    let mut out = BufWriter::with_capacity(1 << 20, File::create(to)?);
    let word = |x: u32| x.to_le_bytes();
    out.write_all(&[*b"glTF", word(2), word(28 + head + body), word(head), *b"JSON"].concat())?;
    out.write_all(json.as_bytes())?;
    out.write_all(&b"   "[..padding])?;
    out.write_all(&[word(body), *b"BIN\0"].concat())?;
    for p in &mesh.positions {
        p.to_array().iter().try_for_each(|x| out.write_all(&(*x as f32).to_le_bytes()))?;
    }
    mesh.triangles.iter().flatten().try_for_each(|i| out.write_all(&word(*i)))?;
    out.flush()
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
