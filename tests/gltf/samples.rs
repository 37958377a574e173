//! Files of other programs, where they are on this machine.

use super::build::model;
use std::path::{Path, PathBuf};
use tweenray::import::{LoadOptions, load};
use tweenray::scene::{CameraPath, Light};

/// The folder of the files; without it a test says that it skips.
fn folder() -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/gltf"));
    if folder.is_dir() {
        return Some(folder.into());
    }
    #[allow(clippy::print_stderr)]
    {
        eprintln!("skipped: {} is not on this machine", folder.display());
    }
    None
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    for path in entries {
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|e| e == "glb" || e == "gltf") {
            found.push(path);
        }
    }
}

#[test]
fn every_file_is_read_or_refused_with_its_place() {
    let Some(folder) = folder() else { return };
    let mut found = Vec::new();
    files(&folder, &mut found);
    assert!(!found.is_empty());
    for path in found {
        match model(&path) {
            Ok(model) => {
                super::mutations::sound(&model, &path.display().to_string());
                assert!(model.world.into_scene(true).is_ok(), "{}", path.display());
            }
            // A folder without the buffers that its file names.
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains("buffers[0]: cannot read"), "{text}");
            }
        }
    }
}

#[test]
fn an_animated_lens_of_blender_is_read() {
    let Some(folder) = folder() else { return };
    let path = folder.join("from_blender/ptr_scene.gltf");
    let loaded = load(&path, &LoadOptions::default()).expect("a scene");
    let CameraPath::Frames(frames) = &loaded.shot.path else { panic!("an animated camera") };
    assert_eq!(frames.len(), 48);
    let [first, last] = [&frames[0], &frames[47]].map(|frame| frame.vfov_degrees);
    assert!((first - last).abs() > 1.0, "{first} {last}");
    // One mesh emits, and reflects too.
    assert_eq!(loaded.world.lights.len(), 3);
    let lights = loaded.world.into_scene(true).expect("a scene").lights;
    assert!(lights.iter().any(|light| matches!(light, Light::Face(_))));
}
