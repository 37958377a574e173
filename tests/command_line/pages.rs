//! `report` and `accuracy`, as far as no browser is needed (`tests/pages`).

use super::job::{Job, says};
use serde_json::Value;

/// A picture, not a move.
const ONE: &str = r#"
[camera]
still = { eye = [0, 2, 6], target = [0, 0, 0] }
[[mesh]]
file = "cube.obj"
[[light]]
point = { position = [0, 4, 3], intensity = 20 }
"#;

fn text(job: &Job, name: &str) -> String {
    String::from_utf8(job.read(name)).expect("UTF-8")
}

#[test]
fn a_report_names_the_command_and_follows_the_job() {
    let job = Job::new();
    let line = "render cube.obj --size 24x16 --spp 1 --no-video -o o/f_##.png --frames";
    job.done(&format!("{line} 1..2"));
    let said = job.done("report o").out;
    assert!(said.starts_with("o/f.report.html (2 of "), "{said}");
    let page = text(&job, "o/f.report.html");
    assert!(page.contains("-o &#39;o/f_##.png&#39; --frames 1..2"), "the command stands there");
    assert!(page.contains("2 of the move&#39;s"), "and how far it is");
    job.done(&format!("{line} 1..3"));
    assert!(job.done("report o/f.manifest.jsonl -o p.html").out.starts_with("p.html (3 of "));
    assert!(text(&job, "p.html").contains("f_03.png"));
    assert!(job.done("report o -q").out.is_empty());
    // The frames of the job are no less kept for it.
    assert!(job.done(&format!("{line} 1..3")).out.contains("3 kept"));
}

#[test]
fn a_report_shows_complete_frames_and_names_missing_and_damaged_ones() {
    let job = Job::new();
    let line = "render cube.obj --size 24x16 --spp 1 --shadow-samples 64 --sky-samples 64 \
                --frames 1..4 --no-video --maps -q -o";
    job.done(&format!("{line} o/f_##.png"));
    let pictures = |page: &str| page.matches("data:image/jpeg").count();
    job.done("report o -o whole.html");
    let each = pictures(&text(&job, "whole.html")) / 4;
    std::fs::remove_file(job.path("o/f_01.png")).expect("removed");
    std::fs::copy(job.path("o/f_03.png"), job.path("o/f_02.png")).expect("another picture");
    std::fs::write(job.path("o/f_03.png"), &job.read("o/f_03.png")[..90]).expect("truncated");
    std::fs::write(job.path("o/f_04_frame.png"), b"torn").expect("written");
    let said = job.done("report o").out;
    assert!(said.starts_with("o/f.report.html (0 of "), "{said}");
    let page = text(&job, "o/f.report.html");
    let status = job.run("status o").out;
    let damaged = "3 damaged: 2..4";
    let map = "1 with a damaged map, and shown without that map: 4";
    for gap in [damaged, map] {
        assert!(said.contains(gap) && page.contains(&format!("<li>{gap}</li>")), "{gap}: {said}");
    }
    assert!(status.contains(damaged) && said.contains(" missing: 1, 5.."), "{status}{said}");
    assert!(says(&page, "No frame … move"));
    assert!(says(&page, "Frame 4: … map frame … damaged"));
    assert_eq!(pictures(&page), each - 1, "frame 4 and its other maps");
    // The missing and the damaged ones are made again.
    job.done(&format!("{line} o/f_##.png"));
    assert!(job.done("report o").out.starts_with("o/f.report.html (4 of "));
}

#[test]
fn frames_of_other_settings_are_named_and_not_shown() {
    let job = Job::new();
    let line = "render cube.obj --size 24x16 --no-video -q -o o/f_##.png --frames";
    job.done(&format!("{line} 1..4 --spp 1"));
    job.done(&format!("{line} 1..2 --spp 2 --overwrite"));
    let said = job.done("report o").out;
    assert!(said.starts_with("o/f.report.html (2 of "), "{said}");
    assert!(said.contains("2 of other settings: 3..4"), "{said}");
    let page = text(&job, "o/f.report.html");
    assert!(page.contains("<li>2 of other settings: 3..4"));
    assert!(!page.contains("f_03.png"));
}

/// Maps that would be dark, and an audit that there cannot be, are not offered.
#[test]
fn a_report_offers_only_maps_that_hold_something() {
    let job = Job::new();
    let line = "render cube.obj --size 24x16 --spp 1 --shadow-samples 64 --sky-samples 64 \
                --frames 1..4 --no-video --maps -q -o";
    let report = |options: &str, pattern: &str| {
        job.done(&format!("{line} {pattern} {options}"));
        job.done("report o -o p.html -q");
        std::fs::remove_dir_all(job.path("o")).expect("removed");
        text(&job, "p.html")
    };
    let maps = |page: &str| {
        let names = ["provenance", "frame", "distance", "audit"];
        names.map(|name| page.contains(&format!("data-map=\"{name}\"")))
    };
    for pattern in ["o/f_##.png", "o/f_##.exr"] {
        let page = report("--probes 0.2", pattern);
        assert_eq!(maps(&page), [true; 4], "{pattern}");
        let page = report("--policy colour", pattern);
        assert_eq!(maps(&page), [true, true, true, false], "{pattern}");
        assert!(says(&page, "olicy colour … no audit") && !page.contains("none is inferred"));
        // Every frame is a key frame.
        let page = report("--segment 1", pattern);
        assert_eq!(maps(&page), [false; 4], "{pattern}");
        assert!(page.contains("none is inferred"));
    }
}

