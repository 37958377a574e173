//! `tweenray render`: files, resuming, refusing, the words around them.

use super::job::{Job, says};
use std::fs;

const SMALL: &str = "--size 48x27 --spp 1 --bounces 1 --sky-samples 2 --no-video";

fn small(rest: &str) -> String {
    format!("render cube.obj {SMALL} {rest}")
}

#[test]
fn frames_are_kept_and_the_rest_rendered() {
    let job = Job::new();
    job.done(&small("--frames 1..2 -o o/f_##.png"));
    let before = job.changed("o/f_01.png");
    let ran = job.done(&small("--frames 1..4 -o o/f_##.png"));
    assert!(says(&ran.out, "4 frames … o/f_##.png … 2 rendered, 2 kept"), "{}", ran.out);
    assert_eq!(job.changed("o/f_01.png"), before);
    let names = ["f.manifest.jsonl", "f_01.png", "f_02.png", "f_03.png", "f_04.png"];
    assert_eq!(job.names("o"), names);
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    assert_eq!(manifest.lines().count(), 5);
    for line in manifest.lines() {
        serde_json::from_str::<serde_json::Value>(line).expect("JSON");
    }
    fs::write(job.path("o/f_03.png"), "torn").expect("written");
    let ran = job.done(&small("--frames 1..4 -o o/f_##.png"));
    assert!(says(&ran.err, "note: o/f_03.png … damaged"), "{}", ran.err);
    assert!(ran.out.contains("1 rendered, 3 kept"), "{}", ran.out);
}

