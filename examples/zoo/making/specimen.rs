//! One scene of the zoo.

use super::builder::{Builder, triple};
use super::cameras::{Move, Pose};
use super::dice::Dice;
use super::families::{FAMILIES, Family};
use super::hdr;
use super::props;
use glam::DVec3;
use std::fmt::Write;
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
}

/// A scene with its camera move.
pub struct Specimen {
    /// The seed of its zoo and its number there: what it is a function of.
    pub index: u64,
    /// The family's name, `forest`, with a `+` where things of other kinds were added
    /// a `~` where a lens blurs, a `^` where mirrors are rough, and a `*` where the sky is an environment.
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
    lens: String,
    /// What it is rendered with unless the command line says otherwise.
    pub settings: Settings,
    builder: Builder,
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

    /// With a random thin lens: from hardly any blur to a strong one, focused on the target, before or behind it.
    pub fn with_lens(mut self, seed: u64) -> Self {
        let mut dice = Dice::new(!seed, self.index);
        let distance = self.poses.first().map_or(1.0, |pose| pose.eye.distance(pose.target));
        let radius = distance * dice.scale(0.002, 0.04);
        let focus = match dice.chance(0.5) {
            true => "\"target\"".to_string(),
            false => format!("{:?}", distance * dice.scale(0.4, 2.0)),
        };
        let blades = dice.pick(&["", ", blades = 5", ", blades = 8"]);
        self.lens = format!("lens = {{ radius = {radius:?}, focus = {focus}{blades} }}\n");
        self.name.push('~');
        self
    }

    /// With rough mirrors for perfect ones, and about half of what is painted of plastic, some of it under a clear coat or
    /// partly metal.
    pub fn with_gloss(mut self, seed: u64) -> Self {
        let mut dice = Dice::new(seed.rotate_left(32), self.index);
        let mut text = String::new();
        let mut lines = self.builder.text.lines().peekable();
        while let Some(line) = lines.next() {
            let is_mirror = |line: &str| line.starts_with("mirror = ");
            let has_none = lines.peek().is_none_or(|next| !is_mirror(next));
            let paint = line.strip_prefix("diffuse = ").filter(|_| has_none && dice.chance(0.5));
            if let Some(colour) = paint {
                let roughness = dice.scale(0.05, 0.8);
                let more = dice.pick(&["", ", clearcoat = 1", ", metallic = 0.5"]);
                let _ = writeln!(
                    text,
                    "principled = {{ base_colour = {colour}, roughness = {roughness:?}{more} }}"
                );
                continue;
            }
            let _ = writeln!(text, "{line}");
            if is_mirror(line) {
                let _ = writeln!(text, "roughness = {:?}", dice.scale(0.05, 0.8));
            }
        }
        self.builder.text = text;
        self.name.push('^');
        self
    }

    /// With a random environment in place of the sky.
    pub fn with_sky(mut self, seed: u64) -> Self {
        let mut dice = Dice::new(seed.rotate_left(16), self.index);
        let mut colour =
            |most: f64| DVec3::from_array([(); 3].map(|()| dice.scale(0.1, 1.0))) * most;
        let colours = [colour(1.5), colour(1.0), colour(0.4), colour(20.0)];
        let to_sun =
            DVec3::new(dice.within(-1.0, 1.0), dice.within(0.1, 1.0), dice.within(-1.0, 1.0));
        let (turbidity, turn) = (dice.within(2.0, 8.0), dice.within(0.0, 360.0));
        let (strength, width) = (dice.scale(0.1, 0.4), dice.scale(0.005, 0.6));
        let keys = match dice.count(0, 2) {
            0 => {
                let [zenith, horizon, ground, _] = colours.map(triple);
                format!(
                    "gradient = {{ zenith = {zenith}, horizon = {horizon}, ground = {ground} }}"
                )
            }
            1 => {
                let sun = triple(to_sun);
                format!(
                    "sun_sky = {{ to_sun = {sun}, turbidity = {turbidity:.3} }}\nstrength = {strength:.4}\n\
                     rotate = {turn:.2}"
                )
            }
            _ => {
                let image = hdr::sky(colours, to_sun.normalize(), width);
                self.builder.files.push(("sky.hdr".into(), image));
                format!("image = \"sky.hdr\"\nrotate = {turn:.2}")
            }
        };
        // The old sky's table ends where the next one begins.
        let mut text = String::new();
        let mut is_sky = false;
        for line in self.builder.text.lines() {
            is_sky = if line.starts_with('[') { line == "[sky]" } else { is_sky };
            if !is_sky {
                let _ = writeln!(text, "{line}");
            }
        }
        self.builder.text = format!("{text}[sky]\n{keys}\n");
        self.name.push('*');
        self
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
        let frames = first + poses.len() - 1;
        let mut text = format!("[camera]\nfov = {:.3}\nframes = {frames}\n{}", self.fov, self.lens);
        let at = |frame: usize| (frame - 1) as f64 / (frames - 1) as f64;
        let mut key = |at: f64, pose: &Pose| {
            let (eye, target) = (triple(pose.eye), triple(pose.target));
            let _ = writeln!(text, "[[camera.keys]]\nat = {at:?}\neye = {eye}\ntarget = {target}");
        };
        if first > 1 {
            // Not the first pose itself: frames of one camera are one frame.
            key(0.0, &Pose { eye: poses[0].eye + DVec3::Y * 0.1, target: poses[0].target });
        }
        for (i, pose) in poses.iter().enumerate() {
            key(at(first + i), pose);
        }
        text
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