#[test]
fn a_report_of_a_single_frame_says_so() {
    let job = Job::new();
    std::fs::write(job.path("one.toml"), ONE).expect("written");
    job.done("render one.toml --size 24x16 --spp 1 --no-video -q -o o/f.png");
    assert!(job.done("report o").out.starts_with("o/f.report.html (1 of 1 frame, "));
    assert!(says(&text(&job, "o/f.report.html"), "only frame"));
}

/// A file without a number in its name is whole once its only frame is there, however long the move is.
#[test]
fn a_look_at_one_frame_of_a_move_is_complete() {
    let job = Job::new();
    let line = "render cube.obj --size 24x16 --spp 1 -q -o o/look.png";
    job.done(&format!("{line} --frames 2"));
    for asked in ["o", "o/look.png", "o --frames 2"] {
        let ran = job.done(&format!("status {asked}"));
        assert!(ran.out.starts_with("o/look.png: complete, 1 of 1 frame done"), "{}", ran.out);
    }
    let other = job.run("status o --frames 3");
    assert_eq!(other.code, Some(3), "{}", other.out);
    assert!(job.done("report o").out.starts_with("o/look.report.html (1 of 1 frame, "));
    assert!(says(&text(&job, "o/look.report.html"), "only frame"));
    std::fs::remove_file(job.path("o/look.png")).expect("there");
    let gone = job.run("status o");
    assert!(gone.out.contains("1 missing: 2") && gone.code == Some(3), "{}", gone.out);
}

/// What is said of a manifest that nobody can read is of use to whom it is said.
#[test]
fn a_truncated_manifest_is_refused_with_help() {
    let job = Job::new();
    std::fs::create_dir(job.path("o")).expect("a folder");
    std::fs::write(job.path("o/f.manifest.jsonl"), b"{\"manif").expect("written");
    for line in ["report o", "status o"] {
        let said = job.run(line).err;
        assert!(says(&said, "f.manifest.jsonl … help: tweenray render"), "{said}");
    }
}

#[test]
fn a_report_without_a_manifest_is_refused() {
    let job = Job::new();
    job.refused("report .", "manifest");
    job.refused("report cube.obj", "cube.obj … manifest");
    job.refused("report nowhere", "nowhere … folder");
    let line = "render cube.obj --size 8x8 --spp 1 --frames 1 --no-video";
    job.done(&format!("{line} -o o/a_##.png"));
    job.done(&format!("{line} -o o/b_##.png"));
    job.refused("report o", "a.manifest.jsonl … b.manifest.jsonl");
    job.refused("report o/a.manifest.jsonl -o page.png", "page.png … .html");
    job.refused("report o/a.manifest.jsonl --every 0", "0 … 1..");
}

#[test]
fn errors_are_the_same_on_any_number_of_threads_and_less_with_more_samples() {
    let job = Job::new();
    let line = "accuracy cube.obj --size 32x24 --frames 1,2 --turns 1 --reference-spp 64 \
                --shadow-samples 2 --knobs samples,reuse -q";
    for threads in [1, 3] {
        job.done(&format!("{line} --threads {threads} -o t{threads}"));
    }
    let rows = |folder: &str| -> Vec<Value> {
        let json: Value =
            serde_json::from_slice(&job.read(&format!("{folder}/accuracy.json"))).expect("JSON");
        json["rows"].as_array().expect("rows").clone()
    };
    let (one, three) = (rows("t1"), rows("t3"));
    let measured =
        |row: &Value| (row["options"].clone(), row["errors"].clone(), row["rays"].clone());
    assert!(one.len() > 5 && one.iter().map(measured).eq(three.iter().map(measured)));
    let error = |options: &str| {
        let row = one.iter().find(|row| row["options"] == options).expect("a row");
        row["errors"]["mse"].as_f64().expect("a figure")
    };
    assert!(error("--spp 16") < error("") && error("") < error("--spp 1"));
    assert_eq!(job.names("t1"), ["accuracy.csv", "accuracy.json", "report.html", "sweep"]);
}

#[test]
fn a_sweep_with_invalid_options_is_refused() {
    let job = Job::new();
    job.refused("accuracy cube.obj", "--output <DIR>");
    job.refused("accuracy cube.obj -o a --frames 1,999999", "999999 … 1..48");
    job.refused("accuracy cube.obj -o a --knobs colour", "'colour'");
    job.refused("accuracy cube.obj -o a --turns 0", "1..=1000");
    job.refused("accuracy cube.obj -o a --crop 0,0,8,8", "whole frames … --crop");
}
