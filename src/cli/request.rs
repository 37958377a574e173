//! What `render` was asked to do, resolved: scene, shot, settings, frames and where they go.

use super::args::{OutputArgs, SceneArgs, SettingArgs};
use super::exit::as_input;
use super::references::{self, References};
use super::{job, machine, values};
use crate::cluster::{self, Communicator};
use crate::error::{Diagnostic, Error, Result};
use crate::film::Image;
use crate::import::Loaded;
use crate::output::manifest::{self, Header, Manifest};
use crate::output::{Format, FramePattern, WriteOptions, read_image};
use crate::reuse::store::Compatibility;
use crate::scene::{FrameRange, IntersectorKind, Policy, Scene, Settings, Shot};
use crate::sequence::{Recipes, Target, WorldHash, check_upload, shot_fingerprint};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How much time of tracing a killed job may lose: docs/resume.md has the measurement.
const CHECKPOINT: Duration = Duration::from_secs(30);

/// Everything that rendering takes.
pub struct Request {
    /// The scene, ready to trace.
    pub scene: Scene,
    /// The camera move.
    pub shot: Shot,
    /// How to render.
    pub settings: Settings,
    /// Which frames.
    pub frames: FrameRange,
    /// Where they go.
    pub pattern: FramePattern,
    /// Whether frames that exist are replaced.
    pub overwrite: bool,
    /// Whether an invalid sample makes the job fail.
    pub strict: bool,
    /// Frames per second of the video; `None` for no video.
    pub fps: Option<f64>,
    /// Rendering threads, where somebody said how many.
    pub threads: Option<usize>,
    /// Where the statistics go, if anywhere.
    pub stats: Option<PathBuf>,
    /// How much time of tracing a killed job may lose; `None` for any.
    pub checkpoint: Option<Duration>,
    /// How many discoveries a message between ranks carries at most.
    pub exchange: u64,
    /// Whether frames get maps of reuse.
    pub maps: bool,
    /// On which terms frames serve as references.
    pub terms: Compatibility,
    /// What each frame of the shot is made of.
    pub recipes: Recipes,
    /// Frames of an earlier job.
    pub references: References,
    /// Pictures that are taken for frames.
    pub uploads: Vec<(u32, Image)>,
    /// What import warns of, and what rounding lost.
    pub warnings: Vec<Diagnostic>,
    /// How long the program may run, where the scene file says.
    pub time_limit: Option<Duration>,
    scene_name: String,
    scene_hash: String,
    scene_parts: BTreeMap<String, String>,
    light_hash: String,
    shot_hash: String,
}

/// What files say, and what comes of it. One rank of each node reads them; the others are told.
#[derive(Serialize, Deserialize)]
struct Read {
    scene: Scene,
    shot: Shot,
    settings: Settings,
    frames: FrameRange,
    pattern: FramePattern,
    overwrite: bool,
    strict: bool,
    video: bool,
    fps: f64,
    threads: Option<u32>,
    stats: Option<PathBuf>,
    time_limit: Option<Duration>,
    checkpoint: Option<Option<Duration>>,
    exchange: Option<u32>,
    uploads: Vec<(u32, Image)>,
    scene_hash: String,
    scene_parts: BTreeMap<String, String>,
    light_hash: String,
    shot_hash: String,
    /// (Only rank 0 tells of them, which reads by itself.)
    #[serde(skip)]
    warnings: Vec<Diagnostic>,
}

