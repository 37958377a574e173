//! The Blender exporter: `tests/blender/export.py` asserts numbers in the files that it writes, and tweenray reads and
//! renders them. Skipped where no Python with the module `bpy` is found: `TWEENRAY_BLENDER_PYTHON` names one, else it is
//! `python3`.

use std::path::{Path, PathBuf};
use std::process::Command;
use tweenray::import::LoadOptions;
use tweenray::math::DVec3;
use tweenray::scene::{CameraPath, Light};

/// The Python with `bpy`, if there is one.
fn python() -> Option<String> {
    let named = std::env::var("TWEENRAY_BLENDER_PYTHON").ok();
    let python = named.clone().unwrap_or_else(|| "python3".into());
    let found = Command::new(&python).args(["-c", "import bpy, numpy"]).output();
    let works = found.is_ok_and(|output| output.status.success());
    assert!(works || named.is_none(), "TWEENRAY_BLENDER_PYTHON is {python}, which has no `bpy`");
    if !works {
        #[allow(clippy::print_stderr)]
        {
            eprintln!(
                "skipped: {python} has no module `bpy` (TWEENRAY_BLENDER_PYTHON names another)"
            );
        }
    }
    works.then_some(python)
}

/// Runs a script of this project.
fn run(python: &str, script: &str, arguments: &[&Path]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join(script);
    let output = Command::new(python).arg(script).args(arguments).output().expect("it starts");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}");
}

/// Every scene file below `folder`, in order.
fn scene_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let mut files: Vec<PathBuf> = entries.map(|path| path.join("scene.toml")).collect();
    files.retain(|file| file.exists());
    files.sort();
    files
}

#[test]
fn exported_scenes_have_the_right_numbers_and_are_read_and_rendered() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    run(&python, "tests/blender/export.py", &[folder.path()]);
    let files = scene_files(folder.path());
    assert!(files.len() > 20, "{files:?}");
    for file in &files {
        let loaded = tweenray::import::load(file, &LoadOptions::default());
        let loaded = loaded.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        loaded.world.into_scene(true).expect("a scene");
    }
    let everything = folder.path().join("everything");
    let loaded = tweenray::import::load(&everything.join("scene.toml"), &LoadOptions::default())
        .expect("a scene file");
    let CameraPath::Still(pose) = loaded.shot.path else { panic!("a camera that does not move") };
    assert!(pose.eye.distance(DVec3::new(0.0, 3.0, 8.0)) < 1e-6);
    let kinds: Vec<&str> = loaded.world.lights.iter().map(Light::name).collect();
    assert_eq!(kinds, ["quad", "point", "spot", "sun"]);
    let picture = everything.join("picture.png");
    let mut render = Command::new(env!("CARGO_BIN_EXE_tweenray"));
    render.args(["render".as_ref(), everything.join("scene.toml").as_os_str(), "-o".as_ref()]);
    render.arg(&picture).args(["--size", "64x36", "--spp", "4"]);
    assert!(render.output().expect("it starts").status.success());
    let picture = image::open(&picture).expect("a picture").to_rgb8();
    // The softbox lights the floor in the foreground, whose image is blue and yellow; behind it is the sky.
    let [sky, floor] = [(32, 1), (32, 34)].map(|(x, y)| picture.get_pixel(x, y).0);
    assert!(sky.iter().all(|code| *code > 20), "{sky:?}");
    assert!(floor[0].abs_diff(floor[2]) > 20, "{floor:?}");
}

#[test]
fn the_script_names_what_is_wrong() {
    let Some(python) = python() else { return };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/blender/export_tweenray.py");
    let help = Command::new(&python).arg(&script).arg("--help").output().expect("it starts");
    assert!(help.status.success() && String::from_utf8_lossy(&help.stdout).contains("blender -b"));
    for (arguments, wanted) in [
        (vec![], "blender -b"),
        (vec!["absent.blend", "out"], "absent.blend"),
        (vec!["shot.blend", "--output"], "blender -b"),
        (vec!["out"], "no scene is open"),
    ] {
        let output =
            Command::new(&python).arg(&script).args(&arguments).output().expect("it starts");
        assert_eq!(output.status.code(), Some(2));
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(text.contains(wanted), "{text}");
    }
}
