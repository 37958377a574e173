//! The file's own camera, and its moves.

use super::build::{File, Written, warns};
use serde_json::{Value, json};
use tweenray::import::{LoadOptions, Loaded};
use tweenray::math::DVec3;
use tweenray::scene::{CameraPath, Light};

const YFOV: f64 = 0.5;

/// A triangle and two cameras: `a` on node `rig` at (0, 0, 5), `b`, which is orthographic, on node `plan`.
fn filmed() -> File {
    let mut file = File::triangle();
    file.add(
        "cameras",
        json!({"name": "a", "type": "perspective", "perspective": {"yfov": YFOV, "znear": 0.1}}),
    );
    file.add(
        "cameras",
        json!({"name": "b", "type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1}}),
    );
    file.add("nodes", json!({"camera": 1, "name": "plan"}));
    file.add("nodes", json!({"camera": 0, "name": "rig", "translation": [0, 0, 5]}));
    file
}

/// Adds an animation of one channel.
fn animate(file: &mut File, target: Value, times: &[f32], kind: (&str, &str), values: &[f32]) {
    let (input, output) = (file.floats("SCALAR", times), file.floats(kind.0, values));
    file.add(
        "animations",
        json!({
            "channels": [{"sampler": 0, "target": target}],
            "samplers": [{"input": input, "output": output, "interpolation": kind.1}],
        }),
    );
}

fn with_fps(file: &File, fps: f64) -> Loaded {
    file.loaded_with(&LoadOptions { fps, ..LoadOptions::default() })
}

fn eye(loaded: &Loaded, frame: u32) -> DVec3 {
    loaded.shot.pose(frame).expect("a frame").eye
}

fn forward(loaded: &Loaded, frame: u32) -> DVec3 {
    loaded.shot.camera(frame, 64, 48).expect("a camera").forward
}

#[test]
fn a_still_camera_looks_along_its_nodes_minus_z() {
    let mut file = filmed();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    file.json["nodes"][2]["rotation"] = json!([0, half, 0, half]);
    let loaded = file.loaded();
    assert!(matches!(loaded.shot.path, CameraPath::Still(_)));
    assert_eq!((loaded.shot.frames, eye(&loaded, 1)), (1, DVec3::Z * 5.0));
    assert!(forward(&loaded, 1).distance(DVec3::NEG_X) < 1e-12);
    assert_eq!(loaded.shot.vfov_degrees, YFOV.to_degrees());
    assert!(loaded.stage.is_none());
    assert!(warns(&loaded.warnings, "the file has a camera and no light at all"));
    assert!(matches!(loaded.world.lights[..], [Light::Directional(_)]));
}

#[test]
fn the_image_has_the_cameras_aspect_unless_a_size_is_asked_for() {
    let mut file = filmed();
    file.json["cameras"][0]["perspective"]["aspectRatio"] = json!(2.5);
    let size = |loaded: Loaded| (loaded.settings.width, loaded.settings.height);
    assert_eq!(size(file.loaded()), (900, 360));
    let asked = LoadOptions { size: Some((64, 48)), ..LoadOptions::default() };
    assert_eq!(size(file.loaded_with(&asked)), (64, 48));
}

#[test]
fn linear_keys_give_frames_from_the_first_to_the_last() {
    let mut file = filmed();
    let target = json!({"node": 2, "path": "translation"});
    animate(&mut file, target, &[0.5, 2.5], ("VEC3", "LINEAR"), &[0., 0., 5., 8., 0., 5.]);
    let loaded = with_fps(&file, 2.0);
    assert_eq!(loaded.shot.frames, 5);
    let xs: Vec<f64> = (1..=5).map(|frame| eye(&loaded, frame).x).collect();
    assert_eq!(xs, [0.0, 2.0, 4.0, 6.0, 8.0]);
    assert_eq!(with_fps(&file, 24.0).shot.frames, 49);
    loaded.shot.validate().expect("a good shot");
}

#[test]
fn rotations_turn_evenly_along_the_shorter_way() {
    let mut file = filmed();
    // From 0 to 90 degrees about y, the last with its sign turned around.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = [0., 0., 0., 1., 0., -half, 0., -half];
    animate(
        &mut file,
        json!({"node": 2, "path": "rotation"}),
        &[0., 3.],
        ("VEC4", "LINEAR"),
        &turns,
    );
    let loaded = with_fps(&file, 1.0);
    let angle = |frame| {
        let to = forward(&loaded, frame);
        (-to.x).atan2(-to.z).to_degrees()
    };
    for (frame, expected) in [(1, 0.0), (2, 30.0), (3, 60.0), (4, 90.0)] {
        assert!((angle(frame) - expected).abs() < 1e-5, "{frame}: {}", angle(frame));
    }
}

#[test]
fn steps_and_cubic_splines_are_those_of_the_format() {
    let mut file = filmed();
    let target = json!({"node": 2, "path": "translation"});
    animate(&mut file, target.clone(), &[0., 1.], ("VEC3", "STEP"), &[0., 0., 5., 8., 0., 5.]);
    let loaded = with_fps(&file, 4.0);
    assert_eq!([eye(&loaded, 4).x, eye(&loaded, 5).x], [0.0, 8.0]);
    let mut file = filmed();
    // Slope before, value, slope after, of two keys two seconds apart.
    let values =
        [[0., 0., 0.], [1., 0., 5.], [3., 0., 0.], [-2., 0., 0.], [5., 0., 5.], [0., 0., 0.]]
            .concat();
    animate(&mut file, target, &[0., 2.], ("VEC3", "CUBICSPLINE"), &values);
    let loaded = with_fps(&file, 2.0);
    // In the middle (1 + 5) / 2 + 2 (3 - -2) / 8; at a quarter by the Hermite weights.
    assert!((eye(&loaded, 3).x - 4.25).abs() < 1e-12);
    let quarter = 0.84375 * 1.0 + 0.140625 * 2.0 * 3.0 + 0.15625 * 5.0 - 0.046875 * 2.0 * -2.0;
    assert!((eye(&loaded, 2).x - quarter).abs() < 1e-12);
}

#[test]
fn nodes_above_a_camera_move_it() {
    let mut file = filmed();
    file.add("nodes", json!({"children": [4], "name": "dolly"}));
    file.add("nodes", json!({"children": [2], "scale": [2, 2, 2], "name": "between"}));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turns = [0., 0., 0., 1., 0., half, 0., half];
    animate(
        &mut file,
        json!({"node": 3, "path": "rotation"}),
        &[0., 1.],
        ("VEC4", "LINEAR"),
        &turns,
    );
    animate(
        &mut file,
        json!({"node": 2, "path": "translation"}),
        &[0., 2.],
        ("VEC3", "LINEAR"),
        &[0., 0., 5., 0., 0., 9.],
    );
    let loaded = with_fps(&file, 1.0);
    // Both animations count: 10 along z, then turned to x, then 18.
    let eyes = [DVec3::Z * 10.0, DVec3::X * 14.0, DVec3::X * 18.0];
    assert_eq!(loaded.shot.frames, 3);
    for (frame, expected) in (1..).zip(eyes) {
        assert!(eye(&loaded, frame).distance(expected) < 1e-5, "{frame}: {}", eye(&loaded, frame));
    }
    assert!(!warns(&loaded.warnings, "the scene is static"));
}

#[test]
fn a_lens_is_moved_by_a_channel_without_a_node() {
    let mut file = filmed();
    let pointer = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}});
    animate(&mut file, pointer, &[0., 1.], ("SCALAR", "LINEAR"), &[0.5, 1.0]);
    let other = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}});
    animate(&mut file, other, &[0., 9.], ("SCALAR", "LINEAR"), &[0.5, 1.0]);
    let loaded = with_fps(&file, 2.0);
    assert_eq!(loaded.shot.frames, 3);
    let vfov: Vec<f64> =
        (1..=3).map(|frame| loaded.shot.vfov_degrees_at(frame).to_radians()).collect();
    assert!(
        vfov.iter().zip([0.5, 0.75, 1.0]).all(|(found, wanted)| (found - wanted).abs() < 1e-12)
    );
    let height = loaded.shot.camera(2, 64, 48).expect("a camera").half_up.length();
    assert!((height - 0.375f64.tan()).abs() < 1e-12);
    assert!(warns(&loaded.warnings, "the animation of `/materials/N/alphaCutoff` is ignored"));
}

