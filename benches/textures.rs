//! What the filter of textures gains and costs: shimmer of a pan over a checkerboard to the horizon at one camera
//! sample, the time of a frame with textures beside the same frame without, and the memory of many images beside what
//! `inspect` predicts.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "../tests/common/checkerboard.rs"]
mod checkerboard;
mod support;

use serde_json::Value;
use std::ffi::OsStr;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::AtomicBool;
use support::Candidate;
use tweenray::film::Film;
use tweenray::intersect;
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{Camera, Corners, Pose, Scene, Settings, Texture, TextureMap, World};
use tweenray::shade::Renderer;

const SIZE: (u32, u32) = (320, 180);
/// Frames of the pan.
const FRAMES: u32 = 60;
/// The pan's turn from frame to frame, radians: 1.5 pixels.
const TURN: f64 = 0.004;
/// Camera samples of the converged frames.
const CONVERGED: u32 = 256;
const TURNS: usize = 11;

fn camera(frame: u32) -> Camera {
    let eye = DVec3::new(0.0, 1.0, 0.0);
    let target = eye + DVec3::new(TURN * f64::from(frame), -0.15, -1.0);
    let pose = Pose { eye, target, up: DVec3::Y, roll_degrees: 0.0 };
    Camera::new(&pose, 40.0, SIZE.0, SIZE.1).expect("a camera")
}

fn settings(spp: u32) -> Settings {
    Settings { width: SIZE.0, height: SIZE.1, spp, most_spp: None, ..Settings::default() }
}

fn render(scene: &Scene, frame: u32, spp: u32) -> Film {
    let settings = settings(spp);
    let intersector = intersect::build(scene, &settings, 2).expect("it builds");
    let renderer = Renderer::new(scene, &settings, &*intersector);
    renderer.render(&camera(frame), 1, false, &AtomicBool::new(false), &()).expect("a frame").0
}

/// What one sample in the middle of each pixel shows without a filter.
fn unfiltered(frame: u32) -> Vec<f32> {
    let camera = camera(frame);
    let pixel = |i: u32| {
        let (x, y) = (f64::from(i % SIZE.0) + 0.5, f64::from(i / SIZE.0) + 0.5);
        let dir = camera.direction(x, y);
        if dir.y < 0.0 {
            checkerboard::colour_at(camera.eye - dir * (camera.eye.y / dir.y)).x
        } else {
            0.0
        }
    };
    (0..SIZE.0 * SIZE.1).map(pixel).collect()
}

fn reds(film: &Film) -> Vec<f32> {
    film.rgb.iter().map(|c| c.x).collect()
}

/// Root mean square over pixels and frames of how the difference from the converged frames changes, and of the
/// difference itself.
fn flicker(errors: &[Vec<f32>]) -> [f64; 2] {
    let rms = |values: Vec<f32>| {
        let sum: f64 = values.iter().map(|v| f64::from(v * v)).sum();
        (sum / values.len() as f64).sqrt()
    };
    let changes = errors.windows(2).flat_map(|two| two[1].iter().zip(&two[0]).map(|(b, a)| b - a));
    [rms(changes.collect()), rms(errors.concat())]
}

fn shimmer() {
    let scene = checkerboard::floor().into_scene(true).expect("a scene");
    let (mut filtered, mut plain) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        let truth = reds(&render(&scene, frame, CONVERGED));
        let off = |seen: Vec<f32>| seen.iter().zip(&truth).map(|(a, b)| a - b).collect::<Vec<_>>();
        filtered.push(off(reds(&render(&scene, frame, 1))));
        plain.push(off(unfiltered(frame)));
    }
    let (filtered, plain) = (flicker(&filtered), flicker(&plain));
    let row = |name: &str, [change, error]: [f64; 2]| {
        vec![name.to_string(), format!("{change:.4}"), format!("{error:.4}")]
    };
    println!("pan of {FRAMES} frames of {} x {}, one camera sample", SIZE.0, SIZE.1);
    println!("beside {CONVERGED} of them; radiance of white is 1");
    let head = ["texture lookups", "change of the error, RMS", "error, RMS"];
    support::table(&head, &[row("at a point", plain), row("filtered", filtered)]);
    println!("ratio of the changes {:.3}; wanted: 0.25", filtered[0] / plain[0]);
}