#[test]
fn another_setting_is_refused_by_name_and_overwrite_replaces() {
    let job = Job::new();
    job.done(&small("--frames 1 -o o/f_##.png"));
    let before = job.read("o/f_01.png");
    for (option, words) in [
        ("--seed 7", "seed … 0 … 7"),
        ("--shadow-samples 3", "shadow-samples … 16 … 3"),
        ("--recheck always", "recheck … risky … always"),
        ("--crop 0,0,9,9", "crop … none … 0,0,9,9"),
        ("--intersector oracle", "intersector … embree … oracle"),
    ] {
        job.refused(&small(&format!("--frames 1 -o o/f_##.png {option}")), words);
    }
    assert_eq!(job.read("o/f_01.png"), before);
    fs::write(job.path("cube.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    job.refused(&small("--frames 1 -o o/f_##.png"), "scene content");
    job.done(&small("--frames 1 -o o/f_##.png --overwrite"));
    assert_ne!(job.read("o/f_01.png"), before);
}

#[test]
fn frames_left_from_other_settings_are_never_taken_for_this_sequence() {
    let job = Job::new();
    job.done(&small("--frames 1..3 -o o/f_#.png"));
    job.done(&small("--frames 2 -o o/f_#.png --seed 7 --overwrite"));
    let left = job.read("o/f_1.png");
    job.refused(&small("--frames 1..3 -o o/f_#.png --seed 7"), "o/f_1.png … other");
    assert_eq!(job.read("o/f_1.png"), left);
    let ran = job.done(&small("--frames 1..3 -o o/f_#.png --seed 7 --overwrite"));
    assert!(ran.out.contains("3 rendered"), "{}", ran.out);
    assert_ne!(job.read("o/f_1.png"), left);
}

#[test]
fn another_frame_under_the_same_name_is_refused() {
    let job = Job::new();
    job.done(&small("--frames 1 -o o/look.png"));
    job.refused(&small("--frames 2 -o o/look.png"), "o/look.png … frame 1");
    job.done(&small("--frames 2 -o o/look.png --overwrite"));
}

#[test]
fn statistics_replace_neither_the_scene_nor_a_link() {
    let job = Job::new();
    let before = job.read("cube.obj");
    job.refused(&small("--frames 1 -o o/f.png --stats cube.obj"), "--stats cube.obj … scene");
    assert_eq!(job.read("cube.obj"), before);
    fs::write(job.path("real.json"), "").expect("written");
    std::os::unix::fs::symlink(job.path("real.json"), job.path("link.json")).expect("a link");
    job.done(&small("--frames 1 -o o/f.png --stats link.json"));
    assert!(job.path("link.json").is_symlink());
    assert!(job.read("real.json").starts_with(b"{"));
}

#[test]
fn files_that_no_manifest_lists_are_not_overwritten() {
    let job = Job::new();
    fs::write(job.path("f_01.png"), "mine").expect("written");
    job.refused(&small("--frames 1..2 -o f_##.png"), "f_01.png … exist");
    assert_eq!(job.read("f_01.png"), b"mine");
}

#[test]
fn threads_ranges_and_crops_do_not_change_bytes() {
    let job = Job::new();
    job.done(&small("--frames 1..3 --threads 1 -o a/f_##.ppm"));
    job.done(&small("--frames 3 --threads 2 -o b/f_##.ppm"));
    assert_eq!(job.read("a/f_03.ppm"), job.read("b/f_03.ppm"));
    job.done(&small("--frames 3 --crop 10,5,30,20 -o c/f_##.ppm"));
    let (whole, crop) = (job.read("a/f_03.ppm"), job.read("c/f_03.ppm"));
    assert_eq!(whole.len(), crop.len());
    // The pixels end the file; what lies before them is the header.
    let start = whole.len() - 3 * 48 * 27;
    for y in 0..27 {
        for x in 0..48 {
            let at = start + 3 * (y * 48 + x);
            let inside = (10..30).contains(&x) && (5..20).contains(&y);
            let expected = if inside { &whole[at..at + 3] } else { &[0, 0, 0][..] };
            assert_eq!(&crop[at..at + 3], expected, "pixel {x},{y}");
        }
    }
}

#[test]
fn quiet_prints_nothing_and_otherwise_each_frame_a_line() {
    let job = Job::new();
    let ran = job.done(&small("--frames 1..2 --quiet -o q/f_##.png"));
    assert_eq!((ran.out.as_str(), ran.err.as_str()), ("", ""));
    let ran = job.done(&small("--frames 1..2 --shadow-samples 64 -o p/f_##.png"));
    let lines: Vec<&str> = ran.err.lines().collect();
    assert_eq!(lines.len(), 2, "{}", ran.err);
    assert!(lines[0].starts_with("frame 1 of 2  "), "{}", ran.err);
    assert!(says(lines[0], "Mrays/s … 0 % reused … left"), "{}", ran.err);
}

#[test]
fn stats_are_json_and_count_the_rays_cast() {
    let job = Job::new();
    job.done(&small("--frames 1..2 -o s/f_##.exr --stats stats.json --threads 2"));
    let stats: serde_json::Value =
        serde_json::from_slice(&job.read("stats.json")).expect("valid JSON");
    assert_eq!(stats["rays"]["camera"], 2 * 48 * 27);
    assert_eq!(stats["settings"]["sky_samples"], 2);
    assert_eq!(stats["ranks"][0]["threads"], 2);
    assert_eq!(stats["complete"], true);
    assert!(stats["tracer"].as_str().is_some_and(|t| t.contains("Embree 4.")));
    for key in ["load_seconds", "build_seconds", "render_seconds", "total_seconds"] {
        assert!(stats[key].as_f64().is_some_and(|s| s >= 0.0), "{key}");
    }
    for frame in stats["frames"].as_array().expect("frames") {
        assert!(frame["trace_seconds"].as_f64() > Some(0.0));
        assert!(frame["write_seconds"].as_f64() > Some(0.0));
    }
    let peak = &stats["peak_memory_bytes"];
    assert!(peak.is_null() || peak.as_u64() > Some(1 << 20));
}

#[test]
fn without_ffmpeg_the_command_is_printed_and_the_job_is_done() {
    let job = Job::new();
    let line = "render cube.obj --size 48x27 --spp 1 --frames 1..2 -o v/f_##.png";
    let output = job.command(line).env("PATH", "").output().expect("the program starts");
    let out = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{out}");
    assert!(out.contains("\nffmpeg ") && out.contains("v/f_1-2.mp4"), "{out}");
}

#[test]
fn the_default_output_is_named_after_the_scene() {
    let job = Job::new();
    job.done("render cube.obj --size 16x9 --spp 1 --frames 1 --quiet");
    assert_eq!(job.names("out/cube"), ["frame.manifest.jsonl", "frame_0001.png"]);
}

#[test]
fn a_folder_that_cannot_be_created_is_an_error() {
    let job = Job::new();
    let ran = job.run(&small("--frames 1 -o cube.obj/f_##.png"));
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(says(&ran.err, "error: … cube.obj"), "{}", ran.err);
}

#[test]
fn the_statistics_folder_is_made_before_the_first_frame() {
    let job = Job::new();
    job.done(&small("--frames 1 -o a/f.png --stats deep/er/s.json"));
    assert_eq!(job.names("deep/er"), ["s.json"]);
    let ran = job.run(&small("--frames 1 -o b/f.png --stats cube.obj/s.json"));
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("cube.obj") && !ran.err.contains("frame 1"), "{}", ran.err);
    let folder = job.run(&small("--frames 1 -o b/f.png --stats deep"));
    assert_eq!(folder.code, Some(1), "{}", folder.err);
    assert!(!job.path("b/f.png").exists(), "nothing is rendered");
}

#[test]
fn options_may_stand_in_the_scene_file_and_the_command_line_wins() {
    let job = Job::new();
    let scene = "\
        [camera]\nframes = 8\nstill = { eye = [0, 2, 9], target = [0, 0, 0] }\n\
        [settings]\nsize = [48, 27]\nspp = 1\nframes = [2, 3]\noutput = \"o/f_##.png\"\n\
        stats = \"stats.json\"\nthreads = 1\nvideo = false\nseed = 5\n\
        [[mesh]]\nfile = \"cube.obj\"\n";
    fs::write(job.path("scene.toml"), scene).expect("written");
    let ran = job.done("render scene.toml");
    assert!(!ran.out.contains("video"), "{}", ran.out);
    assert_eq!(job.names("o"), ["f.manifest.jsonl", "f_02.png", "f_03.png"]);
    let stats: serde_json::Value =
        serde_json::from_slice(&job.read("stats.json")).expect("valid JSON");
    assert_eq!(stats["ranks"][0]["threads"], 1);
    // The same setting by the other way is the same job.
    fs::write(job.path("scene.toml"), scene.replace("seed = 5\n", "")).expect("written");
    assert!(job.done("render scene.toml --seed 5").out.contains("2 kept"));
    job.refused("render scene.toml", "seed … 5 … 0");
    job.done("render scene.toml --seed 5 --frames 1 --size 16x9 -o p.png --stats other.json");
    assert_eq!(job.names("o").len(), 3);
    assert!(job.path("p.png").exists() && job.path("other.json").exists());
}

#[test]
fn an_uploaded_picture_is_the_frame_and_decides_the_others() {
    let job = Job::new();
    let colour = |rest: &str| small(&format!("--policy colour {rest}"));
    job.done(&colour("--frames 1..3 -o o/f_##.png"));
    job.done(&colour("--frames 2 -o p/f_##.png --seed 5"));
    let upload = "--upload 2=p/f_02.png";
    job.refused(&colour(&format!("--frames 1..3 -o o/f_##.png {upload}")), "upload");
    job.done(&colour(&format!("--frames 1..3 -o q/f_##.png {upload}")));
    let ran = job.run("compare p/f_02.png q/f_02.png");
    assert_eq!(ran.code, Some(0), "{}{}", ran.out, ran.err);
    assert_eq!(job.read("o/f_01.png"), job.read("q/f_01.png"));
    assert_ne!(job.read("o/f_03.png"), job.read("q/f_03.png"));
    // Its name does not matter, what it shows does.
    fs::copy(job.path("p/f_02.png"), job.path("again.png")).expect("copied");
    let ran = job.done(&colour("--frames 1..3 -o q/f_##.png --upload 2=again.png"));
    assert!(ran.out.contains("0 rendered, 3 kept"), "{}", ran.out);
}

#[test]
fn pictures_that_cannot_be_a_frame_are_refused() {
    let job = Job::new();
    job.done(&small("--frames 1 -o o/f_##.png"));
    let colour = |rest: &str| small(&format!("--policy colour -o p/f_##.png {rest}"));
    job.refused(&small("--policy off --upload 1=o/f_01.png"), "--upload … --policy colour");
    job.refused(&colour("--upload o/f_01.png"), "FRAME=FILE");
    job.refused(&colour("--upload 999=o/f_01.png"), "frame 999");
    job.refused(&colour("--upload 1=o/none.png"), "none.png");
    job.refused(&colour("--upload 1=cube.obj"), "cube.obj");
    job.refused(&colour("--upload 1=o/f_01.png --upload 1=o/f_01.png"), "frame 1 … two");
    job.refused(&colour("--upload 1=o/f_01.png --tone filmic"), "tone");
    fs::write(job.path("a.ppm"), b"P6 1 1 255\nabc").expect("written");
    job.refused(&colour("--upload 1=a.ppm"), "1x1");
}
