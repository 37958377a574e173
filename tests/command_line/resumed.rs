//! Shots that get longer, and how far a sequence is.

use super::job::{Job, lines_that_say, says};
use std::fs;

/// A scene with a key pose for each of `frames` frames; frame `moved` stands elsewhere.
fn scene(frames: u32, moved: u32) -> String {
    let key = |frame: u32| {
        let height = if frame == moved { 3.5 } else { 2.5 };
        let x = 0.1 * f64::from(frame) - 2.0;
        format!("  {{ eye = [{x}, {height}, 6], target = [0, 0, 0] }},\n")
    };
    let keys: String = (1..=frames).map(key).collect();
    format!(
        "camera = {{ frames = {frames}, keys = [\n{keys}] }}\n\
         sky = {{ radiance = [0.5, 0.6, 0.8], lights = true }}\n\
         mesh = [{{ file = \"cube.obj\" }}]\n"
    )
}

fn folder() -> Job {
    let job = Job::new();
    for (name, frames, moved) in [("short", 12, 0), ("long", 21, 0), ("moved", 12, 6)] {
        fs::write(job.path(format!("{name}.toml")), scene(frames, moved)).expect("written");
    }
    job
}

fn line(scene: &str, out: &str) -> String {
    format!(
        "render {scene}.toml --size 48x27 --spp 2 --sky-samples 64 --segment 8 --no-video -o {out}"
    )
}

#[test]
fn a_longer_shot_keeps_its_frames_and_equals_one_made_at_once() {
    let job = folder();
    for ending in ["png", "exr"] {
        // Motion too, which depends on the frame before.
        let aovs = if ending == "exr" { " --aovs all" } else { "" };
        let (grown, once) = ["g", "o"].map(|to| format!("{to}/f_##.{ending}{aovs}")).into();
        job.done(&line("short", &grown));
        let ran = job.done(&line("long", &grown));
        // Frames 1 to 9 are a whole segment; 10 to 12 were inferred from 12, and are from 17.
        assert!(ran.out.contains("(12 rendered, 9 kept)"), "{}", ran.out);
        assert!(says(&ran.err, "3 frames … frame 10"), "{}", ran.err);
        job.done(&line("long", &once));
        for frame in 1..=21 {
            let name = format!("f_{frame:02}.{ending}");
            assert_eq!(job.read(&format!("g/{name}")), job.read(&format!("o/{name}")), "{name}");
        }
        for folder in ["g", "o"] {
            fs::remove_file(job.path(folder).join("f.manifest.jsonl")).expect("removed");
        }
    }
}

#[test]
fn frames_of_another_camera_move_are_refused_and_kept() {
    let job = folder();
    job.done(&line("short", "o/f_##.png"));
    let before = job.read("o/f_06.png");
    job.refused(&line("moved", "o/f_##.png"), "o/f_06.png … camera");
    assert_eq!(job.read("o/f_06.png"), before);
    let ran = job.done(&line("short", "o/f_##.png"));
    assert!(ran.out.contains("0 rendered, 12 kept"), "{}", ran.out);
}

#[test]
fn status_says_what_is_done_and_what_is_not() {
    let job = folder();
    assert_eq!(job.run("status .").code, Some(2));
    job.done(&format!("{} --frames 1..9", line("short", "o/f_##.png")));
    let ran = job.run("status o");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(says(&ran.out, "not complete … 9 of 12"), "{}", ran.out);
    assert!(ran.out.contains("3 missing: 10..12"), "{}", ran.out);
    job.done("status o --frames 1..9");
    fs::write(job.path("o/f_03.png"), "torn").expect("written");
    let ran = job.run("status o/f_##.png --json");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    let found: serde_json::Value = serde_json::from_str(&ran.out).expect("JSON");
    assert_eq!(found[0]["damaged"], serde_json::json!([3]));
    assert_eq!(found[0]["complete"], false);
    job.done(&line("short", "o/f_##.png"));
    let ran = job.done("status o");
    assert!(says(&ran.out, "o/f_##.png: complete … 12 of 12"), "{}", ran.out);
    // The last segment's frames are to be made again, 1 to 9 are not.
    job.done(&format!("{} --frames 1..9", line("long", "o/f_##.png")));
    let ran = job.run("status o");
    assert!(says(&ran.out, "3 of … camera … 10..12"), "{}", ran.out);
    assert!(ran.out.contains("9 missing: 13..21"), "{}", ran.out);
    assert_eq!(job.run("status o/f_##.exr").code, Some(2), "frames of another kind");
}

