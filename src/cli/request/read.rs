//! Reading the files of a job, with the command line's options applied.

use super::{Hashes, Request};
use crate::cli::args::{JobArgs, SceneArgs, SettingArgs};
use crate::cli::exit::as_input;
use crate::cli::job;
use crate::cli::references::References;
use crate::error::{Error, Result};
use crate::film::Image;
use crate::import::Loaded;
use crate::output::{FramePattern, read_image};
use crate::scene::{FrameRange, Policy, Settings, Shot};
use crate::sequence::{WorldHash, check_upload, shot_fingerprint};
use std::path::{Path, PathBuf};

impl Request {
    /// Reads all files. With `chooses` the program chooses camera samples, all pixels with as many, unless `args` say how
    /// many.
    ///
    /// Errors: `Error::Input` and `Error::Usage`.
    pub(super) fn read(
        scene: &SceneArgs,
        args: &SettingArgs,
        job: &JobArgs,
        chooses: bool,
    ) -> Result<Self> {
        let mut loaded = job::load(scene, args)?;
        if chooses && args.spp.is_none() {
            loaded.settings.most_spp = None;
        }
        let (frames, pattern) = place(scene, job, &mut loaded)?;
        let Loaded { world, shot, settings, options, mut warnings, files, .. } = loaded;
        let aovs = super::aovs(args, &options, &settings, &pattern)?;
        let settings = Settings { aovs: Some(aovs), ..settings };
        refuse_input(options.stats.as_deref(), &files)?;
        let uploads = uploads(&options.uploads, &shot, &settings)?;
        let hash = WorldHash::of(&world);
        let whole = hash.whole();
        let hashes = Hashes {
            parts: hash.named(),
            light: hash.light(),
            shot: shot_fingerprint(&whole, &shot),
            scene: whole,
        };
        let path = &scene.scene;
        let scene = world.into_scene(settings.rules.recentre)?;
        warnings.extend(job::mesh_warnings(&scene, path));
        Ok(Self {
            scene,
            shot,
            settings,
            options,
            frames,
            pattern,
            references: References::none(),
            uploads,
            warnings,
            scene_name: path.display().to_string(),
            hashes,
        })
    }
}

/// Applies the options of `job` to those of `loaded`. Returns the frames to render and the pattern of their paths: by
/// option, else by scene file, else a folder named after the scene.
///
/// Errors: `Error::Usage` for frames that the shot does not have, or an invalid pattern.
pub fn place(
    scene: &SceneArgs,
    job: &JobArgs,
    loaded: &mut Loaded,
) -> Result<(FrameRange, FramePattern)> {
    let count = loaded.shot.frames;
    job.apply(&mut loaded.options, count)?;
    if let Some(fps) = scene.fps {
        loaded.options.fps = fps;
    }
    let frames = loaded.options.frames.unwrap_or(FrameRange { first: 1, last: count });
    let default = || default_output(&scene.scene);
    let name = loaded.options.output.clone().unwrap_or_else(default);
    Ok((frames, FramePattern::parse(&name, frames.last - frames.first + 1)?))
}

/// `out/<scene name>/frame_####.png`.
fn default_output(scene: &Path) -> String {
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    // A # of the scene's own name would count as a digit of the frame number.
    format!("out/{}/frame_####.png", name.replace('#', "_"))
}

/// Reads the pictures that are uploaded for frames.
pub fn uploads(
    files: &[(u32, PathBuf)],
    shot: &Shot,
    settings: &Settings,
) -> Result<Vec<(u32, Image)>> {
    if !files.is_empty() && settings.reuse.policy != Policy::Colour {
        return Err(Error::Usage("--upload needs --policy colour".into()));
    }
    let read = |(frame, file): &(u32, PathBuf)| {
        let image = read_image(file).map_err(as_input)?;
        check_upload(*frame, &image, shot, settings)?;
        Ok((*frame, image))
    };
    files.iter().map(read).collect()
}

/// Refuses to write statistics over a file that the scene was read from.
fn refuse_input(stats: Option<&Path>, inputs: &[PathBuf]) -> Result<()> {
    let Some(stats) = stats else { return Ok(()) };
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    match real(stats).filter(|s| inputs.iter().any(|input| real(input).as_ref() == Some(s))) {
        Some(_) => Err(Error::Usage(format!(
            "--stats {} would replace a file that the scene is read from",
            stats.display()
        ))),
        None => Ok(()),
    }
}
