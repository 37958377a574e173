//! Renders a data set: for each pose of a scene file, the picture with depth, normals and mesh numbers as one exr.
//! `cargo run --release --example 4_data_set scene.toml out/` where the scene's camera has `poses = "transforms.json"` or
//! COLMAP's `images.txt`. Any other camera move does too.

#![allow(clippy::print_stdout, reason = "a program for people")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use tweenray::error::{Error, Result};
use tweenray::import::{LoadOptions, load};
use tweenray::intersect;
use tweenray::output::{WriteOptions, atomic, write_image};
use tweenray::scene::{Aov, Aovs};
use tweenray::shade::Renderer;

fn main() -> Result<()> {
    let mut words = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(scene), Some(folder)) = (words.next(), words.next()) else {
        return Err(Error::Usage("usage: 4_data_set SCENE FOLDER".into()));
    };
    let frames = render(&scene, &folder)?;
    println!("{frames} frames in {}", folder.display());
    Ok(())
}

/// Renders every frame of a scene file to `frame_####.exr` in `folder`; the number of frames.
pub fn render(scene: &Path, folder: &Path) -> Result<u32> {
    let mut loaded = load(scene, &LoadOptions::default())?;
    // Depth is measured along the view axis, in world units; normals are those of the world.
    loaded.settings.aovs = Some(Aovs::from([Aov::Depth, Aov::Normal, Aov::MeshId]));
    let (settings, shot) = (&loaded.settings, &loaded.shot);
    let scene = loaded.world.into_scene(settings.rules.recentre)?;
    let intersector = intersect::build(&scene, settings, 1)?;
    let renderer = Renderer::new(&scene, settings, &*intersector);
    atomic::create_folder(folder)?;
    let never = AtomicBool::new(false);
    for frame in 1..=shot.frames {
        // Lens, shift and field of view are those of the pose.
        let camera = shot.camera(frame, settings.width, settings.height)?;
        let rendered = renderer.render(&camera, frame, true, &never, &());
        let (film, _) = rendered.ok_or(Error::Stopped)?;
        let file = folder.join(format!("frame_{frame:04}.exr"));
        write_image(file, &film, &WriteOptions::of(settings, Some(frame)))?;
    }
    Ok(shot.frames)
}
