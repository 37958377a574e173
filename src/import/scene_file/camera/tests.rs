//! Poses of other programs, against their own formulas.

use crate::error::Error;
use crate::import::{LoadOptions, Loaded, load};
use crate::math::{DMat3, DQuat, DVec3};
use std::path::Path;

/// Loads a scene file of a folder that also holds `files`.
fn load_with(camera: &str, files: &[(&str, &str)]) -> Result<Loaded, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, format!("{camera}\n[settings]\nsize = [80, 40]\n")).expect("written");
    load(&scene, &LoadOptions::default())
}

fn good(camera: &str, files: &[(&str, &str)]) -> Loaded {
    load_with(camera, files).unwrap_or_else(|error| panic!("{error}"))
}

/// The file, line and message of a fault.
fn fault(camera: &str, files: &[(&str, &str)]) -> (String, Option<usize>, String) {
    match load_with(camera, files) {
        Err(Error::Input(d)) => {
            let name = d.file.file_name().expect("a name").to_string_lossy().into_owned();
            (name, d.line, format!("{} {}", d.message, d.help.clone().unwrap_or_default()))
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("no error: {files:?}"),
    }
}

const JSON: &str = "[camera]\nposes = 'transforms.json'\n";
const TXT: &str = "[camera]\nposes = 'images.txt'\n";
const EPS: f64 = 1e-9;

/// The pinhole formula: x right, y down, z forward in the camera.
fn pinhole(p: DVec3, [fx, fy, cx, cy]: [f64; 4]) -> (f64, f64, f64) {
    (fx * p.x / p.z + cx, fy * p.y / p.z + cy, p.z)
}

fn is_near(found: Option<(f64, f64, f64)>, expected: (f64, f64, f64)) {
    let (x, y, z) = found.expect("in front");
    let (ex, ey, ez) = expected;
    assert!(
        (x - ex).abs() < EPS && (y - ey).abs() < EPS && (z - ez).abs() < EPS,
        "{x} {y} {z}: {expected:?}"
    );
}

/// A camera-to-world matrix in OpenGL's convention, as JSON.
fn matrix(turn: DMat3, eye: DVec3) -> String {
    let row = |k: usize| {
        format!("[{}, {}, {}, {}]", turn.col(0)[k], turn.col(1)[k], turn.col(2)[k], eye[k])
    };
    format!("[{}, {}, {}, [0, 0, 0, 1]]", row(0), row(1), row(2))
}

#[test]
fn a_point_is_seen_where_the_formula_of_a_nerf_data_set_says() {
    let (first, second) =
        (DQuat::from_rotation_y(0.3), DQuat::from_axis_angle(DVec3::ONE.normalize(), 0.4));
    let eyes = [DVec3::new(0.5, 1.0, 6.0), DVec3::new(-1.0, 2.0, 5.0)];
    let matrices =
        [(first, eyes[0]), (second, eyes[1])].map(|(q, eye)| matrix(DMat3::from_quat(q), eye));
    let text = format!(
        "{{\"w\": 800, \"h\": 400, \"fl_x\": 700, \"fl_y\": 650, \"cx\": 420, \"cy\": 190, \"aabb_scale\": 4, \"frames\": [\
         {{\"file_path\": \"a.png\", \"transform_matrix\": {}}}, {{\"fl_x\": 900, \"transform_matrix\": {}}}]}}",
        matrices[0], matrices[1]
    );
    let loaded = good(JSON, &[("transforms.json", &text)]);
    assert_eq!(loaded.shot.frames, 2);
    assert!(loaded.files.iter().any(|file| file.ends_with("transforms.json")));
    let p = DVec3::new(0.3, 0.6, 0.2);
    // A frame that has a focal length across alone has it down too.
    for (frame, turn, eye, focal) in
        [(1, first, eyes[0], [700.0, 650.0]), (2, second, eyes[1], [900.0, 900.0])]
    {
        let in_camera = turn.inverse() * (p - eye) * DVec3::new(1.0, -1.0, -1.0);
        let camera = loaded.shot.camera(frame, 800, 400).expect("a camera");
        is_near(camera.project(p), pinhole(in_camera, [focal[0], focal[1], 420.0, 190.0]));
    }
}

#[test]
fn an_angle_alone_is_enough_and_an_axis_can_be_turned_up() {
    // On the file's z axis, which is up, looking down at the origin: x to the right, y upwards in the picture.
    let text = format!(
        "{{\"camera_angle_x\": 1.0, \"frames\": [{{\"transform_matrix\": {}}}]}}",
        matrix(DMat3::IDENTITY, DVec3::Z * 4.0)
    );
    let camera = "[camera]\nposes = { file = 'transforms.json', up = 'z' }\nlens = { radius = 0.1, focus = 3 }\n";
    let shot = good(camera, &[("transforms.json", &text)]).shot;
    let camera = shot.camera(1, 80, 40).expect("a camera");
    assert!(camera.eye.distance(DVec3::Y * 4.0) < EPS && camera.lens.focus() == Some(3.0));
    let focal = 40.0 / 0.5f64.tan();
    // (1, 2, 0) of the file is (1, 0, -2).
    is_near(
        camera.project(DVec3::new(1.0, 0.0, -2.0)),
        (40.0 + focal / 4.0, 20.0 - 2.0 * focal / 4.0, 4.0),
    );
}

#[test]
fn a_point_is_seen_where_the_formula_of_colmap_says() {
    let turns = [
        DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.5),
        DQuat::from_rotation_x(-0.2),
    ];
    let shifts = [DVec3::new(0.1, -0.2, 5.0), DVec3::new(0.0, 0.4, 7.0)];
    let line = |i: usize, camera: u32| {
        let (q, t) = (turns[i] * 2.0, shifts[i]);
        format!(
            "{} {} {} {} {} {} {} {} {camera} a {i}.png\n",
            i + 7,
            q.w,
            q.x,
            q.y,
            q.z,
            t.x,
            t.y,
            t.z
        )
    };
    // The first image has points, the second an empty line for none.
    let images = format!("# a remark\n\n{}1 2 3 4 5 -1\n{}\n", line(0, 4), line(1, 9));
    let cameras = "# CAMERA_ID, MODEL\n4 PINHOLE 800 400 700 710 390 210\n\n9 SIMPLE_PINHOLE 400 200 350 205 95\n";
    let shot = good(TXT, &[("images.txt", &images), ("cameras.txt", cameras)]).shot;
    assert_eq!(shot.frames, 2);
    let p = DVec3::new(0.3, -0.4, 0.7);
    let own =
        [([700.0, 710.0, 390.0, 210.0], (800, 400)), ([350.0, 350.0, 205.0, 95.0], (400, 200))];
    for (i, (intrinsics, (width, height))) in own.into_iter().enumerate() {
        let camera = shot.camera(i as u32 + 1, width, height).expect("a camera");
        is_near(camera.project(p), pinhole(turns[i] * p + shifts[i], intrinsics));
        assert!(camera.project(p - camera.forward * 100.0).is_none());
    }
}

