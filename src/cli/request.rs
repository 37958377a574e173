//! The request to `render`: scene, shot, settings, frames and where they go.

mod read;

use super::args::{JobArgs, SceneArgs, SettingArgs};
use super::machine;
use super::references::{self, References};
use crate::cluster::Communicator;
use crate::error::{Diagnostic, Error, Result};
use crate::film::Image;
use crate::output::manifest::{self, Header, Manifest};
use crate::output::maps::{Map, MapScales};
use crate::output::{Format, FramePattern, VERSION, WriteOptions};
use crate::reuse::store::Compatibility;
use crate::scene::{
    Aov, Aovs, FrameRange, IntersectorKind, JobOptions, Policy, Scene, Settings, Shot,
};
use crate::sequence::{Recipes, Target};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

pub use read::{place, uploads};

/// Everything that rendering needs. One rank of each node reads it from files and sends it to the others.
#[derive(Serialize, Deserialize)]
pub struct Request {
    /// The scene, ready to trace.
    pub scene: Scene,
    /// The camera move.
    pub shot: Shot,
    /// How to render, before anything is chosen.
    pub settings: Settings,
    /// How the job runs.
    pub options: JobOptions,
    /// The frames to render.
    pub frames: FrameRange,
    /// Pattern of the frames' paths.
    pub pattern: FramePattern,
    /// Frames of an earlier job; each rank checks a part of them.
    #[serde(skip, default = "References::none")]
    pub references: References,
    /// Uploaded pictures, by frame.
    pub uploads: Vec<(u32, Image)>,
    /// Warnings of import and of rounding, which rank 0 prints.
    #[serde(skip)]
    pub warnings: Vec<Diagnostic>,
    scene_name: String,
    hashes: Hashes,
}

/// Hashes of everything read that frames depend on.
#[derive(Serialize, Deserialize)]
struct Hashes {
    scene: String,
    /// Hash of each part of the scene, by name.
    parts: BTreeMap<String, String>,
    /// Hash of everything that light depends on.
    light: String,
    /// Hash of the scene and the camera move.
    shot: String,
}

/// Settings to render under, and what follows from them.
pub struct Setup {
    /// The settings.
    pub settings: Settings,
    /// The compatibility that references must have.
    pub terms: Compatibility,
    /// The recipe of each frame of the shot.
    pub recipes: Recipes,
}

impl Request {
    /// Reads the scene and applies the options to it; `chooses` as for [`read`](Self::read). All ranks call it.
    pub fn load(
        comm: &Communicator,
        scene: &SceneArgs,
        (settings, chooses): (&SettingArgs, bool),
        job: &JobArgs,
    ) -> Result<Self> {
        // Before the work of reading a scene.
        comm.agree(machine::best_isa())?;
        let read = comm.from_node(|| Self::read(scene, settings, job, chooses));
        let mut request = comm.agree(read)?;
        let terms = comm.agree(request.setup(request.settings.clone()))?.terms;
        let on = (&request.scene, &request.settings, &terms);
        let folders = &request.options.references;
        request.references = References::survey(comm, folders, &request.pattern, on)?;
        Ok(request)
    }

    /// Description of everything about the intersector that frames depend on: `intersector`, its own
    /// description, and the instruction set.
    ///
    /// Errors: those of [`machine::best_isa`].
    pub fn tracer(&self, intersector: &str) -> Result<String> {
        Ok(match (self.settings.intersector, &self.settings.isa) {
            (IntersectorKind::Oracle, _) => intersector.into(),
            (IntersectorKind::Embree, Some(isa)) => format!("{intersector}, {isa}"),
            (IntersectorKind::Embree, None) => format!("{intersector}, {}", machine::best_isa()?),
        })
    }

    /// Whether the job asks for something that frames which are all traced cannot have.
    pub fn needs_reuse(&self) -> bool {
        self.options.maps || self.settings.aovs.as_ref().is_some_and(Aovs::need_reuse)
    }

    /// The setup for rendering under `settings`.
    ///
    /// Errors: those of [`Recipes::new`].
    pub fn setup(&self, settings: Settings) -> Result<Setup> {
        let terms = references::terms(&self.hashes.light, &self.scene, &settings);
        let with_motion = settings.holds(Aov::Motion);
        let recipes = Recipes::new(&self.shot, &settings, !terms.lights.is_empty(), with_motion)?;
        Ok(Setup { settings, terms, recipes })
    }

