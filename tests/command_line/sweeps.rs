//! Sweeps of `accuracy` that are stopped or killed, and go on.

use super::job::{Job, Ran, says};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const LINE: &str = "accuracy cube.obj --size 32x24 --frames 1,2 --turns 2 --reference-spp 64 \
    --shadow-samples 2 --knobs reuse,tree,writing --threads 1";

fn json(job: &Job, folder: &str) -> Value {
    serde_json::from_slice(&job.read(&format!("{folder}/accuracy.json"))).expect("JSON")
}

/// What is the same however often the sweep was stopped.
fn measured(job: &Job, folder: &str) -> Vec<(String, u64, Vec<f64>, Value)> {
    let rows = json(job, folder)["rows"].as_array().expect("rows").clone();
    let of = |row: &Value| {
        let number = |value: &Value| value.as_f64().expect("a figure");
        let turns = row["rmse_of_turns"].as_array().expect("turns");
        let timed = row["seconds"]["turns"].as_array().expect("turns").len() as u64;
        let name = row["options"].as_str().expect("options").to_string();
        (name, timed, turns.iter().map(number).collect(), row["change"].clone())
    };
    rows.iter().map(of).collect()
}

fn assert_same(job: &Job, a: &str, b: &str) {
    let (a, b) = (measured(job, a), measured(job, b));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert_eq!((&a.0, a.1, a.2.len()), (&b.0, b.1, b.2.len()));
        // JSON gives figures back but for their last digit.
        let near = |(x, y): (&f64, &f64)| (x - y).abs() <= 1e-9 * x.abs();
        assert!(a.2.iter().zip(&b.2).all(near), "{a:?} {b:?}");
        for part in ["pixels", "differing", "over_2"] {
            assert_eq!(a.3[part], b.3[part], "{} {part}", a.0);
        }
    }
}

