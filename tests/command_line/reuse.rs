//! Reuse between frames as a user meets it: the policies, their words, and the same bytes however a
//! job is cut.

use super::job::{Job, lines_that_say, says};
use serde_json::Value;
use std::fs;

/// A cube on a floor under a lamp, in a mirror; `camera` moves through 9 frames.
fn scene(job: &Job, camera: &str, more: &str) {
    let text = format!(
        "[camera]\n{camera}\n[settings]\nsize = [48, 27]\nspp = 1\nvideo = false\n\
         shadow_samples = 48\nsky_samples = 16\n[sky]\nradiance = 0.3\n\
         [reuse]\nsegment = 4\n{more}\n[material.mirror]\nmirror = 0.9\n\
         [[light]]\nquad = {{ centre = [2, 5, 3], normal = '-y', size = [2, 2], radiance = 20 }}\n\
         [[mesh]]\nquad = {{ centre = [0, -1, 0], normal = 'y', size = [20, 20] }}\n\
         [[mesh]]\nquad = {{ centre = [0, 0, -3], normal = 'z', size = [8, 4] }}\n\
         material = 'mirror'\n[[mesh]]\nfile = 'cube.obj'\n"
    );
    fs::write(job.path("scene.toml"), text).expect("written");
}

const PAN: &str = "frames = 9\npan = { from = [-1, 1.5, 7], to = [1, 1.5, 7], target = [0, 0, 0] }";

fn frames(job: &Job, folder: &str, frames: impl Iterator<Item = u32>) -> Vec<Vec<u8>> {
    frames.map(|frame| job.read(&format!("{folder}/f_{frame}.png"))).collect()
}

/// The pixels of a ppm file, without its head, which names the frame.
fn pixels(job: &Job, name: &str) -> Vec<u8> {
    let bytes = job.read(name);
    bytes[bytes.len() - 48 * 27 * 3..].to_vec()
}

/// The rows of a manifest, in the order of their frames.
fn rows(job: &Job, folder: &str) -> Vec<Value> {
    let text = String::from_utf8(job.read(&format!("{folder}/f.manifest.jsonl"))).expect("UTF-8");
    let row = |line| serde_json::from_str::<Value>(line).expect("JSON");
    let mut rows: Vec<Value> = text.lines().skip(1).map(row).collect();
    rows.sort_by_key(|row| row["frame"].as_u64());
    rows
}

#[test]
fn values_of_reuse_options_are_checked() {
    let job = Job::new();
    job.refused("render cube.obj --policy surfaces", "'surface'");
    job.refused("render cube.obj --segmnt 4", "'--segment'");
    job.refused("render cube.obj --segment 0", "1..=1000000");
    job.refused("render cube.obj --tolerance -1", "from 0 to 255");
    job.refused("render cube.obj --probes 1.5", "from 0 to 1");
    job.refused("render cube.obj --tolerance nan", "from 0 to 255");
    job.refused("inspect cube.obj --colour-epsilon -1", "from 0 to 1e30");
    job.refused("inspect cube.obj --distance-epsilon x", "'x' … --distance-epsilon … number");
    let help = job.done("render --help").out;
    assert!(help.contains("\nReuse:\n") && help.contains("--probes <SHARE>"), "{help}");
}

#[test]
fn frames_of_other_reuse_settings_are_refused() {
    let job = Job::new();
    scene(&job, PAN, "probes = 0.02");
    job.done("render scene.toml --frames 1 -o o/f_#.png");
    for (option, words) in [
        ("--policy off", "policy … surface … off"),
        ("--policy colour", "policy … surface … colour"),
        ("--segment 5", "segment … 4 … 5"),
        ("--tolerance 2", "tolerance … 0.25 … 2"),
        ("--probes 0.5", "probes … 0.02 … 0.5"),
        ("--colour-epsilon 1", "colour-epsilon … 0.02 … 1"),
        ("--distance-epsilon 1", "distance-epsilon … 0.02 … 1"),
    ] {
        job.refused(&format!("render scene.toml --frames 1 -o o/f_#.png {option}"), words);
    }
    scene(&job, PAN, "probes = 0.02\ntraced = [{ min = [0, 0, 0], max = [1, 1, 1] }]");
    job.refused("render scene.toml --frames 1 -o o/f_#.png", "scene content");
}