/// A scene whose materials all lack textures, and the same with them.
type Pair = (&'static str, [World; 2], Camera);

/// A checkerboard of two triangles, where a frame is little else than lookups.
fn board() -> Pair {
    let mut textured = checkerboard::floor();
    // Light that takes no rays is no frame that anybody renders.
    textured.sky.radiance = Rgb::splat(0.5);
    let mut plain = textured.clone();
    plain.materials[0].texture = None;
    ("checkerboard", [plain, textured], camera(0))
}

/// The bench scene, its ground with an image of which a texel is about a pixel.
fn terrain() -> Pair {
    let loaded = support::bench_scene();
    let camera = loaded.shot.camera(8, SIZE.0, SIZE.1).expect("a camera");
    let plain = loaded.world;
    let mut textured = plain.clone();
    let texels = (0..1u32 << 22).map(|i| [(i.wrapping_mul(0x9e37_79b9) >> 24) as u8; 3]);
    textured.textures.push(Texture::from_srgb("noise", [1 << 11; 2], texels.collect()));
    let ground = textured.meshes.iter_mut().max_by_key(|m| m.triangles.len()).expect("a mesh");
    let values = ground.positions.iter().map(|p| Vec2::new(p.x as f32, p.z as f32) * 0.2).collect();
    ground.uvs = Some(Corners { values, corners: None });
    let map = TextureMap::of(textured.textures.len() as u32 - 1);
    textured.materials[ground.material as usize].texture = Some(map);
    ("spheres_on_terrain, its ground", [plain, textured], camera)
}

/// Frames with and without textures.
fn cost() {
    let mut rows = Vec::new();
    for ((name, worlds, camera), spp) in
        [(board(), 1), (board(), 4), (terrain(), 1), (terrain(), 4)]
    {
        let settings = settings(spp);
        let scenes = worlds.map(|world| world.into_scene(true).expect("a scene"));
        let built = [0, 1].map(|k| intersect::build(&scenes[k], &settings, 1).expect("it builds"));
        let mut candidates: Vec<Candidate> = Vec::new();
        for (scene, built) in scenes.iter().zip(&built) {
            let renderer = Renderer::new(scene, &settings, &**built);
            let stop = AtomicBool::new(false);
            let run = move || _ = renderer.render(&camera, 1, false, &stop, &());
            candidates.push((name.to_string(), Box::new(run)));
        }
        let times = support::take_turns(TURNS, &mut candidates);
        let [low, ratio, high] = times[1].over(&times[0]);
        rows.push(vec![
            format!("{name}, {spp} camera samples"),
            format!("{:.1}", 1e3 * times[0].median()),
            format!("{:.1}", 1e3 * times[1].median()),
            format!("{ratio:.3} ({low:.3} to {high:.3})"),
        ]);
    }
    println!("\na frame of {} x {} without textures and with", SIZE.0, SIZE.1);
    support::table(&["", "without, ms", "with, ms", "ratio; wanted: 1.15"], &rows);
}

/// Images of the scene that is weighed, and texels along an edge of each.
const IMAGES: u8 = 64;
const EDGE: u32 = 4096;

/// Writes an image of many colours.
fn write_image(path: &Path, seed: u8) {
    let file = BufWriter::new(File::create(path).expect("a file"));
    let mut encoder = png::Encoder::new(file, EDGE, EDGE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let row: Vec<u8> = (0..3 * EDGE).map(|x| (x as u8).wrapping_mul(2 * seed + 1)).collect();
    let mut image = encoder.write_header().expect("an image");
    image.write_image_data(&row.repeat(EDGE as usize)).expect("an image");
}

/// The memory of a scene of bit-mapped materials: what `inspect` predicts, and the most that rendering a frame takes.
fn memory() {
    let folder = tempfile::tempdir().expect("a folder to work in");
    let mut text =
        "[camera]\nfov = 40\n[[camera.keys]]\nat = 0\neye = [0, 20, 30]\ntarget = [0, 0, 0]\n\
                    [sky]\nradiance = 0.5\n"
            .to_owned();
    for i in 0..IMAGES {
        write_image(&folder.path().join(format!("{i}.png")), i);
        let (x, z) = (2 * i32::from(i % 8) - 8, 2 * i32::from(i / 8) - 8);
        text += &format!(
            "[material.m{i}]\ntexture = \"{i}.png\"\n[[mesh]]\nmaterial = \"m{i}\"\n\
             quad = {{ centre = [{x}, 0, {z}], normal = \"y\", size = [1.8, 1.8] }}\n"
        );
    }
    let (scene, stats) = (folder.path().join("scene.toml"), folder.path().join("stats.json"));
    std::fs::write(&scene, text).expect("a file");
    let run = |command: &str, more: &[&OsStr]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_tweenray"));
        program.arg(command).arg(&scene).args(["--size", "640x360"]).args(more);
        let out = program.output().expect("the program");
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        out.stdout
    };
    let inspected = run("inspect", &["--json".as_ref()]);
    let inspected: Value = serde_json::from_slice(&inspected).expect("JSON");
    let parts = inspected["memory"].as_object().expect("parts").values();
    let predicted: f64 = parts.filter_map(Value::as_f64).sum();
    let frame = folder.path().join("frame.png");
    let [first, quiet, told] = ["--frames=1", "-q", "--stats"].map(OsStr::new);
    run("render", &[first, quiet, told, stats.as_ref(), "-o".as_ref(), frame.as_ref()]);
    let told: Value = serde_json::from_slice(&std::fs::read(stats).expect("a file")).expect("JSON");
    let taken = told["peak_memory_bytes"].as_f64().expect("peak memory");
    println!("\n{IMAGES} materials, each with an image of {EDGE} x {EDGE} texels");
    let row = vec![
        format!("{:.3}", predicted / 1e9),
        format!("{:.3}", taken / 1e9),
        format!("{:.3}", taken / predicted),
    ];
    support::table(&["predicted, GB", "taken at most, GB", "ratio; wanted: 0.9 to 1.1"], &[row]);
}

/// Words pick the parts; without any, all but the memory is measured.
fn main() {
    support::title("textures");
    let picked: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let is_picked = |name| picked.is_empty() || picked.iter().any(|word| word == name);
    if is_picked("shimmer") {
        shimmer();
    }
    if is_picked("cost") {
        cost();
    }
    // It takes more memory than small machines have.
    if picked.iter().any(|word| word == "memory") {
        memory();
    }
}