#[test]
fn what_glows_dimly_is_no_light() {
    let lit = |emission: f64| {
        let mut file = filmed();
        file.add("materials", json!({"emissiveFactor": [0, emission, 0]}));
        let material = file.json["materials"].as_array().expect("materials").len() - 1;
        file.primitive()["material"] = json!(material);
        let loaded = file.loaded();
        (loaded.world.lights.len(), warns(&loaded.warnings, "no light but what glows dimly"))
    };
    assert!(!lit(1.0).1);
    let (lights, told) = lit(0.001);
    assert!(told && lights >= 1, "{lights}");
}

#[test]
fn mirrored_and_sheared_cameras_are_named() {
    let told = |placed: Value| {
        let mut file = filmed();
        file.json["nodes"][2] = placed;
        file.loaded().warnings.iter().find(|w| w.message.contains("which is ignored")).cloned()
    };
    assert_eq!(told(json!({"camera": 0, "scale": [2, 3, 1], "translation": [0, 0, 5]})), None);
    let mirrored = told(json!({"camera": 0, "scale": [-1, 1, 1], "translation": [0, 0, 5]}));
    assert!(mirrored.expect("a warning").message.contains("mirrored"));
    let matrix = [1., 0.5, 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 5., 1.];
    let sheared = told(json!({"camera": 0, "matrix": matrix}));
    assert!(sheared.expect("a warning").message.contains("sheared"));
}