#[test]
fn the_bytes_do_not_depend_on_threads_ranges_order_or_resuming() {
    let job = Job::new();
    scene(&job, PAN, "");
    let ran = job.done("render scene.toml --threads 4 -o all/f_#.png");
    assert!(says(&ran.err, "% reused … left") && ran.out.contains(" reused"), "{}", ran.out);
    let all = frames(&job, "all", 1..=9);
    for threads in [1, 2] {
        let folder = format!("t{threads}");
        job.done(&format!("render scene.toml --threads {threads} -o {folder}/f_#.png"));
        assert!(frames(&job, &folder, 1..=9) == all, "{threads} threads");
    }
    job.done("render scene.toml --frames 6..7 -o part/f_#.png");
    assert!(frames(&job, "part", 6..=7) == all[5..7], "a part alone");
    job.done("render scene.toml --frames 8 -o part/f_#.png");
    job.done("render scene.toml --frames 2..8 -o part/f_#.png");
    assert!(frames(&job, "part", 2..=8) == all[1..8], "in pieces");
    fs::remove_file(job.path("all/f_3.png")).expect("removed");
    fs::write(job.path("all/f_5.png"), "torn").expect("written");
    assert!(job.done("render scene.toml -o all/f_#.png").out.contains("2 rendered, 7 kept"));
    assert!(frames(&job, "all", 1..=9) == all, "gone on with");
    job.done("render scene.toml --policy off --frames 1..2 -o off/f_#.png");
    let off = frames(&job, "off", 1..=2);
    assert!(off[0] == all[0] && off[1] != all[1], "a key frame is traced, the next inferred");
}

#[test]
fn a_crop_changes_no_pixel_that_it_keeps() {
    let job = Job::new();
    scene(&job, PAN, "");
    job.done("render scene.toml -o all/f_#.ppm");
    for frames in ["1..9", "2"] {
        let line =
            format!("render scene.toml --crop 9,5,30,20 --frames {frames} -o crop{frames}/f_#.ppm");
        job.done(&line);
        let whole = pixels(&job, "all/f_2.ppm");
        let crop = pixels(&job, &format!("crop{frames}/f_2.ppm"));
        for (i, (a, b)) in whole.chunks(3).zip(crop.chunks(3)).enumerate() {
            let (x, y) = (i % 48, i / 48);
            let inside = (9..30).contains(&x) && (5..20).contains(&y);
            assert_eq!(b, if inside { a } else { &[0, 0, 0] }, "{frames}: pixel {x},{y}");
        }
    }
}

#[test]
fn a_still_camera_gives_the_same_pixels_and_renders_once() {
    let job = Job::new();
    scene(&job, "frames = 9\nstill = { eye = [0, 1, 7], target = [0, 0, 0] }", "");
    job.done("render scene.toml -o o/f_#.ppm");
    let all: Vec<Vec<u8>> =
        (1..=9).map(|frame| pixels(&job, &format!("o/f_{frame}.ppm"))).collect();
    assert!(all.iter().all(|frame| *frame == all[0]));
    let rays: Vec<u64> =
        rows(&job, "o").iter().map(|r| r["rays"]["camera"].as_u64().expect("a count")).collect();
    assert_eq!(rays[0], 48 * 27);
    assert!(rays[1..].iter().all(|n| *n == 0), "{rays:?}");
    job.done("render scene.toml --frames 6 -o part/f_#.ppm");
    assert!(pixels(&job, "part/f_6.ppm") == all[0]);
    job.done("render scene.toml --policy off --frames 1..2 -o off/f_#.ppm");
    let off = ["off/f_1.ppm", "off/f_2.ppm"].map(|name| pixels(&job, name));
    assert!(off[0] == all[0] && off[1] != all[0]);
    // With their records for later jobs, and by another process too.
    job.done("render scene.toml --frames 1..4 -o e/f_#.exr --aovs reference");
    job.done("render scene.toml --frames 3 -o f/f_#.exr --aovs reference");
    let exr = ["e/f_1.exr", "e/f_2.exr", "e/f_4.exr", "f/f_3.exr"].map(|name| job.read(name));
    assert!(exr.iter().all(|frame| *frame == exr[0]));
}

