//! The scene of a job, with the command line's options applied to its settings.

use super::args::{SceneArgs, SettingArgs};
use super::exit::as_input;
use super::machine;
use crate::error::{Diagnostic, Error, Result};
use crate::import::{self, Loaded};
use crate::output::FramePattern;
use crate::scene::limits::MAX_EDGE;
use crate::scene::{Aovs, Collapsed, Policy, Scene, Settings};
use crate::shade::SampleSpread;
use std::path::{Path, PathBuf};

/// Reads the scene and applies the options to its settings.
///
/// Errors: `Error::Input` and `Error::Usage`; a scene that cannot be read is bad input too.
pub fn load(scene: &SceneArgs, options: &SettingArgs) -> Result<Loaded> {
    refuse_folder(&scene.scene)?;
    let mut loaded =
        import::load(&scene.scene, &scene.load_options(options.size)).map_err(as_input)?;
    options.apply(&mut loaded.settings);
    check(&loaded.settings)?;
    check_output(&loaded)?;
    Ok(loaded)
}

/// Refuses a folder, and names scene files in it.
fn refuse_folder(path: &Path) -> Result<()> {
    if !path.is_dir() {
        return Ok(());
    }
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let files = entries.map(|entry| entry.path()).filter(|p| p.is_file());
    // Scene files before bare meshes, then by name.
    let rank = |p: &PathBuf| {
        let ending = p.extension()?.to_str()?.to_ascii_lowercase();
        ["toml", "glb", "gltf", "obj", "ply"].iter().position(|known| *known == ending)
    };
    let meant = files.filter_map(|p| Some((rank(&p)?, p))).min();
    let help = meant
        .map_or("a scene is a .toml, .obj, .ply, .glb or .gltf file".into(), |(_, file)| {
            format!("give a file in it: {}", file.display())
        });
    Err(Error::input(path, format!("is a folder, not a scene file\n  help: {help}")))
}

/// Warnings about meshes of the scene at `file`: those that lost triangles to rounding, and bodies of glass that are open.
pub fn mesh_warnings(scene: &Scene, file: &Path) -> Vec<Diagnostic> {
    let warning = |c: &Collapsed| {
        let Collapsed { mesh, lost, of } = c;
        let message = format!(
            "{lost} of the {of} triangles of `{mesh}` are lost: beside the rest of the scene they \
             are too small to be told from a line or a point"
        );
        Diagnostic::new(file, message)
            .help("leave out what is far away from them, or render them apart")
    };
    let collapsed = scene.collapsed.iter().map(warning);
    collapsed.chain(open_glass(&scene.open_glass, file)).collect()
}

/// The warning about bodies of glass that are open, which have these `names`; `None` without any.
fn open_glass(names: &[String], file: &Path) -> Option<Diagnostic> {
    let (first, more) = names.split_first()?;
    let message = match more.len() {
        0 => format!("`{first}` is a body of glass, and its mesh alone does not close it"),
        1 => format!("`{first}` and another mesh are bodies of glass, and alone do not close them"),
        more => format!(
            "`{first}` and {more} other meshes are bodies of glass, and alone do not close them"
        ),
    };
    let message = message + ": light that enters leaves only where another mesh closes it";
    let help = "close it, or make it a pane: `thin = true`";
    Some(Diagnostic::new(file, message).help(help))
}

/// Checks the scene file's output pattern; an error has the place in the file.
fn check_output(loaded: &Loaded) -> Result<()> {
    let (Some(pattern), Some(place)) = (&loaded.options.output, &loaded.output_place) else {
        return Ok(());
    };
    match FramePattern::parse(pattern, loaded.shot.frames) {
        Err(Error::Usage(message)) => Err(Diagnostic { message, ..place.clone() }.into()),
        other => other.map(drop),
    }
}

/// Checks settings that may be wrong only together, as from scene file and command line.
fn check(settings: &Settings) -> Result<()> {
    let Settings { width, height, .. } = *settings;
    if width > MAX_EDGE || height > MAX_EDGE {
        return Err(Error::Usage(format!(
            "the image size {width}x{height} is too large: an edge has at most {MAX_EDGE} pixels"
        )));
    }
    if let Some(crop) = settings.crop {
        if crop.x0 >= crop.x1 || crop.y0 >= crop.y1 || crop.x1 > width || crop.y1 > height {
            return Err(Error::Usage(format!(
                "the crop {},{},{},{} does not lie in the image of {width}x{height} pixels",
                crop.x0, crop.y0, crop.x1, crop.y1
            )));
        }
    }
    check_memory(settings, machine::memory())
}

/// Whether a frame fits into the machine's memory.
fn check_memory(settings: &Settings, memory: Option<u64>) -> Result<()> {
    let need = frame_bytes(settings);
    match memory {
        Some(memory) if need > memory => Err(Error::Usage(format!(
            "a frame of {}x{} pixels takes {:.1} GB of memory while it is rendered and written; \
             this machine has {:.1} GB\n  help: render a smaller --size",
            settings.width,
            settings.height,
            need as f64 * 1e-9,
            memory as f64 * 1e-9
        ))),
        _ => Ok(()),
    }
}

/// Bytes that the frames in memory take at most, pixels alone: colour (12 a pixel) and, if exr frames may hold them,
/// first-hit records (52). There are four of each: one is traced while the one before is encoded, which takes a copy,
/// and its tiles hold their pixels until all are finished, with their places (4). Where pixels take different numbers
/// of samples, what is known of these adds a spread in the frame, one with its place in the tiles, and two numbers (8); under
/// policy surface the probes have two spreads and a number more.
pub fn frame_bytes(settings: &Settings) -> u64 {
    let has_first_hits = settings.aovs.as_ref().is_some_and(Aovs::have_first_hits)
        || settings.reuse.policy == Policy::Colour;
    // A cropped film has the full size, black outside.
    let each = 4 + 4 * (12 + if has_first_hits { 52 } else { 0 });
    let spread = size_of::<SampleSpread>() as u64;
    let of_probes = if settings.reuse.policy == Policy::Surface { 2 * spread + 4 } else { 0 };
    let adaptive = 2 * spread + 4 + 8 + of_probes;
    settings.pixel_count() * (each + if settings.most_spp.is_some() { adaptive } else { 0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Rect;

    #[test]
    fn sizes_and_crops_beyond_reason_are_refused_with_the_figure() {
        let large = Settings { width: 30_000, height: 30_000, ..Settings::default() };
        let error = check_memory(&large, Some(8 << 30)).expect_err("too large").to_string();
        assert!(error.contains("46.8 GB") && error.contains("8.6 GB"), "{error}");
        let adaptive = Settings { most_spp: Some(16), ..large.clone() };
        let error = check_memory(&adaptive, Some(8 << 30)).expect_err("too large").to_string();
        assert!(error.contains("176.4 GB"), "{error}");
        let all = Settings { aovs: Some(Aovs::All), ..large };
        let error = check_memory(&all, Some(8 << 30)).expect_err("too large").to_string();
        assert!(error.contains("234.0 GB"), "{error}");
        assert!(check(&Settings { width: 70_000, ..Settings::default() }).is_err());
        let crop = |x1, y1| Settings {
            crop: Some(Rect { x0: 600, y0: 0, x1, y1 }),
            ..Settings::default()
        };
        assert!(check(&crop(640, 360)).is_ok());
        assert!(check(&crop(641, 360)).is_err());
        assert!(check(&crop(600, 360)).is_err());
    }
}