impl Read {
    fn by(scene: &SceneArgs, settings: &SettingArgs, output: &OutputArgs) -> Result<Self> {
        let loaded = job::load(scene, settings)?;
        let frames = frames(output, &loaded)?;
        let pattern = pattern(scene, output, &loaded, frames)?;
        refuse_input(output.stats.as_deref().or(loaded.stats.as_deref()), &loaded.files)?;
        let Loaded { world, shot, settings, mut warnings, .. } = loaded;
        let uploads = uploads(&output.upload, &shot, &settings)?;
        let hash = WorldHash::of(&world);
        let (scene_hash, light_hash) = (hash.whole(), hash.light());
        let scene_parts = hash.named();
        let shot_hash = shot_fingerprint(&scene_hash, &shot);
        let path = &scene.scene;
        let scene = world.into_scene(settings.rules.recentre)?;
        warnings.extend(job::collapsed(&scene, path));
        Ok(Self {
            scene,
            shot,
            settings,
            frames,
            pattern,
            overwrite: loaded.overwrite,
            strict: loaded.strict,
            video: loaded.video,
            fps: loaded.fps,
            threads: loaded.threads,
            stats: loaded.stats,
            time_limit: loaded.time_limit,
            checkpoint: loaded.checkpoint.map(|interval| interval.0),
            exchange: loaded.exchange,
            uploads,
            scene_hash,
            scene_parts,
            light_hash,
            shot_hash,
            warnings,
        })
    }
}

impl Request {
    /// Reads the scene and puts the options over it. All ranks call it.
    pub fn load(
        comm: &Communicator,
        scene: &SceneArgs,
        settings: &SettingArgs,
        output: &OutputArgs,
    ) -> Result<Self> {
        // Before the work of reading a scene.
        comm.agree(machine::best_isa())?;
        let read = comm.from_node(|| Read::by(scene, settings, output));
        let read = comm.agree(read)?;
        let derived = comm.agree(Derived::of(&read, output))?;
        let Derived { terms, recipes } = derived;
        let on = (&read.scene, &read.settings, &terms);
        let references = References::survey(comm, &output.references, &read.pattern, on)?;
        let checkpoint = output.checkpoint.map(|interval| interval.0).or(read.checkpoint);
        Ok(Self {
            scene: read.scene,
            shot: read.shot,
            settings: read.settings,
            frames: read.frames,
            pattern: read.pattern,
            overwrite: output.overwrite || read.overwrite,
            strict: output.strict || read.strict,
            fps: (output.video || (read.video && !output.no_video))
                .then(|| output.fps.unwrap_or(read.fps)),
            threads: output.threads.or(read.threads).map(|n| n as usize),
            stats: output.stats.clone().or(read.stats),
            time_limit: read.time_limit,
            checkpoint: checkpoint.unwrap_or(Some(CHECKPOINT)),
            exchange: output.exchange.or(read.exchange).map_or(cluster::EXCHANGE, u64::from),
            maps: output.maps,
            references,
            terms,
            uploads: read.uploads,
            warnings: read.warnings,
            scene_name: scene.scene.display().to_string(),
            scene_hash: read.scene_hash,
            scene_parts: read.scene_parts,
            light_hash: read.light_hash,
            shot_hash: read.shot_hash,
            recipes,
        })
    }

    /// What traces, as far as frames differ by it: `intersector` by its own description, and the
    /// instruction set.
    ///
    /// Errors: [`machine::best_isa`]'s.
    pub fn tracer(&self, intersector: &str) -> Result<String> {
        Ok(match (self.settings.intersector, &self.settings.isa) {
            (IntersectorKind::Oracle, _) => intersector.into(),
            (IntersectorKind::Embree, Some(isa)) => format!("{intersector}, {isa}"),
            (IntersectorKind::Embree, None) => format!("{intersector}, {}", machine::best_isa()?),
        })
    }

    /// The settings with what decides frames beside them: pictures count by what they show, not by
    /// their names.
    fn header_settings(&self) -> Value {
        let mut settings = Header::settings(&self.settings);
        let show = |(frame, image): &(u32, Image)| {
            let hash = blake3::hash(bytemuck::cast_slice(&image.rgb)).to_hex();
            format!("{frame}={}", &hash[..16])
        };
        if self.pattern.format() == Format::Exr {
            settings["reuse"]["maps"] = self.maps.into();
        }
        settings["reuse"]["references"] = self.references.hash.clone().into();
        if !self.uploads.is_empty() {
            let all: Vec<String> = self.uploads.iter().map(show).collect();
            settings["reuse"]["upload"] = all.join(" ").into();
        }
        settings
    }