#[test]
fn a_cut_to_another_view_reuses_nothing() {
    let job = Job::new();
    // Frame 3 alone stands at another place, which has a floor of its own.
    let pose =
        |at: f64, x: f64| format!("{{ at = {at}, eye = [{x}, 1, 7], target = [{x}, 0, 0] }}");
    let keys: Vec<String> = (0..9)
        .map(|k| pose(f64::from(k) / 8.0, if k == 2 { 300.0 } else { f64::from(k) }))
        .collect();
    scene(&job, &format!("frames = 9\nkeys = [{}]", keys.join(", ")), "");
    let text = fs::read_to_string(job.path("scene.toml")).expect("there");
    // Rays enough to save where there are this few pixels.
    let text = text.replace("sky_samples = 16", "sky_samples = 64");
    let floor = "[[mesh]]\nquad = { centre = [300, -1, 0], normal = 'y', size = [20, 20] }\n";
    fs::write(job.path("scene.toml"), text + floor).expect("written");
    job.done("render scene.toml --frames 2..3 --probes .003 -o o/f_#.png");
    job.done("render scene.toml --frames 2..3 --policy off -o off/f_#.png");
    let (ours, off) = (frames(&job, "o", 2..=3), frames(&job, "off", 2..=3));
    let reuse = |row: &Value| row["reuse"].clone();
    let rows = rows(&job, "o");
    assert!(reuse(&rows[0])["direct_inferred"].as_u64() > Some(0), "{rows:?}");
    assert!(reuse(&rows[1])["direct"].as_u64() > Some(0), "{rows:?}");
    assert_eq!(reuse(&rows[1])["direct_inferred"].as_u64(), Some(0));
    assert!(ours[1] == off[1] && ours[0] != off[0]);
    // Few probes, 6 % of so few pixels, show that there is nothing to infer from.
    let rays = |row: &Value| {
        let kinds = row["rays"].as_object().expect("numbers").values();
        kinds.filter_map(Value::as_f64).sum::<f64>()
    };
    let traced = self::rows(&job, "off");
    let ratio = rays(&rows[1]) / rays(&traced[1]);
    assert!(ratio < 1.1, "{ratio}");
}

#[test]
fn named_meshes_and_regions_are_traced_in_every_frame() {
    let job = Job::new();
    let inferred = |more: &str, folder: &str| {
        scene(&job, PAN, more);
        job.done(&format!("render scene.toml --frames 2..3 -o {folder}/f_#.png --stats s.json"));
        let stats: Value = serde_json::from_slice(&job.read("s.json")).expect("JSON");
        assert!(stats["reference_bytes"].as_u64() > Some(0));
        assert!(stats["frames"][0]["reuse"]["direct"].as_u64() > Some(0));
        let count = |kind: &str| stats["reuse"][kind].as_u64().expect("a count");
        count("direct_inferred") + count("specular_inferred")
    };
    let all = inferred("", "all");
    let half = "traced = [{ min = [-100, -100, -100], max = [0, 100, 100] }]";
    let some = inferred(half, "half");
    assert!(0 < some && some < all, "{some} of {all}");
    let whole = "traced = [{ min = [-100, -100, -100], max = [100, 100, 100] }]";
    assert_eq!(inferred(whole, "none"), 0);
    job.done("render scene.toml --policy off --frames 2..3 -o off/f_#.png");
    assert!(frames(&job, "none", 2..=3) == frames(&job, "off", 2..=3));
    scene(&job, PAN, "");
    let text = fs::read_to_string(job.path("scene.toml")).expect("there");
    fs::write(job.path("scene.toml"), text.replace("[[mesh]]\n", "[[mesh]]\nreuse = false\n"))
        .expect("written");
    job.done("render scene.toml --frames 2..3 -o meshes/f_#.png");
    assert!(frames(&job, "meshes", 2..=3) == frames(&job, "off", 2..=3));
}

