//! One scene of the zoo.

use super::builder::{Builder, triple};
use super::cameras::{Move, Pose, camera_table};
use super::dice::Dice;
use super::families::{FAMILIES, Family};
use super::props;
use super::subject::{Label, Subject};
use glam::DVec3;
use std::path::Path;

/// Samples of a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Camera samples a pixel; the least where `most` is given.
    pub spp: usize,
    /// The most camera samples of a pixel; `None` where all pixels take as many.
    pub most: Option<usize>,
    /// Shadow samples a light, and sky samples.
    pub light: usize,
}

impl Settings {
    /// The value of `--spp`.
    pub fn camera_samples(&self) -> String {
        self.most.map_or_else(|| self.spp.to_string(), |most| format!("{}..{most}", self.spp))
    }

    /// The same with as many camera samples in every pixel.
    pub fn uniform(self, spp: usize) -> Self {
        Self { spp, most: None, ..self }
    }

    /// `own` with these light samples.
    pub fn light_of(self, own: tweenray::scene::Settings) -> tweenray::scene::Settings {
        let light = self.light as u32;
        tweenray::scene::Settings {
            shadow_samples: light,
            least_shadow_samples: None,
            sky_samples: light,
            least_sky_samples: None,
            ..own
        }
    }
}

/// A scene with its camera move.
pub struct Specimen {
    /// The seed of its zoo and its number there: what it is a function of.
    pub index: u64,
    /// The family's name, `forest`, with a `+` where things of other kinds were added
    /// a `~` where a lens blurs, a `^` where mirrors are rough, a `*` where the sky is an environment, a `#` where paint is of
    /// other matter, and a `%` in fog.
    pub name: String,
    /// Which of [`FAMILIES`].
    pub family: usize,
    /// How the camera moves.
    pub kind: Move,
    /// Vertical, degrees.
    pub fov: f64,
    /// One for each frame.
    pub poses: Vec<Pose>,
    /// `lens` of the scene file; empty for a pinhole.
    pub(super) lens: String,
    /// What it is rendered with unless the command line says otherwise.
    pub settings: Settings,
    pub(super) builder: Builder,
}

impl Specimen {
    /// Scene `index` of the zoo of `seed`, in so many frames. Families take turns.
    pub fn new(seed: u64, index: u64, frames: usize) -> Self {
        let family = (index % FAMILIES.len() as u64) as usize;
        let Family { name, make, is_open } = FAMILIES[family];
        let mut dice = Dice::new(seed, index);
        let mut builder = Builder::default();
        let stage = make(&mut dice, &mut builder);
        let is_mixed = is_open && dice.chance(0.25);
        if is_mixed {
            for _ in 0..dice.count(1, 2) {
                let near = stage.focus.with_y(0.0).lerp(stage.eye.with_y(0.0), 0.15);
                let at = dice.on_disc(near, 0.6);
                props::any(&mut dice, &mut builder, at);
            }
        }
        let fov = dice.within(35.0, 65.0);
        let kind = Move::draw(&mut dice, &stage);
        let settings = settings(&mut dice, builder.soft_lights);
        // Drawn last, so that the number of frames changes nothing else.
        let poses = kind.poses(&mut dice, &stage, frames);
        let name = format!("{name}{}", if is_mixed { "+" } else { "" });
        Self { index, name, family, kind, fov, poses, lens: String::new(), settings, builder }
    }

    /// Writes the scene file `name` and what it needs into `folder`: a move through `poses`, of
    /// which the first is frame `first`. The frames before it lead up to it and mean nothing.
    ///
    /// # Errors
    /// Of the file system.
    pub fn write(
        &self,
        folder: &Path,
        name: &str,
        poses: &[Pose],
        first: usize,
    ) -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        for (name, bytes) in &self.builder.files {
            std::fs::write(folder.join(name), bytes)?;
        }
        let text = format!("{}\n{}", self.camera(poses, first), self.builder.text);
        std::fs::write(folder.join(name), text)
    }

    /// The camera's part of a scene file.
    fn camera(&self, poses: &[Pose], first: usize) -> String {
        let key =
            |pose: &Pose| format!("eye = {}\ntarget = {}", triple(pose.eye), triple(pose.target));
        let keys: Vec<String> = poses.iter().map(key).collect();
        let lead = Pose { eye: poses[0].eye + DVec3::Y * 0.1, ..poses[0] };
        let own = format!("fov = {:.3}\n{}", self.fov, self.lens);
        camera_table(&own, &keys, &key(&lead), first)
    }
}

impl Subject for Specimen {
    fn label(&self) -> Label {
        Label {
            index: self.index,
            family: FAMILIES[self.family].name.into(),
            name: self.name.clone(),
            kind: self.kind.name(),
            folder: format!("{:04}", self.index),
        }
    }

    fn settings(&self) -> Settings {
        self.settings
    }

    fn frames(&self) -> usize {
        self.poses.len()
    }

    fn write_frames(
        &self,
        folder: &Path,
        name: &str,
        frames: &[usize],
        first: usize,
    ) -> std::io::Result<()> {
        let poses: Vec<Pose> = frames.iter().map(|frame| self.poses[frame - 1]).collect();
        self.write(folder, name, &poses, first)
    }
}

/// Samples that a scene of so many lights can be judged with: its truth takes 16 times as many.
fn settings(dice: &mut Dice, soft_lights: usize) -> Settings {
    let choices: [usize; 6] = [1, 1, 1, 4, 4, 16];
    let spp = dice.pick(&choices);
    let affordable = if soft_lights > 12 {
        1
    } else if soft_lights > 3 {
        4
    } else {
        16
    };
    Settings { spp: spp.min(affordable), most: None, light: 16 }
}
