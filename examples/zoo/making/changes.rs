//! What random scenes can be given besides: a lens, rough mirrors, an environment, other matter, fog.

use super::builder::triple;
use super::dice::Dice;
use super::hdr;
use super::specimen::Specimen;
use glam::DVec3;
use std::fmt::Write;

/// What is changed of a scene, by the zoo's seed.
pub type Change = fn(Specimen, u64) -> Specimen;

/// Side of an image of matter, texels.
const SIDE: usize = 64;

impl Specimen {
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

    /// With other matter in place of most paint: images of colours, normals, roughness and cut-outs, panes that are glass in part,
    /// and surfaces that emit; glass is rough. Where there is glass, light goes straight through it in half of the scenes.
    pub fn with_matter(mut self, seed: u64) -> Self {
        let mut dice = Dice::new(seed.rotate_left(48), self.index);
        let mut text = String::new();
        let mut lines = self.builder.text.lines().peekable();
        while let Some(line) = lines.next() {
            let is_mirror = |line: &str| line.starts_with("mirror = ");
            let is_alone = lines.peek().is_none_or(|next| !is_mirror(next));
            let paint = line.strip_prefix("diffuse = ").filter(|_| is_alone);
            let line = match (paint, line.strip_prefix("glass = {")) {
                (Some(colour), _) => matter(&mut dice, colour),
                (None, Some(keys)) if !keys.contains("priority") => {
                    let is_bare = keys.trim() == "}";
                    let comma = if is_bare { "" } else { "," };
                    format!("glass = {{ roughness = {:?}{comma}{keys}", dice.scale(0.05, 0.8))
                }
                (None, _) => line.to_owned(),
            };
            let _ = writeln!(text, "{line}");
        }
        if dice.chance(0.5) {
            text.push_str("[settings]\nglass_shadows = \"straight\"\n");
        }
        self.builder.text = text;
        let files = ["stains.ppm", "bumps.ppm", "holes.pgm"].map(String::from);
        let images = [stains(&mut dice), bumps(&mut dice), holes(&mut dice)];
        self.builder.files.extend(files.into_iter().zip(images));
        self.name.push('#');
        self
    }

    /// In fog everywhere, from hardly any to dense.
    pub fn with_fog(mut self, seed: u64) -> Self {
        let mut dice = Dice::new(seed.rotate_left(8), self.index);
        let distance = self.poses.first().map_or(1.0, |pose| pose.eye.distance(pose.target));
        let (extinction, albedo) = (dice.scale(0.01, 0.7) / distance, dice.within(0.3, 1.0));
        let anisotropy = dice.pick(&[0.0, 0.0, 0.6, -0.3]);
        let _ = write!(
            self.builder.text,
            "[fog]\nextinction = {extinction:?}\nalbedo = {albedo:?}\nanisotropy = {anisotropy:?}\n"
        );
        self.name.push('%');
        self
    }
}

/// Keys of a material of random matter, for what was painted in this colour.
fn matter(dice: &mut Dice, colour: &str) -> String {
    let roughness = dice.scale(0.05, 0.8);
    let lies = |dice: &mut Dice| format!("scale = {:.3}", dice.scale(0.5, 8.0));
    match dice.count(0, 9) {
        0..=2 => {
            let (image, strength) = (lies(dice), dice.within(0.2, 1.0));
            format!(
                "diffuse = {colour}\ntexture = {{ file = \"stains.ppm\", {image} }}\n\
                 normal_map = {{ file = \"bumps.ppm\", {image}, strength = {strength:.3} }}"
            )
        }
        3..=4 => {
            let image = lies(dice);
            let coat = ", clearcoat = 1, clearcoat_normal_map = \"bumps.ppm\"";
            let more = dice.pick(&["", coat, ", specular_texture = \"stains.ppm\""]);
            format!(
                "principled = {{ base_colour = {colour}, roughness = {{ file = \"stains.ppm\", factor = {roughness:.3}, \
                 {image} }}, metallic = {{ file = \"stains.ppm\", {image} }}{more} }}"
            )
        }
        5..=6 => {
            let (share, roughness) = (dice.within(0.2, 1.0), dice.pick(&[0.0, roughness]));
            format!(
                "principled = {{ base_colour = {colour}, roughness = {roughness:.3}, transmission = {share:.3}, thin = true }}"
            )
        }
        7 => format!("diffuse = {colour}\nemission = {:.3}", dice.scale(0.02, 0.5)),
        8 => {
            format!("diffuse = {colour}\nalpha = {{ file = \"holes.pgm\", {} }}", lies(dice))
        }
        _ => format!("diffuse = {colour}"),
    }
}

/// A PPM (`P6`) or PGM (`P5`) image.
fn netpbm(kind: &str, texels: impl Iterator<Item = u8>) -> Vec<u8> {
    let mut bytes = format!("{kind}\n{SIDE} {SIDE}\n255\n").into_bytes();
    bytes.extend(texels);
    bytes
}

/// Colours that change from texel to texel, in patches of eight.
fn stains(dice: &mut Dice) -> Vec<u8> {
    let patches: Vec<f64> = (0..SIDE).map(|_| dice.within(0.2, 1.0)).collect();
    let texels = (0..SIDE * SIDE).flat_map(|at| {
        let patch = patches[at % SIDE / 8 + at / SIDE / 8 * 8];
        [(); 3].map(|()| (255.0 * patch * dice.within(0.7, 1.0)) as u8)
    });
    netpbm("P6", texels.collect::<Vec<u8>>().into_iter())
}

/// Normals of waves across both axes.
fn bumps(dice: &mut Dice) -> Vec<u8> {
    let waves = [(); 2].map(|()| (dice.count(1, 8) as f64, dice.angle()));
    let texels = (0..SIDE * SIDE).flat_map(|at| {
        let place = [at % SIDE, at / SIDE].map(|x| x as f64 / SIDE as f64);
        let slope = |axis: usize| {
            let (count, phase) = waves[axis];
            (std::f64::consts::TAU * count * place[axis] + phase).sin()
        };
        let n = DVec3::new(slope(0), slope(1), 1.0).normalize();
        n.to_array().map(|c| (127.5 * (c + 1.0)) as u8)
    });
    netpbm("P6", texels)
}

/// Round holes of random sizes.
fn holes(dice: &mut Dice) -> Vec<u8> {
    let discs: Vec<[f64; 3]> = (0..12)
        .map(|_| [dice.within(0.0, 64.0), dice.within(0.0, 64.0), dice.within(2.0, 10.0)])
        .collect();
    let texels = (0..SIDE * SIDE).map(|at| {
        let (x, y) = ((at % SIDE) as f64, (at / SIDE) as f64);
        let is_hole = discs.iter().any(|[a, b, r]| (x - a).hypot(y - b) < *r);
        if is_hole { 0 } else { 255 }
    });
    netpbm("P5", texels)
}
