//! `tweenray verify`.

use super::job::Job;
use serde_json::Value;

/// A scene of the repository.
fn scene(name: &str) -> String {
    format!("{}/scenes/{name}/scene.toml", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn scenes_pass_and_every_class_is_listed() {
    let job = Job::new();
    for name in ["cornell", "reflective_spheres"] {
        let ran = job.done(&format!("verify {} --rays 300", scene(name)));
        assert!(ran.out.contains("passed: every difference is explained"), "{}", ran.out);
        for word in ["phantom hit", "missed hit", "wrong distance", "shadow leak", "false shadow"] {
            assert!(ran.out.contains(word), "{}", ran.out);
        }
        assert!(ran.err.contains("6 x 300 rays against"), "{}", ran.err);
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
    assert_eq!(classes.len(), 8);
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
fn mistakes_are_told() {
    let job = Job::new();
    job.refused("verify", "<SCENE>");
    job.refused("verify nothing.obj", "nothing.obj");
    job.refused("verify cube.obj --rays 0", "1..=");
    job.refused("verify cube.obj --ray side:1", "kinds are camera, shadow, mirror");
    job.refused("verify cube.obj --ray edge:1 --rays 5", "cannot be used with");
    job.refused("verify cube.obj --threads 0", "1..=4096");
}