#[test]
fn cameras_are_chosen_by_node_name_or_number() {
    let mut file = filmed();
    file.add("cameras", json!({"name": "c", "type": "perspective", "perspective": {"yfov": 1}}));
    file.add("nodes", json!({"camera": 2, "name": "far", "translation": [0, 0, 9]}));
    let z = |name: &str| {
        let camera = Some(name.to_owned());
        file.written()
            .load(&LoadOptions { camera, ..LoadOptions::default() })
            .map(|loaded| eye(&loaded, 1).z)
    };
    for (name, expected) in
        [("rig", 5.0), ("a", 5.0), ("far", 9.0), ("c", 9.0), ("1", 5.0), ("2", 9.0)]
    {
        assert_eq!(z(name).expect("a camera"), expected, "{name}");
    }
    let wrong = z("d").expect_err("no camera").to_string();
    let list = "the scene has no camera `d`\n  help: its cameras are 0: `b` on node `plan`, 1: `a` on node `rig`, 2: `c` on node `far`";
    assert!(wrong.ends_with(list), "{wrong}");
    let flat = z("plan").expect_err("orthographic").to_string();
    assert!(
        flat.contains("cameras[1]: the camera `b` is orthographic, which cannot be rendered"),
        "{flat}"
    );
}

#[test]
fn a_camera_that_nobody_chose_is_named_where_there_are_others() {
    let loaded = filmed().loaded();
    let told = "the camera is `a`; --camera takes another of the 2, they are 0: `b` on node `plan`, 1: `a` on node `rig`";
    assert!(warns(&loaded.warnings, told), "{:?}", loaded.warnings);
    let chosen = LoadOptions { camera: Some("rig".into()), ..LoadOptions::default() };
    assert!(!warns(&filmed().loaded_with(&chosen).warnings, "--camera takes"));
    // A scene file has a camera of its own.
    assert!(filmed().model().warnings.is_empty());
    let mut alone = filmed();
    alone.json["nodes"].as_array_mut().expect("nodes").remove(1);
    assert!(!warns(&alone.loaded().warnings, "--camera takes"));
}

#[test]
fn cameras_and_scenes_that_are_not_shown_are_named() {
    let mut file = filmed();
    file.json["scenes"] =
        json!([{"nodes": [1, 2], "name": "plans"}, {"nodes": [0], "name": "shot"}]);
    file.json["scene"] = json!(1);
    let loaded = file.loaded();
    let two = "the file has 2 scenes: its default one is shown, `shot`";
    assert!(warns(&loaded.warnings, two), "{:?}", loaded.warnings);
    assert!(warns(&loaded.warnings, "the camera `a` is on no node of the scene that is shown"));
    assert!(matches!(loaded.shot.path, CameraPath::Orbit { .. }));
}

#[test]
fn without_a_perspective_the_camera_orbits() {
    let mut file = filmed();
    file.json["cameras"][0] = file.json["cameras"][1].clone();
    let loaded = file.loaded();
    assert!(loaded.stage.is_some() && matches!(loaded.shot.path, CameraPath::Orbit { .. }));
    assert!(warns(
        &loaded.warnings,
        "`b` is orthographic, which cannot be rendered: the model is shown on a turntable"
    ));
    let asked = LoadOptions { camera: Some("0".into()), ..LoadOptions::default() };
    let none = File::triangle().written().load(&asked).expect_err("no camera").to_string();
    assert!(none.contains("it has none: leave out --camera"), "{none}");
}