    /// What depends on the settings: on which terms frames serve as references, and their recipes.
    ///
    /// Errors: those of [`Recipes::new`].
    pub fn terms_and_recipes(&self, settings: &Settings) -> Result<(Compatibility, Recipes)> {
        let Self { scene, shot, pattern, light_hash, .. } = self;
        let Derived { terms, recipes } =
            Derived::new((scene, shot), settings, pattern, light_hash)?;
        Ok((terms, recipes))
    }

    /// The header of the frames that are there, where they are of this scene, version and `tracer`
    /// and are to be kept.
    pub fn header_before(&self, tracer: &str) -> Option<Header> {
        let header = Manifest::read(&manifest::manifest_path(&self.pattern)).ok()??.header;
        let is_same = header.scene_hash == self.scene_hash
            && header.tweenray == crate::output::VERSION
            && header.tracer == tracer;
        (is_same && !self.overwrite).then_some(header)
    }

    /// Where frames traced by `tracer` go, and what they share.
    pub fn target(&self, tracer: String) -> Target {
        let header = Header {
            manifest: manifest::FORMAT,
            tweenray: crate::output::VERSION.into(),
            scene: self.scene_name.clone(),
            scene_hash: self.scene_hash.clone(),
            scene_parts: self.scene_parts.clone(),
            shot_hash: self.shot_hash.clone(),
            shot_frames: self.shot.frames,
            files: manifest::file_name(&self.pattern),
            tracer,
            command: super::words(),
            chosen: None,
            settings: self.header_settings(),
        };
        Target {
            pattern: self.pattern.clone(),
            header,
            recipes: self.recipes.clone(),
            write: WriteOptions {
                maps: self.maps.then(|| self.settings.reuse.farthest()),
                ..WriteOptions::of(&self.settings, None)
            },
            overwrite: self.overwrite,
        }
    }
}

/// What follows from what was read; each rank sees to it for itself.
struct Derived {
    terms: Compatibility,
    recipes: Recipes,
}

impl Derived {
    fn of(read: &Read, output: &OutputArgs) -> Result<Self> {
        let Read { scene, shot, settings, pattern, light_hash, .. } = read;
        refuse_maps(output.maps, settings)?;
        Self::new((scene, shot), settings, pattern, light_hash)
    }

    fn new(
        (scene, shot): (&Scene, &Shot),
        settings: &Settings,
        pattern: &FramePattern,
        light_hash: &str,
    ) -> Result<Self> {
        let terms = references::terms(light_hash, scene, settings);
        let with_motion = pattern.format() == Format::Exr;
        let recipes = Recipes::new(shot, settings, !terms.lights.is_empty(), with_motion)?;
        Ok(Self { terms, recipes })
    }
}

/// Refuses maps of what no frame has.
pub fn refuse_maps(maps: bool, settings: &Settings) -> Result<()> {
    match settings.reuse.policy {
        Policy::Off if maps => Err(Error::Usage(
            "--maps shows what is inferred; with --policy off every frame is traced".into(),
        )),
        _ => Ok(()),
    }
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

/// Where `frames` go: by option, else by scene file, else a folder named after the scene.
pub fn pattern(
    scene: &SceneArgs,
    output: &OutputArgs,
    loaded: &Loaded,
    frames: FrameRange,
) -> Result<FramePattern> {
    let name = output.output.clone().or_else(|| loaded.output.as_ref().map(|o| o.pattern.clone()));
    let name = name.unwrap_or_else(|| default_output(&scene.scene));
    FramePattern::parse(&name, frames.last - frames.first + 1)
}

/// The frames asked for: by option, else by scene file, else all.
pub fn frames(output: &OutputArgs, loaded: &Loaded) -> Result<FrameRange> {
    let count = loaded.shot.frames;
    let all = FrameRange { first: 1, last: count };
    let range = match output.frames {
        Some(request) => request.of_shot(count),
        None => {
            let range = loaded.frames.unwrap_or(all);
            values::in_shot(range, count).map(|()| range)
        }
    };
    range.map_err(Error::Usage)
}

/// `out/<scene name>/frame_####.png`.
fn default_output(scene: &Path) -> String {
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    // A # of the scene's own name would count as a digit of the frame number.
    format!("out/{}/frame_####.png", name.replace('#', "_"))
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