    /// The settings of `setup` as the header has them, with references and uploads by hashes of their content, not
    /// by their names.
    fn header_settings(&self, setup: &Setup) -> Value {
        let mut settings = Header::settings(&setup.settings);
        let show = |(frame, image): &(u32, Image)| {
            let hash = blake3::hash(bytemuck::cast_slice(&image.rgb)).to_hex();
            format!("{frame}={}", &hash[..16])
        };
        settings["reuse"]["references"] = self.references.hash.clone().into();
        if !self.uploads.is_empty() {
            let all: Vec<String> = self.uploads.iter().map(show).collect();
            settings["reuse"]["upload"] = all.join(" ").into();
        }
        settings
    }

    /// The header of existing frames that are to be kept, if they are of this scene, version and `tracer`.
    pub fn header_before(&self, tracer: &str) -> Option<Header> {
        let header = Manifest::read(&manifest::manifest_path(&self.pattern)).ok()??.header;
        let is_same = header.scene_hash == self.hashes.scene
            && header.tweenray == VERSION
            && header.tracer == tracer;
        (is_same && !self.options.overwrite).then_some(header)
    }

    /// The target of frames traced by `tracer` under `setup`.
    pub fn target(&self, setup: &Setup, tracer: &str) -> Target {
        let Hashes { scene, parts, shot, .. } = &self.hashes;
        let header = Header {
            manifest: manifest::FORMAT,
            tweenray: VERSION.into(),
            scene: self.scene_name.clone(),
            scene_hash: scene.clone(),
            scene_parts: parts.clone(),
            shot_hash: shot.clone(),
            shot_frames: self.shot.frames,
            files: manifest::file_name(&self.pattern),
            tracer: tracer.into(),
            command: super::words(),
            chosen: None,
            settings: self.header_settings(setup),
        };
        Target {
            pattern: self.pattern.clone(),
            header,
            recipes: setup.recipes.clone(),
            write: WriteOptions {
                maps: self.options.maps.then(|| MapScales::of(&setup.settings)),
                ..WriteOptions::of(&setup.settings, None)
            },
            overwrite: self.options.overwrite,
        }
    }
}

/// What the exr frames of a job hold beside colour: what is asked for, else the references if the job builds on those
/// of an earlier one, and with `--maps` the maps. None if the frames of `pattern` are not exr.
///
/// Errors: `Error::Usage` if frames of the policy or format cannot have what is asked for.
pub fn aovs(
    args: &SettingArgs,
    options: &JobOptions,
    settings: &Settings,
    pattern: &FramePattern,
) -> Result<Aovs> {
    let policy = settings.reuse.policy;
    let scales = MapScales::of(settings);
    if options.maps && scales.maps().next().is_none() {
        return Err(Error::Usage(
            "--maps shows what is inferred, and how many camera samples pixels have; with --policy off every \
             frame is traced, and without --spp MIN..MAX all pixels have as many"
                .into(),
        ));
    }
    if pattern.format() != Format::Exr {
        return match args.aovs.iter().find(|list| **list != Aovs::default()) {
            Some(list) => Err(Error::Usage(format!(
                "--aovs {list}: only exr frames hold more than colour\n  \
                 help: choose another output with -o, for example -o 'out/frame_####.exr'"
            ))),
            // The scene file may ask for them, and the command line for png frames this once.
            None => Ok(Aovs::default()),
        };
    }
    // References of a policy that has none are refused as such.
    let builds_on = !options.references.is_empty() && policy == Policy::Surface;
    let needed = || builds_on.then_some(Aov::Reference).into_iter().collect();
    let asked = settings.aovs.clone().unwrap_or_else(needed);
    let maps = options.maps.then(|| scales.maps().map(Map::aov).collect());
    let all: Aovs = std::iter::once(asked).chain(maps).collect();
    all.under(policy, settings.most_spp.is_some()).map_err(|aov| {
        let needed = match aov {
            Aov::Samples => "--spp MIN..MAX",
            Aov::Reference => "--policy surface",
            _ => "--policy surface or colour",
        };
        Error::Usage(format!(
            "the frames can have no {}: that needs {needed}\n  \
             help: leave it out of --aovs (`aovs` in the scene file)",
            aov.name()
        ))
    })
}