#[test]
fn pose_files_that_are_wrong_are_refused_with_their_place() {
    let one = matrix(DMat3::IDENTITY, DVec3::Z);
    let with = |keys: &str, matrix: &str| {
        format!("{{{keys}\n\"frames\": [{{\"transform_matrix\": {matrix}}}]}}")
    };
    let usual = "\"w\": 800, \"h\": 400, \"fl_x\": 700,";
    let scaled = matrix(DMat3::IDENTITY * 2.0, DVec3::Z);
    let mirrored = matrix(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), DVec3::Z);
    let cases = [
        ("{".into(), Some(1), "no transforms.json"),
        ("[".repeat(100_000), Some(1), "no transforms.json"),
        ("{\n\"frames\": 3}".into(), Some(2), "no transforms.json"),
        ("{\"camera_angle_x\": 1, \"frames\": []}".into(), None, "0 poses"),
        (with("", &one), None, "frames[0]: no field of view"),
        (with("\"fl_x\": 700,", &one), None, "`w` and `h` are missing"),
        (with("\"camera_angle_x\": 4,", &one), None, "between 0 and pi"),
        (with("\"w\": 0, \"h\": 400, \"fl_x\": 700,", &one), None, "size of the pictures"),
        (with("\"w\": 800, \"h\": 400, \"fl_x\": -700,", &one), None, "focal length is [-700.0"),
        (with("\"w\": 800, \"h\": 600, \"fl_x\": 700,", &one), None, "size = [800, 600]"),
        (with(&format!("{usual} \"k1\": 0.1,"), &one), None, "distorted (k1 is 0.1)"),
        (
            with(&format!("{usual} \"camera_model\": \"OPENCV_FISHEYE\","), &one),
            None,
            "OPENCV_FISHEYE is no pinhole",
        ),
        (with(&format!("{usual} \"is_fisheye\": true,"), &one), None, "fisheye"),
        (with(&format!("{usual} \"cx\": 1e9,"), &one), None, "shifted"),
        (with(usual, "[[1, 0], [0, 1]]"), None, "frames[0].transform_matrix: must have four rows"),
        (with(usual, &one.replace("[0, 0, 0, 1]", "[0, 0, 1, 1]")), None, "last row"),
        (with(usual, &one.replace("0, 1]]", "0, 1e999]]")), Some(2), "no transforms.json"),
        (with(usual, &scaled), None, "not 1 long"),
        (with(usual, &mirrored), None, "left-handed"),
        (with(usual, &matrix(DMat3::IDENTITY, DVec3::Z * 1e31)), None, "between -1e30 and 1e30"),
    ];
    for (text, line, wanted) in cases {
        let shown = text.chars().take(80).collect::<String>();
        let (file, found, message) = fault(JSON, &[("transforms.json", &text)]);
        assert!(message.contains(wanted), "{shown}: {message}");
        let is_of_shot = wanted == "shifted";
        assert_eq!(
            (file.as_str(), found),
            if is_of_shot { ("scene.toml", Some(2)) } else { ("transforms.json", line) },
            "{shown}"
        );
    }
}

