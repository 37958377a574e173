//! `tweenray verify`.

use super::job::{Job, Ran, says};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A scene of the repository.
fn scene(name: &str) -> String {
    format!("{}/scenes/{name}/scene.toml", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn scenes_pass_and_every_class_is_listed() {
    let job = Job::new();
    // The brute force looks at a million triangles in the last one.
    for (name, rays) in
        [("cornell", 300), ("reflective_spheres", 300), ("demo", 64), ("spheres_on_terrain", 16)]
    {
        let ran = job.done(&format!("verify {} --rays {rays}", scene(name)));
        assert!(ran.out.contains("passed"), "{}", ran.out);
        for word in ["phantom hit", "missed hit", "wrong distance", "shadow leak", "false shadow"] {
            assert!(ran.out.contains(word), "{}", ran.out);
        }
        assert!(says(&ran.err, &format!("6 x {rays} rays")), "{}", ran.err);
    }
    assert_eq!(job.names("."), ["cube.obj"], "verify writes nothing");
}

#[test]
fn json_is_one_document_and_quiet_is_quiet() {
    let job = Job::new();
    let ran = job.done("verify cube.obj --rays 100 --seed 3 --json -q");
    assert_eq!(ran.err, "");
    let report: Value = serde_json::from_str(&ran.out).expect("JSON");
    assert_eq!(report["passed"], true);
    assert_eq!(report["seed"], 3);
    assert_eq!(report["rays"]["vertex"], 100);
    let classes = report["classes"].as_array().expect("classes");
    assert_eq!(classes.len(), 11);
    assert_eq!(report["complete"], true);
    assert_eq!(report["past_vertex_limit"], 1e-3);
    assert_eq!(report["past_vertex_allowed"], 1);
    assert_eq!((&report["edge_on_limit"], &report["edge_on_allowed"]), (&1e-4.into(), &1.into()));
    let tie = &classes[0];
    assert_eq!(tie["class"], "tie");
    // Rays at vertices meet several triangles.
    assert!(tie["count"].as_u64() > Some(0) && tie["bound"].as_f64() < Some(1.0), "{tie}");
    let replay = tie["replay"].as_str().expect("a command");
    let ray = tie["worst"]["ray"].as_str().expect("a ray");
    assert_eq!(replay, format!("tweenray verify cube.obj --seed 3 --ray {ray}"));
}

#[test]
fn a_fault_ends_with_1_and_its_command_shows_that_ray() {
    let job = Job::new();
    let ran = job.run(&format!("verify {} --rays 3000 --recheck off", scene("cornell")));
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.out.contains("FAILED: "), "{}", ran.out);
    let replay = ran.out.lines().rfind(|line| line.starts_with("  tweenray verify "));
    let replay = replay.expect("a command").trim().trim_start_matches("tweenray ");
    let again = job.run(replay);
    assert_eq!(again.code, Some(1), "{replay}\n{}", again.err);
    for word in ["from (", "(world (", "corners (", "f64 oracle", "UNEXPLAINED: wrong distance"] {
        assert!(again.out.contains(word), "{word}\n{}", again.out);
    }
    let json = job.run(&format!("{replay} --json"));
    let report: Value = serde_json::from_str(&json.out).expect("JSON");
    assert_eq!((json.code, &report["class"]), (Some(1), &Value::from("wrong-distance")));
}

#[test]
fn invalid_arguments_are_refused() {
    let job = Job::new();
    job.refused("verify", "<SCENE>");
    job.refused("verify nothing.obj", "nothing.obj");
    job.refused("verify cube.obj --rays 0", "1..=");
    job.refused("verify cube.obj --ray side:1", "side:1 … camera, shadow, mirror");
    job.refused("verify cube.obj --ray edge:1 --rays 5", "--ray … --rays");
    job.refused("verify cube.obj --threads 0", "1..=4096");
    job.refused("verify cube.obj --intersector oracle", "--intersector embree");
    job.refused("verify cube.obj --spp 4", "'--spp'");
}

/// Only options that change what is compared are offered.
#[test]
fn help_lists_only_options_that_change_the_comparison() {
    let help = Job::new().done("verify --help").out;
    for word in ["--size", "--seed", "--recheck", "--isa", "--retry", "--rays", "--up"] {
        assert!(help.contains(word), "{word}\n{help}");
    }
    for word in ["--spp", "--tone", "--png-bits", "--flag-bad", "--exposure", "--cutoff", "--crop"]
    {
        assert!(!help.contains(word), "{word}\n{help}");
    }
}

#[test]
fn a_folder_and_an_empty_scene_are_refused() {
    let job = Job::new();
    job.refused("verify .", "./cube.obj");
    fs::write(job.path("scene.toml"), "").expect("written");
    job.refused("verify .", "./scene.toml");
    job.refused("render .", "folder");
    fs::create_dir(job.path("bare")).expect("a folder");
    job.refused("verify bare", ".toml, .obj, .ply, .glb or .gltf");
    job.refused("verify scene.toml", "no geometry");
}

/// A name that is not UTF-8 can be verified; it is printed as well as it can be.
#[cfg(target_os = "linux")]
#[test]
fn a_file_name_that_is_not_utf8_is_accepted() {
    use std::os::unix::ffi::OsStrExt;
    let job = Job::new();
    let name = std::ffi::OsStr::from_bytes(b"cub\xe9.obj");
    fs::rename(job.path("cube.obj"), job.path(name)).expect("renamed");
    let output = job.command("verify --rays 100 -q").arg(name).output().expect("it starts");
    let ran = Ran::of(&output);
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(ran.out.contains("\n  tweenray verify "), "{}", ran.out);
}

#[test]
fn a_stopped_verification_reports_within_a_second() {
    // Other tests run beside it: the fastest of some tells what the program needs.
    let took = (0..8).map(|_| stopped()).find(|took| *took < Duration::from_secs(1));
    assert!(took.is_some(), "eight times longer than a second");
}

/// How long a stopped run took to tell what it had found.
fn stopped() -> Duration {
    let job = Job::new();
    let line = format!("verify {} --rays 100000000 --json", scene("spheres_on_terrain"));
    let mut command = job.command(&line);
    let mut child =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.contains("6 x 100000000 rays") {
        assert!(err.read_line(&mut said).expect("a line") > 0, "{said}");
    }
    // So that there is something to tell.
    std::thread::sleep(Duration::from_secs(2));
    let asked = Instant::now();
    let kill = format!("kill -INT {}", child.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().expect("a shell").success());
    let ran = Ran::of(&child.wait_with_output().expect("it ends"));
    let took = asked.elapsed();
    assert_eq!(ran.code, Some(75));
    err.read_to_string(&mut said).expect("text");
    assert!(said.contains("stopped: "), "{said}");
    let report: Value = serde_json::from_str(&ran.out).expect("JSON");
    assert_eq!((&report["complete"], &report["passed"]), (&false.into(), &false.into()));
    assert!(report["rays"]["camera"].as_u64() > Some(0), "{}", ran.out);
    took
}