/// What lies in a frame's place and is no file is not read: pipes and devices have no end.
#[test]
fn a_pipe_a_device_or_a_folder_in_a_frames_place_is_damaged() {
    let job = Job::new();
    let line = "render cube.obj --size 16x9 --spp 1 --frames 1..5 --no-video -o o/f_##.png";
    job.done(line);
    for frame in 1..=4 {
        fs::remove_file(job.path(format!("o/f_0{frame}.png"))).expect("removed");
    }
    let made = std::process::Command::new("mkfifo").arg(job.path("o/f_01.png")).status();
    assert!(made.expect("mkfifo").success());
    std::os::unix::fs::symlink("/dev/zero", job.path("o/f_02.png")).expect("a link");
    fs::create_dir(job.path("o/f_03.png")).expect("a folder");
    let ran = job.run("status o --frames 1..5");
    assert_eq!(ran.code, Some(3), "{}", ran.err);
    assert!(ran.out.contains("3 damaged: 1..3") && ran.out.contains("1 missing: 4"), "{}", ran.out);
    job.refused(line, "o/f_01.png … not a regular file");
}

/// A folder that is mistyped is told as such.
#[test]
fn a_folder_that_is_not_there_is_named() {
    let job = Job::new();
    job.refused("status nowhere", "folder nowhere");
    job.refused("render cube.obj --references nowhere", "--references nowhere … folder");
}

/// Of several frames of a kind, one line.
#[test]
fn damaged_frames_are_reported_in_one_line() {
    let job = Job::new();
    let line = "render cube.obj --size 16x9 --spp 1 --frames 1..6 --no-video -o o/f_##.png";
    job.done(line);
    for frame in [2, 3, 5] {
        fs::write(job.path(format!("o/f_0{frame}.png")), "no picture").expect("written");
    }
    let ran = job.done(line);
    let notes = ["note: ", "note: o/f_02.png and 2 more … damaged … hash"];
    assert_eq!(notes.map(|words| lines_that_say(&ran.err, words)), [1, 1], "{}", ran.err);
    fs::write(job.path("o/f_04.png"), "no picture").expect("written");
    assert!(says(&job.done(line).err, "o/f_04.png … damaged … hash"));
}

/// What was changed in the scene is told by its name, and no hash.
#[test]
fn changed_parts_of_the_scene_are_named() {
    let job = Job::new();
    let scene = "camera = { still = { eye = [0, 2, 6], target = [0, 0, 0] }, frames = 4 }\n\
        light = [{ point = { position = [3, 5, 2], intensity = 90 } }]\n\
        material.red = { diffuse = [0.6, 0.1, 0.1] }\nmaterial.blue = { diffuse = [0.1, 0.1, 0.6] }\n\
        mesh = [{ file = \"cube.obj\", material = \"red\" }]\n\
        sphere = [{ centre = [2, 0, 0], radius = 0.5, material = \"blue\" }]\n";
    let line = "render s.toml --size 32x18 --no-video --frames 1..2 -o o/f_##.png";
    std::fs::write(job.path("s.toml"), scene).expect("written");
    job.done(line);
    for (from, to, says) in [
        ("[0.6, 0.1, 0.1]", "[0.6, 0.1, 0.2]", "material `red`"),
        ("intensity = 90", "intensity = 91", "light 1"),
        ("radius = 0.5", "radius = 0.6", "sphere 1"),
        ("material = \"blue\" }", "material = \"red\" }", "which material goes where"),
        ("{ file = \"cube.obj\"", "{ file = \"cube.obj\", transform = [{ scale = 2 }]", "mesh 1 `"),
        ("camera =", "sky = { radiance = 0.5 }\ncamera =", "the sky"),
        (
            "material.blue",
            "material.green = { diffuse = 0.5 }\nmaterial.blue",
            "material `green` … new",
        ),
    ] {
        let changed = scene.replacen(from, to, 1);
        assert_ne!(changed, scene);
        std::fs::write(job.path("s.toml"), changed).expect("written");
        job.refused(line, "scene content has changed: ");
        job.refused(line, says);
    }
    std::fs::write(job.path("s.toml"), scene).expect("written");
    assert!(job.done(line).out.contains("2 kept"));
}

/// Whichever job brings the last frame makes the video of all.
#[test]
fn jobs_that_share_a_shot_leave_its_video() {
    let job = Job::new();
    let line =
        |frames: &str| format!("render cube.obj --size 32x18 --frames {frames} -o o/f_##.png");
    let whole = job.path("o/f.mp4");
    let first = job.done(&line("1..20"));
    if first.out.contains("ffmpeg is not installed") {
        eprintln!("skipped: no ffmpeg here");
        return;
    }
    assert!(job.path("o/f_1-20.mp4").exists() && !whole.exists());
    job.done(&line("30..48"));
    assert!(!whole.exists(), "frames are missing");
    let last = job.done(&line("21..29"));
    assert!(
        whole.exists() && last.out.contains("f_21-29.mp4") && last.out.contains("video o/f.mp4"),
        "{}",
        last.out
    );
    let made = job.changed("o/f.mp4");
    job.done(&line("5..6"));
    assert_eq!(job.changed("o/f.mp4"), made, "no frame is new");
    std::fs::remove_file(&whole).expect("removed");
    job.done(&line("7"));
    assert!(whole.exists(), "of a single frame too, where it is missing");
}