#[test]
fn distortion_of_0_and_cameras_that_no_image_has_do_not_matter() {
    let cameras = "1 SIMPLE_RADIAL 800 400 700 400 200 0\n2 OPENCV_FISHEYE 800 400 700 700 400 200 1 2 3 4\n3 x\n";
    let shot = |cameras: &str| {
        let images = "1 1 0 0 0 0 0 5 1 a.png\n\n";
        good(TXT, &[("images.txt", images), ("cameras.txt", cameras)]).shot
    };
    let plain = "\u{feff}1 PINHOLE 800 400 700 700 400 200\n";
    let [radial, plain] = [cameras, plain].map(|cameras| shot(cameras).camera(1, 800, 400));
    assert_eq!(radial.expect("a camera"), plain.expect("a camera"));
}

#[test]
fn colmap_files_that_are_wrong_are_refused_with_their_line() {
    let cameras = "1 PINHOLE 800 400 700 700 400 200\n";
    let image = "1 1 0 0 0 0 0 5 1 a.png\n\n";
    let cases = [
        (cameras, "1 1 0 0\n", "images.txt", Some(1), "QZ is missing"),
        (cameras, "#\n1 1 0 zero 0 0 0 5 1 a\n", "images.txt", Some(2), "QY is `zero`"),
        (cameras, "1 0 0 0 0 0 0 5 1 a\n", "images.txt", Some(1), "quaternion"),
        (cameras, "1 1 0 0 0 0 nan 5 1 a\n", "images.txt", Some(1), "TY is NaN"),
        (cameras, "1 1 0 0 0 0 0 5 2 a\n", "images.txt", Some(1), "the camera 2 is not in"),
        (cameras, "1 1 0 0 0 0 0 5 1 a\n2 1 0 0 0 0 0 5 1 b\n", "images.txt", Some(2), "no points"),
        (cameras, "# none\n", "images.txt", None, "0 poses"),
        (
            "1 OPENCV 800 400 700 700 400 200 0 0 1e-3 0\n",
            image,
            "cameras.txt",
            Some(1),
            "OPENCV is distorted",
        ),
        ("1 PINHOLE 800 400 700 700 400\n", image, "cameras.txt", Some(1), "cy is missing"),
        (
            "1 PINHOLE 800 400 700 700 400 200 1\n",
            image,
            "cameras.txt",
            Some(1),
            "fewer parameters",
        ),
        (
            "1 PINHOLE 800 0 700 700 400 200\n",
            image,
            "cameras.txt",
            Some(1),
            "size of the pictures",
        ),
        ("1 PINHOLE 800 400 0 700 400 200\n", image, "cameras.txt", Some(1), "focal length"),
        (
            "1 PINHOLE 8 4 7 7 4 2\n1 PINHOLE 8 4 7 7 4 2\n",
            image,
            "cameras.txt",
            Some(2),
            "second time",
        ),
        ("1 PINHOLE 800 800 700 700 400 400\n", image, "images.txt", None, "size = [800, 800]"),
    ];
    for (cameras, images, file, line, wanted) in cases {
        let found = fault(TXT, &[("images.txt", images), ("cameras.txt", cameras)]);
        assert!(found.2.contains(wanted), "{cameras}{images}{found:?}");
        assert_eq!((found.0.as_str(), found.1), (file, line), "{found:?}");
    }
    let (file, line, message) = fault(TXT, &[("images.txt", image)]);
    assert_eq!((file.as_str(), line), ("scene.toml", Some(2)));
    assert!(message.contains("cameras.txt"), "{message}");
}

#[test]
fn keys_that_do_nothing_beside_poses_are_refused() {
    let text = format!(
        "{{\"camera_angle_x\": 1.0, \"frames\": [{{\"transform_matrix\": {}}}]}}",
        matrix(DMat3::IDENTITY, DVec3::Z)
    );
    for (key, wanted) in [
        ("frames = 3", "`frames` has no effect"),
        ("fov = 30", "`fov` has no effect"),
        ("fov = 40", "`fov` has no effect"),
        ("easing = 'in'", "`easing` has no effect"),
        ("shift = [1, 0]", "`shift` has no effect"),
        ("lens = { radius = 1 }", "a `radius` and a `focus`"),
        ("lens = { f_number = 1, focus = 2 }", "a `radius` and a `focus`"),
        ("still = { eye = [0, 0, 1], target = [0, 0, 0] }", "a path already"),
    ] {
        let (file, _, message) = fault(&format!("{JSON}{key}\n"), &[("transforms.json", &text)]);
        assert!(file == "scene.toml" && message.contains(wanted), "{key}: {message}");
    }
    assert!(
        Path::new("images.TXT")
            .extension()
            .is_some_and(|_| super::colmap::is_images(Path::new("images.TXT")))
    );
}