#[test]
fn inspect_reports_lookups_and_their_memory() {
    let job = Job::new();
    scene(&job, PAN, "");
    let text = fs::read_to_string(job.path("scene.toml")).expect("there")
        + "[[light]]\npoint = { position = [0, 4, 0], intensity = 5 }\n";
    fs::write(job.path("scene.toml"), text).expect("written");
    let text = job.done("inspect scene.toml").out;
    for words in [
        "policy surface … 3 key frames … 4 frames",
        "light 1, quad … looked up … 48 shadow rays",
        "light 2, point … traced … one hard shadow ray",
        "sky … looked up",
        "references held",
    ] {
        assert_eq!(lines_that_say(&text, words), 1, "{words}\n{text}");
    }
    let none = job.done("inspect scene.toml --shadow-samples 1 --sky-samples 1").out;
    assert!(says(&none, "no light … lookup"), "{none}");
    assert!(job.done("inspect scene.toml --policy off").out.contains("every frame is traced"));
    let json = job.done("inspect scene.toml --json").out;
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let reuse = &json["reuse"];
    assert_eq!((&reuse["policy"], &reuse["key_frames"]), (&"surface".into(), &3.into()));
    assert_eq!(reuse["lights"][1]["looked_up"], false);
    let predicted = reuse["references"]["bytes"].as_u64().expect("bytes");
    job.done("render scene.toml -o o/f_#.png --stats s.json");
    let stats: Value = serde_json::from_slice(&job.read("s.json")).expect("JSON");
    let taken = stats["reference_bytes"].as_u64().expect("bytes");
    assert!(taken <= predicted && predicted < 3 * taken, "{predicted}, in fact {taken}");
}

#[test]
fn inspect_reports_the_memory_of_policy_colour() {
    let job = Job::new();
    scene(&job, PAN, "policy = 'colour'");
    let json = job.done("inspect scene.toml --json").out;
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["reuse"]["key_frames"], 2, "both ends");
    let predicted = json["reuse"]["references"]["bytes"].as_u64().expect("bytes");
    let text = job.done("inspect scene.toml").out;
    assert!(says(&text, "pixels held … 2 key frames"), "{text}");
    let ran = job.done("render scene.toml -o o/f_#.png --stats s.json");
    assert!(says(&ran.out, "% of the pixels … reused"), "{}", ran.out);
    let stats: Value = serde_json::from_slice(&job.read("s.json")).expect("JSON");
    let taken = stats["reference_bytes"].as_u64().expect("bytes");
    assert!(taken <= predicted && predicted < 3 * taken, "{predicted}, in fact {taken}");
}

#[test]
fn inspect_says_what_is_always_traced_and_which_box_is_empty() {
    let job = Job::new();
    let boxes = "traced = [{ min = [0, 0, 0], max = [1, 1, 1] }, \
                 { min = [0, 50, 0], max = [1, 51, 1] }]";
    scene(&job, PAN, boxes);
    let text = fs::read_to_string(job.path("scene.toml")).expect("there");
    let text =
        text.replace("file = 'cube.obj'", "file = 'cube.obj'\nname = 'crate'\nreuse = false");
    fs::write(job.path("scene.toml"), text).expect("written");
    let text = job.done("inspect scene.toml").out;
    assert!(says(&text, "always traced: … mesh crate … 2 boxes"), "{text}");
    assert!(says(&text, "warning: … box 2 … [[reuse.traced]]"), "{text}");
    assert!(!text.contains("box 1 of"), "{text}");
    let colour = job.done("inspect scene.toml --policy colour").out;
    assert!(says(&colour, "2 boxes … policy colour"), "{colour}");
    let json = job.done("inspect scene.toml --json").out;
    let json: Value = serde_json::from_str(&json).expect("JSON");
    let traced = &json["reuse"]["always_traced"];
    assert_eq!((&traced["meshes"][0], &traced["boxes"]), (&"crate".into(), &2.into()));
}

/// A frame whose audit finds it less accurate than a traced one is named when the job ends, also if it was kept, and on the
/// page; with `--strict` the job fails.
#[test]
fn inferred_frames_that_are_less_accurate_than_traced_ones_are_named() {
    let job = Job::new();
    scene(&job, PAN, "probes = 0.2");
    let line = "render scene.toml -o o/f_#.png";
    let worse = "less accurate than";
    assert!(!job.done(line).err.contains(worse));
    // As if the audits of frames 3 and 7 had found errors far above those of tracing.
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    let doctored = |text: &str| {
        let mut row: Value = serde_json::from_str(text).expect("JSON");
        let is_meant = row["frame"] == 3 || row["frame"] == 7;
        if is_meant && row["audit"].is_object() {
            let sums = &mut row["audit"]["sums"];
            let traced = sums["traced"].clone();
            for figure in ["sum", "squares", "largest"] {
                let of = traced[figure].as_f64().expect("a number");
                let times = if figure == "squares" { 1e8 } else { 1e4 };
                sums["shown"][figure] = (of * times).into();
            }
        }
        row.to_string()
    };
    let text: Vec<String> = manifest.lines().map(doctored).collect();
    fs::write(job.path("o/f.manifest.jsonl"), text.join("\n") + "\n").expect("written");
    let kept = job.done(line);
    assert!(kept.out.contains("0 rendered, 9 kept"), "{}", kept.out);
    assert!(
        kept.err.contains("warning: inferred frames") && kept.err.contains("3, 7"),
        "{}",
        kept.err
    );
    assert!(kept.err.contains(worse) && kept.err.contains("--policy off"), "{}", kept.err);
    assert!(job.done("report o -o p.html").err.contains("warning: inferred frames"));
    let page = String::from_utf8(job.read("p.html")).expect("UTF-8");
    assert!(says(&page, "Warning … inferred frames … 3, 7 … <code>--policy</code> off"));
    let strict = job.run(&format!("{line} --strict"));
    assert_eq!(strict.code, Some(1), "{}", strict.err);
    assert!(strict.err.contains("error: inferred frames"), "{}", strict.err);
}