#[test]
fn denoised_frames_stand_beside_those_that_are_not() {
    let job = Job::new();
    // By another process: a program that is open for writing here does not run.
    let program = |name: &str, script: &str| {
        let help = "[ $1 = --help ] && echo Open Image Denoise && exit";
        let mut write = Command::new("sh");
        write.args(["-c", r#"printf %s "$1" > "$0" && chmod +x "$0""#]).arg(job.path(name));
        let status = write.arg(format!("#!/bin/sh\n{help}\n{script}\n")).status();
        assert!(status.expect("a shell").success());
    };
    // Options: --device cpu --threads 1 --hdr COLOUR --alb ALBEDO --nrm NORMAL -o OUT.
    program("colour", "cp $6 ${12}");
    program("albedo", "i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done; cp $8 ${12}");
    let line =
        "accuracy cube.obj --size 16x12 --frames 1,2 --turns 1 --reference-spp 64 --threads 1";
    let defaults = |denoiser: &str| {
        let options = format!("--knobs denoiser --denoiser ./{denoiser} -o o_{denoiser} -q");
        job.done(&format!("{line} {options}"));
        let rows = json(&job, &format!("o_{denoiser}"))["rows"].as_array().expect("rows").clone();
        [false, true].map(|is_denoised| {
            let is_meant =
                |row: &&Value| row["options"] == "" && (row["knob"] == "denoiser") == is_denoised;
            rows.iter().find(is_meant).expect("a row").clone()
        })
    };
    let [noisy, denoised] = defaults("colour");
    assert_eq!(noisy["errors"], denoised["errors"]);
    let [noisy, denoised] = defaults("albedo");
    let rmse = |row: &Value| row["errors"]["rmse_steps"].as_f64().expect("a figure");
    assert!(rmse(&denoised) > rmse(&noisy) + 1.0, "its picture counts");
    let cpu = |row: &Value| row["cpu_seconds"]["estimate"].as_f64().expect("a figure");
    assert!(cpu(&denoised) > cpu(&noisy) + 0.02, "its time counts");
    let page = String::from_utf8(job.read("o_colour/report.html")).expect("text");
    assert!(page.contains("default, denoised") && page.contains("--aovs albedo,normal"));

    job.refused(&format!("{line} --knobs denoiser --denoiser no-such -o p"), "no-such");
    job.refused(&format!("{line} --denoiser true -o p"), "is not oidnDenoise");
    // Another denoiser makes another sweep.
    let other = format!("{line} --knobs denoiser --denoiser ./albedo -o o_colour");
    job.refused(&other, "denoiser was");
    // Where no option asks for one, the page says what is missing.
    let mut all = job.command(&format!("{line} -o q -q"));
    assert!(all.env("PATH", "").status().expect("it starts").success());
    let page = String::from_utf8(job.read("q/report.html")).expect("text");
    assert!(page.contains("Left out: oidnDenoise"));
}

#[test]
fn a_sweep_that_is_killed_again_and_again_measures_what_a_whole_one_does() {
    let job = Job::new();
    let start = Instant::now();
    job.done(&format!("{LINE} -o whole -q"));
    let whole = start.elapsed();
    let mut kills = 0;
    for part in 1.. {
        // Short at first, so that it is killed in every stage; then long enough to end.
        let patience = whole.mul_f64(0.1 * f64::from(part));
        let mut child = job.command(&format!("{LINE} -o o -q")).spawn().expect("it starts");
        let start = Instant::now();
        let status = loop {
            match child.try_wait().expect("a child") {
                None if start.elapsed() > patience => break None,
                None => std::thread::sleep(Duration::from_millis(2)),
                status => break status,
            }
        };
        if let Some(status) = status {
            assert!(status.success(), "{status}");
            break;
        }
        child.kill().and_then(|()| child.wait().map(drop)).expect("killed");
        kills += 1;
    }
    assert!(kills > 0);
    assert_same(&job, "whole", "o");
    // Nothing is left to be measured.
    let again = job.done(&format!("{LINE} -o o"));
    assert!(says(&again.err, "measured"), "{}", again.err);
}

#[test]
fn a_sweep_that_is_stopped_has_a_page_that_says_so_and_goes_on() {
    let job = Job::new();
    let line = format!("{LINE} -o o");
    let mut child = job.command(&line).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut told = String::new();
    while !told.contains("turn 2") {
        assert!(err.read_line(&mut told).expect("text") > 0, "{told}");
    }
    let kill = format!("kill -TERM {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().expect("a shell").success());
    err.read_to_string(&mut told).expect("text");
    assert_eq!(child.wait().expect("a child").code(), Some(75), "{told}");
    assert!(says(&told, "SIGTERM … same command"), "{told}");
    let page = || String::from_utf8(job.read("o/report.html")).expect("UTF-8");
    assert!(page().contains("not complete"));
    let trials = json(&job, "o")["trials"].clone();
    assert!(trials[0].as_u64() < trials[1].as_u64(), "{trials}");

    let Ran { err, .. } = job.done(&line);
    assert!(err.contains("going on: "), "{err}");
    assert!(!err.contains("reference: ") && !err.contains("turn 1"), "{err}");
    assert!(!page().contains("not complete"));
    // Its commands render what was measured.
    let given = "tweenray render cube.obj --size 32x24 --shadow-samples 2";
    for command in [format!("{given}\""), format!("{given} --build-quality high\"")] {
        assert!(page().contains(&command), "{command}");
    }
    assert_eq!((json(&job, "o")["trials"][0].clone(), json(&job, "o")["runs"].clone()), {
        (trials[1].clone(), 2.into())
    });
    // What is there is of these settings alone, unless it is measured anew.
    job.refused(&format!("{line} --seed 3"), "seed … 0 … 3");
    let more = line.replace("--turns 2", "--turns 3");
    assert!(job.done(&more).err.contains("going on: "));
    assert!(!job.done(&format!("{line} --seed 3 --overwrite")).err.contains("going on"));
}

#[test]
fn a_sweep_obeys_the_time_limit_of_the_scene_file() {
    let job = Job::new();
    let scene = "[camera]\nframes = 4\n[settings]\ntime_limit = '1s'\nthreads = 1\n\
                 [sky]\nradiance = 0.5\n[[mesh]]\nfile = 'cube.obj'\n";
    std::fs::write(job.path("limited.toml"), scene).expect("written");
    let ran = job.run("accuracy limited.toml -o o --size 640x360 --reference-spp 4096");
    assert_eq!(ran.code, Some(75), "{}", ran.err);
    assert!(says(&ran.err, "time limit … 1.0 s"), "{}", ran.err);
}
