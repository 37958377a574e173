//! Scene files of the user, judged as random scenes are.
//!
//! Of a file the zoo takes all but its camera: files are named absolutely there, since what is derived lies elsewhere. The
//! camera is asked for each frame of the move, and becomes a key pose.

mod content;
mod views;

use crate::judging::Failure;
use crate::making::{Label, Settings, Subject};
use crate::options::Options;
use std::path::Path;
use tweenray::import::{self, LoadOptions, Loaded};
use views::Views;

/// A scene file, its move cut into frames.
pub struct Given {
    label: Label,
    settings: Settings,
    program_settings: tweenray::scene::Settings,
    views: Views,
    /// The scene file without its camera.
    content: String,
}

impl Given {
    /// The scenes of the command line.
    ///
    /// # Errors
    /// Where one cannot be read, or has a camera that stands still.
    pub fn all(options: &Options) -> Result<Vec<Self>, Failure> {
        let mut all: Vec<Self> = Vec::new();
        for path in &options.scenes {
            all.push(Self::read(path, fresh_name(path, &all), all.len() as u64, options)?);
        }
        Ok(all)
    }

    fn read(path: &Path, name: String, index: u64, options: &Options) -> Result<Self, Failure> {
        let fault = |what: Failure| Failure::from(format!("{}: {what}", path.display()));
        if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
            return Err(fault("this is no scene file: its name does not end in .toml".into()));
        }
        let [width, height] = options.plan().size;
        let how = LoadOptions { size: Some((width, height)), ..LoadOptions::default() };
        let Loaded { mut shot, settings: own, files, .. } = import::load(path, &how)?;
        shot.frames = options.frames as u32;
        let views = Views::new(&shot, [width, height]).map_err(fault)?;
        let table = content::read(path, &files)?;
        let says_spp = table.get("settings").is_some_and(|settings| settings.get("spp").is_some());
        let settings = options.settings.unwrap_or(Settings {
            spp: own.spp as usize,
            most: own.most_spp.filter(|_| says_spp).map(|most| most as usize),
            light: own.shadow_samples as usize,
        });
        Ok(Self {
            label: Label {
                index,
                family: name.clone(),
                name: name.clone(),
                kind: content::kind(&table),
                folder: name,
            },
            settings,
            program_settings: match options.settings {
                Some(settings) => settings.light_of(own),
                None => own,
            },
            views,
            content: content::without_camera(table)?,
        })
    }
}

/// The file's stem, with a number where another scene has that.
fn fresh_name(path: &Path, others: &[Given]) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let is_fresh = |name: &String| others.iter().all(|other| other.label.name != *name);
    let numbered = (2..).map(|n| format!("{stem}-{n}"));
    std::iter::once(stem.clone()).chain(numbered).find(is_fresh).unwrap_or_default()
}

impl Subject for Given {
    fn label(&self) -> Label {
        self.label.clone()
    }

    fn settings(&self) -> Settings {
        self.settings
    }

    fn frames(&self) -> usize {
        self.views.count()
    }

    fn write_frames(
        &self,
        folder: &Path,
        name: &str,
        frames: &[usize],
        first: usize,
    ) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let text = format!("{}\n{}", self.content, self.views.camera(frames, first));
        std::fs::write(folder.join(name), text)
    }

    fn program_settings(&self, _: Settings) -> tweenray::scene::Settings {
        self.program_settings.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use tweenray::scene::Camera;

    #[test]
    fn a_scene_file_keeps_its_views_and_finds_its_files_under_other_frame_numbers() {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/gallery/scene.toml");
        let options = Options::parse_from(["zoo", "--frames", "5", "--scene", file]);
        let given = &Given::all(&options).expect("a scene")[0];
        let folder = tempfile::tempdir().expect("a folder");
        given.write_frames(folder.path(), "others.toml", &[2, 4], 1000).expect("written");
        let load = |path: &Path| {
            let how = LoadOptions { size: Some((160, 96)), ..LoadOptions::default() };
            import::load(path, &how).expect("a scene")
        };
        let (mut own, derived) = (load(Path::new(file)), load(&folder.path().join("others.toml")));
        own.shot.frames = 5;
        assert!(own.files.iter().filter(|path| !path.ends_with("scene.toml")).count() > 0);
        assert_eq!(own.files.len(), derived.files.len());
        let view = |shot: &tweenray::scene::Shot, frame| {
            let Camera { eye, half_right, half_up, .. } = shot.camera(frame, 160, 96).expect("one");
            [eye, half_right, half_up]
        };
        for (number, frame) in [(1000, 2), (1001, 4)] {
            let pairs = view(&derived.shot, number).into_iter().zip(view(&own.shot, frame));
            assert!(pairs.into_iter().all(|(a, b)| a.abs_diff_eq(b, 1e-9)), "frame {frame}");
        }
    }
}
