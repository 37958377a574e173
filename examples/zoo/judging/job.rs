//! The program, run.

use super::Failure;
use super::frame::Picture;
use crate::making::{Settings, Subject};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;
use tweenray::output::Display;

/// The program to judge.
pub struct Program {
    path: PathBuf,
}

/// One call of it.
pub struct Render {
    name: String,
    scene: String,
    policy: &'static str,
    /// First and last; all where there is none.
    frames: Option<[usize; 2]>,
    /// On shadow, sky and fog samples.
    factor: usize,
    /// As many camera samples in every pixel, instead of those of the settings.
    camera: Option<usize>,
    /// The seed, where it is not the program's own: of camera samples too.
    seed: Option<usize>,
    /// Of the frames' names.
    ending: &'static str,
}

impl Render {
    /// All frames of the move.
    pub fn of_move(name: &str, policy: &'static str) -> Self {
        Self {
            name: name.into(),
            scene: "move.toml".into(),
            policy,
            frames: None,
            factor: 1,
            camera: None,
            seed: None,
            ending: "exr",
        }
    }

    /// The same with as many camera samples in every pixel.
    pub fn with_camera_samples(self, spp: usize) -> Self {
        Self { camera: Some(spp), ..self }
    }

    /// The same with other random numbers, those of camera samples too.
    pub fn with_seed(self, seed: usize) -> Self {
        Self { seed: Some(seed), ..self }
    }

    /// The same to png files.
    pub fn into_png(self) -> Self {
        Self { ending: "png", ..self }
    }

    /// Traced frames of the scene file of this name: the first one's number, and how many.
    pub fn of_others(name: &str, [first, count]: [usize; 2], factor: usize) -> Self {
        let frames = Some([first, first + count - 1]);
        Self {
            name: name.into(),
            scene: format!("{name}.toml"),
            policy: "off",
            frames,
            factor,
            camera: None,
            seed: None,
            ending: "exr",
        }
    }
}

/// What a job took and left.
pub struct Spent {
    /// Seconds from start to end.
    pub wall: f64,
    /// Seconds of all threads, the system's included.
    pub cpu: f64,
    /// What `--stats` wrote.
    pub stats: Value,
    frames: PathBuf,
    display: Display,
}

impl Spent {
    /// A frame as displayed.
    pub fn frame(&self, number: usize) -> Result<Picture, Failure> {
        Picture::read(&self.frames.join(format!("frame_{number:04}.exr")), &self.display)
    }

    /// Seconds of reading the scene and building the tree, which every job of it takes.
    pub fn before_frames(&self) -> f64 {
        let of = |name: &str| self.stats[name].as_f64().unwrap_or(0.0);
        of("load_seconds") + of("build_seconds")
    }

    /// Rays of frame `number`, those of its probes too.
    pub fn rays(&self, number: usize) -> f64 {
        let frames = self.stats["frames"].as_array();
        let own = frames.and_then(|all| all.iter().find(|f| f["frame"] == number));
        let sum = |rays: &Value| -> f64 {
            let kinds = rays.as_object().into_iter().flatten();
            kinds.filter_map(|(_, n)| n.as_f64()).sum()
        };
        own.map_or(0.0, |f| sum(&f["rays"]) + sum(&f["audit"]["sums"]["rays"]))
    }

    pub fn remove_frames(&self) -> Result<(), Failure> {
        Ok(std::fs::remove_dir_all(&self.frames)?)
    }
}

impl Program {
    /// The program at `path`.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into() }
    }

    /// Runs it on a scene file of `subject` in `folder`.
    pub fn render(
        &self,
        folder: &Path,
        render: &Render,
        subject: &dyn Subject,
        settings: Settings,
        size: [u32; 2],
    ) -> Result<Spent, Failure> {
        let frames = folder.join(&render.name);
        let own = subject.program_settings(settings);
        let more = |most: u32| (most as usize * render.factor).to_string();
        // More than the most are no range.
        let light = |range: String, most| if render.factor == 1 { range } else { more(most) };
        let camera = render.camera.map_or(settings, |spp| settings.uniform(spp)).camera_samples();
        let stats = folder.join(format!("{}.json", render.name));
        let mut command = Command::new(&self.path);
        command
            .arg("render")
            .arg(folder.join(&render.scene))
            .args(["--size", &format!("{}x{}", size[0], size[1])])
            .args(["--spp", &camera])
            .args(["--shadow-samples", &light(own.shadow_sample_range(), own.shadow_samples)])
            .args(["--sky-samples", &light(own.sky_sample_range(), own.sky_samples)])
            .args(["--fog-samples", &more(own.fog_samples)])
            .args(["--policy", render.policy, "--no-video", "--overwrite", "-q", "--stats"])
            .arg(&stats)
            .arg("-o")
            .arg(frames.join(format!("frame_####.{}", render.ending)));
        if let Some(seed) = render.seed {
            command.args(["--seed", &seed.to_string()]);
        }
        if let Some([first, last]) = render.frames {
            command.args(["--frames", &format!("{first}..{last}")]);
        }
        let (before, start) = (children_seconds(), Instant::now());
        let out = command.stdin(Stdio::null()).output()?;
        let (wall, cpu) = (start.elapsed().as_secs_f64(), children_seconds() - before);
        if !out.status.success() {
            let said = String::from_utf8_lossy(&out.stderr);
            return Err(format!("{command:?} ended with {}: {said}", out.status).into());
        }
        let stats = serde_json::from_slice(&std::fs::read(stats)?)?;
        let display = Display { exposure: own.exposure, tone: own.tone };
        Ok(Spent { wall, cpu, stats, frames, display })
    }
}

/// CPU seconds of all ended children, to a hundredth; 0 where the system does not tell.
fn children_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name, in brackets, may hold blanks. Linux counts in hundredths.
    let after = text.rsplit(')').next().unwrap_or_default();
    let fields: Vec<f64> = after.split_whitespace().map(|w| w.parse().unwrap_or(0.0)).collect();
    fields.get(13..15).map_or(0.0, |f| (f[0] + f[1]) / 100.0)
}