/// A row of boxes under so few rays to the sky that lookups pay at best, and probes show that they do not.
pub fn hopeless(job: &Job) -> &'static str {
    let mut text = "[camera]\nframes = 17\n\
        pan = { from = [-1, 1.5, 7], to = [1, 1.5, 7], target = [0, 0, 0] }\n\
        [settings]\nsize = [32, 18]\nspp = 1\nvideo = false\nsky_samples = 28\n[sky]\nradiance = 0.3\n\
        [reuse]\nsegment = 16\n\
        [[mesh]]\nquad = { centre = [0, -1, 0], normal = 'y', size = [20, 20] }\n"
        .to_string();
    for (x, z) in [(-3.0, 1.0), (-1.8, -1.0), (-0.6, 1.0), (0.6, -1.0), (1.8, 1.0), (3.0, -1.0)] {
        let ([x0, x1], [z0, z1]) = ([x - 0.2, x + 0.2], [z - 0.2, z + 0.2]);
        text += &format!("[[mesh]]\nbox = {{ min = [{x0}, -1, {z0}], max = [{x1}, 0.3, {z1}] }}\n");
    }
    fs::write(job.path("hopeless.toml"), text).expect("written");
    "hopeless.toml"
}

#[test]
fn frames_in_which_nothing_is_to_be_gained_cast_the_rays_of_policy_off() {
    let job = Job::new();
    let scene = hopeless(&job);
    let rays = |folder: &str, options: &str| -> Vec<Value> {
        let line = format!("render {scene} --stats {folder}.json {options} -o {folder}/f_#.png");
        job.done(&line);
        let stats: Value =
            serde_json::from_slice(&job.read(&format!("{folder}.json"))).expect("JSON");
        let mut frames = stats["frames"].as_array().expect("frames").clone();
        frames.sort_by_key(|frame| frame["frame"].as_u64());
        frames.iter().map(|frame| frame["rays"].clone()).collect()
    };
    let (own, off) = (rays("all", ""), rays("off", "--policy off"));
    let more: Vec<usize> = (1..=17).filter(|frame| own[frame - 1] != off[frame - 1]).collect();
    // The middle and the quarters have probes: two frames of them are enough to give up the others.
    assert_eq!(more, [5, 9, 13]);
    assert!(frames(&job, "all", 1..=17) == frames(&job, "off", 1..=17));
}

#[test]
fn frames_that_are_given_up_are_the_same_in_ranges_and_in_files_with_references() {
    let job = Job::new();
    let scene = hopeless(&job);
    for options in ["--aovs reference", "--aovs reference --crop 6,3,26,14", "--aovs position"] {
        // Frames 3 and 7, which are given up, and 6, whose neighbours they are, are asked for one after another.
        for range in ["6..6", "3..7", "1..17"] {
            job.done(&format!("render {scene} --frames {range} {options} -o part/f_#.exr"));
        }
        job.done(&format!("render {scene} {options} -o whole/f_#.exr"));
        for frame in 1..=17 {
            let of = |folder| job.read(&format!("{folder}/f_{frame}.exr"));
            assert!(of("part") == of("whole"), "{options}, frame {frame}");
        }
        for folder in ["part", "whole"] {
            fs::remove_dir_all(job.path(folder)).expect("removed");
        }
    }
}
