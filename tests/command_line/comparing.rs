//! `tweenray compare` and `tweenray convert`.

use super::job::{Job, says};
use std::fs;

/// A 16x12 ppm whose first pixel is `first`, the others grey.
fn picture(job: &Job, name: &str, first: u8) {
    picture_of(job, name, first, 12);
}

fn picture_of(job: &Job, name: &str, first: u8, rows: usize) {
    let mut bytes = format!("P6\n16 {rows}\n255\n").into_bytes();
    bytes.push(first);
    bytes.resize(bytes.len() + 3 * 16 * rows - 1, 128);
    let path = job.path(name);
    fs::create_dir_all(path.parent().expect("a folder")).expect("made");
    fs::write(path, bytes).expect("written");
}

#[test]
fn images_are_compared_and_equal_ones_are_equal() {
    let job = Job::new();
    picture(&job, "a.ppm", 128);
    picture(&job, "b.ppm", 0);
    let same: serde_json::Value =
        serde_json::from_str(&job.done("compare a.ppm a.ppm --json").out).expect("valid JSON");
    assert_eq!(same["pairs"][0]["mse"], 0.0);
    assert!(same["pairs"][0]["psnr"].is_null(), "infinite");
    let other: serde_json::Value =
        serde_json::from_str(&job.done("compare a.ppm b.ppm --json").out).expect("valid JSON");
    let largest = &other["pairs"][0]["largest"];
    assert_eq!((&largest["x"], &largest["y"]), (&0.into(), &0.into()));
    let mse = (128.0f64 / 255.0).powi(2) / (3.0 * 16.0 * 12.0);
    assert!((other["pairs"][0]["mse"].as_f64().expect("a number") - mse).abs() < 1e-9);
    assert!(job.done("compare a.ppm b.ppm").out.contains("0.5020 at 0,0"));
}

#[test]
fn sequences_are_paired_by_number_or_by_name() {
    let job = Job::new();
    for n in 1..=3 {
        picture(&job, &format!("a/f_0{n}.ppm"), 128);
        picture(&job, &format!("b/g{n}.ppm"), 128 + n);
        picture(&job, &format!("c/f_0{n}.ppm"), 128);
    }
    picture(&job, "a/f_04.ppm", 1);
    picture(&job, "a/f_1.ppm", 1);
    let ran = job.done("compare a/f_##.ppm b/g#.ppm");
    assert!(says(&ran.out, "frame … 3"), "{}", ran.out);
    assert!(says(&ran.err, "only A … frame … 4"), "{}", ran.err);
    let json: serde_json::Value =
        serde_json::from_str(&job.done("compare a c --json").out).expect("valid JSON");
    assert_eq!(json["pooled"]["frames"], 3);
    assert_eq!(json["only_in_a"], serde_json::json!(["f_04.ppm", "f_1.ppm"]));
}

#[test]
fn compare_of_folders_leaves_maps_out() {
    let job = Job::new();
    let render = "render cube.obj --size 16x12 --spp 1 --frames 1..2 --no-video";
    job.done(&format!("{render} -o a/f_#.png --maps"));
    job.done(&format!("{render} -o b/f_#.png"));
    assert!(job.names("a").contains(&"f_1_audit.png".into()));
    let ran = job.done("compare a b");
    assert!(!ran.err.contains("only A") && !ran.out.contains("audit"), "{}", ran.err);
}

#[test]
fn images_that_cannot_be_compared_are_bad_input() {
    let job = Job::new();
    picture(&job, "a.ppm", 0);
    picture_of(&job, "tall.ppm", 0, 13);
    picture(&job, "seq/f_1.ppm", 0);
    fs::write(job.path("text.png"), "no picture").expect("written");
    job.refused("compare a.ppm tall.ppm", "size … 16x12 … 16x13");
    job.refused("compare a.ppm none.ppm", "none.ppm");
    job.refused("compare a.ppm text.png", "text.png");
    job.refused("compare a.ppm seq", "sequence");
    job.refused("compare x_##.ppm a.ppm", "no file … x_##.ppm");
}

#[test]
fn a_mesh_becomes_a_ply_that_renders_the_same() {
    let job = Job::new();
    job.done("convert cube.obj cube.ply");
    for scene in ["cube.obj", "cube.ply"] {
        job.done(&format!("render {scene} --frames 2 --size 48x27 --spp 1 -q -o {scene}_####.png"));
    }
    assert_eq!(job.read("cube.obj_0002.png"), job.read("cube.ply_0002.png"));
    job.refused("convert cube.obj cube.stl", ".ply");
    job.refused("convert none.obj cube.ply", "none.obj");
}

#[test]
fn the_schema_is_json() {
    let schema = Job::new().done("schema").out;
    let schema: serde_json::Value = serde_json::from_str(&schema).expect("valid JSON");
    assert!(schema["properties"].is_object());
}