#[test]
fn up_and_scale_move_the_camera_with_its_scene() {
    use tweenray::import::UpAxis;
    let loaded =
        filmed().loaded_with(&LoadOptions { up: UpAxis::Z, scale: 2.0, ..LoadOptions::default() });
    assert_eq!(eye(&loaded, 1), DVec3::Y * 10.0);
    assert!(forward(&loaded, 1).distance(DVec3::NEG_Y) < 1e-12);
}

#[test]
fn camera_and_time_are_for_gltf_alone() {
    for options in [
        LoadOptions { camera: Some("a".into()), ..LoadOptions::default() },
        LoadOptions { time: Some(1.0), ..LoadOptions::default() },
    ] {
        for name in ["scene.toml", "mesh.obj"] {
            let refused =
                super::build::Written::of(name, b"").load(&options).expect_err("usage").to_string();
            assert_eq!(refused, "`--camera` and `--time` are for glTF files, .glb and .gltf");
        }
    }
}

/// [`filmed`] with a third camera `c` on node `high` at (0, 9, 0), and `yfov` for that of `a`.
fn filmed_twice(yfov: Value) -> File {
    let mut file = filmed();
    let lens = json!({"yfov": 1, "znear": -1});
    let camera =
        file.add("cameras", json!({"name": "c", "type": "perspective", "perspective": lens}));
    file.add("nodes", json!({"camera": camera, "name": "high", "translation": [0, 9, 0]}));
    file.json["cameras"][0]["perspective"]["yfov"] = yfov;
    file
}

#[test]
fn a_camera_that_cannot_be_rendered_is_left_out_with_a_warning_unless_it_is_chosen() {
    let faulty = "the camera `a` cannot be rendered: cameras[0].perspective.yfov: ";
    for (yfov, fault) in [
        (json!(0), "a vertical field of view lies between 0 and pi, radians"),
        (json!(null), "expected a number, found null"),
        (json!("wide"), "expected a number, found a text"),
    ] {
        let file = filmed_twice(yfov);
        let loaded = file.loaded();
        assert_eq!(eye(&loaded, 1), DVec3::Y * 9.0);
        let warning = format!("{faulty}{fault}: it is left out");
        assert!(warns(&loaded.warnings, &warning), "{:?}", loaded.warnings);
        let chosen = LoadOptions { camera: Some("a".into()), ..LoadOptions::default() };
        let error = file.written().load(&chosen).expect_err("refused").to_string();
        assert!(error.contains(&format!("{faulty}{fault}")), "{error}");
        let other = LoadOptions { camera: Some("c".into()), ..LoadOptions::default() };
        assert!(warns(&file.loaded_with(&other).warnings, &warning));
    }
    assert!(!warns(&filmed_twice(json!(YFOV)).loaded().warnings, "left out"));
}

#[test]
fn where_no_camera_can_be_rendered_the_first_says_why() {
    let mut file = filmed_twice(json!(4));
    file.json["cameras"][2]["perspective"] = json!({"yfov": 1, "aspectRatio": 0});
    let error = file.written().load(&LoadOptions::default()).expect_err("refused").to_string();
    assert!(error.contains("the camera `a` cannot be rendered: "), "{error}");
    let chosen = LoadOptions { camera: Some("c".into()), ..LoadOptions::default() };
    let error = file.written().load(&chosen).expect_err("refused").to_string();
    let fault =
        "the camera `c` cannot be rendered: cameras[2].perspective.aspectRatio: 0 is out of range";
    assert!(error.contains(fault), "{error}");
}

#[test]
fn a_scene_file_and_a_conversion_take_no_camera_and_none_of_its_faults() {
    let glb = filmed_twice(json!(0));
    let scene = Written::of("scene.toml", b"[[mesh]]\nfile = 'part.glb'\n[sky]\nradiance = 1\n");
    scene.beside("part.glb", &glb.glb());
    let loaded = scene.load(&LoadOptions::default()).expect("a scene");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let from = scene.path.with_file_name("part.glb");
    let report = tweenray::import::convert(&from, &scene.path.with_file_name("part.ply"), None);
    assert_eq!(report.expect("converted").written.triangles, 1);
}
