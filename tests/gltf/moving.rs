//! Skins and morph targets at a time.

use super::build::{File, U8, Written, warns};
use serde_json::json;
use tweenray::import::{LoadOptions, Loaded};
use tweenray::math::DVec3;

fn at(file: &File, time: f64) -> Loaded {
    file.loaded_with(&LoadOptions { time: Some(time), ..LoadOptions::default() })
}

fn positions(loaded: &Loaded) -> Vec<DVec3> {
    loaded.world.meshes[0].positions.clone()
}

#[test]
fn morph_targets_are_added_by_the_weights_of_the_moment() {
    let mut file = File::triangle();
    let up = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let aside = file.floats("VEC3", &[2., 0., 0., 2., 0., 0., 2., 0., 0.]);
    file.primitive()["targets"] = json!([{"POSITION": up}, {"POSITION": aside}]);
    file.json["meshes"][0]["weights"] = json!([0.5, 0]);
    assert_eq!(positions(&file.loaded())[0], DVec3::Z * 0.5);
    file.json["nodes"][0]["weights"] = json!([0, 0.25]);
    assert_eq!(positions(&file.loaded())[0], DVec3::X * 0.5);
    let times = file.floats("SCALAR", &[1., 3.]);
    let weights = file.floats("SCALAR", &[0., 0., 1., 4.]);
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
        "samplers": [{"input": times, "output": weights}],
    }]);
    let middle = at(&file, 2.0);
    assert_eq!(positions(&middle)[0], DVec3::new(4.0, 0.0, 0.5));
    assert!(warns(
        &middle.warnings,
        "the scene is static: meshes and lights of 1 node are animated"
    ));
    assert!(warns(&middle.warnings, "at 2 s"));
    assert_eq!(positions(&at(&file, 0.0))[0], DVec3::ZERO);
    assert_eq!(positions(&at(&file, 9.0))[0], DVec3::new(8.0, 0.0, 1.0));
}

#[test]
fn a_conversion_takes_the_mesh_as_it_stands_at_a_time() {
    let mut file = File::triangle();
    let up = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    file.primitive()["targets"] = json!([{"POSITION": up}]);
    let (times, weights) = (file.floats("SCALAR", &[0., 2.]), file.floats("SCALAR", &[1., 5.]));
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
        "samplers": [{"input": times, "output": weights}],
    }]);
    let written = file.written();
    for (time, z) in [(None, 1.0), (Some(0.5), 2.0), (Some(9.0), 5.0)] {
        let ply = written.path.with_file_name("out.ply");
        let report = tweenray::import::convert(&written.path, &ply, time).expect("converted");
        assert!(warns(&report.warnings, &format!("at {} s (--time)", time.unwrap_or(0.0))));
        let world = super::build::model(&ply).expect("read back").world;
        assert_eq!(world.meshes[0].positions[0], DVec3::Z * z);
    }
}

#[test]
fn a_skin_moves_vertices_with_their_joints_and_not_with_its_node() {
    let mut file = File::triangle();
    let joints = file.accessor("VEC4", U8, 3, &[0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0]);
    // The weights of the first add up to two: shares count.
    let weights = file.floats("VEC4", &[1., 1., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.]);
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    // The second joint was one to the left when the skin was put on.
    let mut inverse = vec![1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    inverse.extend([1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 1., 0., 0., 1.]);
    let inverse = file.floats("MAT4", &inverse);
    file.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]);
    file.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]}, {"translation": [0, 0, 1], "children": [2]}, {},
    ]);
    let times = file.floats("SCALAR", &[0., 1.]);
    let moved = file.floats("VEC3", &[0., 0., 0., 0., 4., 0.]);
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
        "samplers": [{"input": times, "output": moved}],
    }]);
    let [half, whole, other] =
        [DVec3::new(0.5, 1.0, 1.0), DVec3::new(1.0, 0.0, 1.0), DVec3::new(1.0, 3.0, 1.0)];
    let found = at(&file, 0.5);
    assert_eq!(positions(&found), [half, whole, other]);
    assert!(warns(&found.warnings, "the scene is static"));
}

#[test]
fn an_animated_node_stands_where_it_is_at_the_time() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"mesh": 0, "translation": [7, 0, 0], "scale": [2, 2, 2]}]);
    let times = file.floats("SCALAR", &[0., 1.]);
    let moved = file.floats("VEC3", &[0., 0., 0., 0., 4., 0.]);
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": times, "output": moved, "interpolation": "STEP"}],
    }]);
    assert_eq!(positions(&at(&file, 0.75))[1], DVec3::X * 2.0);
    assert_eq!(positions(&at(&file, 1.0))[1], DVec3::new(2.0, 4.0, 0.0));
}

#[test]
fn a_time_beyond_the_animations_or_without_any_is_said() {
    let mut file = File::triangle();
    let still = file.loaded_with(&LoadOptions { time: Some(2.0), ..LoadOptions::default() });
    assert!(warns(&still.warnings, "2 s (--time) changes nothing"));
    let times = file.floats("SCALAR", &[0.5, 3.]);
    let moved = file.floats("VEC3", &[0., 0., 0., 0., 4., 0.]);
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": times, "output": moved}],
    }]);
    for (time, is_beyond) in [(0.0, false), (0.25, true), (0.5, false), (3.0, false), (4.0, true)] {
        let found = at(&file, time).warnings;
        assert!(!warns(&found, "changes nothing"));
        assert_eq!(
            warns(&found, "the file's animations last from 0.5 to 3 s"),
            is_beyond,
            "{time}"
        );
    }
}

#[test]
fn a_scene_file_says_at_which_time_a_mesh_stands() {
    let mut file = File::triangle();
    let times = file.floats("SCALAR", &[0., 2.]);
    let moved = file.floats("VEC3", &[0., 0., 0., 8., 0., 0.]);
    file.json["animations"] = json!([{
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": times, "output": moved}],
    }]);
    let load = |name: &str, key: &str| {
        let scene = format!("[[mesh]]\nfile = '{name}'\n{key}\n[sky]\nradiance = 1\n");
        let written = Written::of("scene.toml", scene.as_bytes());
        written.beside("part.glb", &file.glb());
        written.beside("part.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        written.load(&LoadOptions::default())
    };
    let still = load("part.glb", "").expect("a scene");
    let later = load("part.glb", "time = 1.5").expect("a scene");
    assert_eq!(positions(&later)[0] - positions(&still)[0], DVec3::X * 6.0);
    assert!(warns(&later.warnings, "at 1.5 s"));
    let refused = load("part.obj", "time = 1.5").expect_err("no glTF").to_string();
    assert!(refused.contains("`time` is for glTF files"), "{refused}");
    assert!(load("part.glb", "time = inf").is_err());
}
