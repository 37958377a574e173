//! How many lookups matter leaves: the hall of `scenes/gallery` painted, and with one kind of matter after the other.

use super::moves::Set;
use super::{Choice, per_cent, support};
use tweenray::math::Rgb;
use tweenray::scene::{Material, World};
use tweenray::stats::ReuseCounts;

/// In-between frames of the move that are counted.
const COUNTED: std::ops::RangeInclusive<u32> = 20..=27;
const SAMPLES: u32 = 16;

/// What the rows of the table leave as it is; all else is painted.
const KINDS: [(&str, &[&str]); 7] = [
    ("paint alone", &[]),
    ("floor: gloss, colour and roughness by images", &["floor"]),
    ("wall: colour and normals by images", &["wall"]),
    ("rough metal, plastic, coat, mirror", &["gold", "car", "plastic", "silver"]),
    ("glass, clear, rough, tinted, thin, in part", &["clear", "frosted", "amber", "pane", "wax"]),
    (
        "all of these and vertex colours",
        &[
            "floor", "wall", "gold", "car", "plastic", "silver", "clear", "frosted", "amber",
            "pane", "wax", "shell",
        ],
    ),
    ("lattice: cut-outs, through which the sun shines", &["lattice"]),
];

/// Paints all materials but those that are `kept`. What emits goes on to emit.
fn paint(world: &mut World, kept: &[&str]) {
    for name in kept {
        assert!(world.materials.iter().any(|m| m.name == *name), "no material '{name}'");
    }
    for material in world.materials.iter_mut().filter(|m| !kept.contains(&m.name.as_str())) {
        let painted = Material {
            emission: material.emission,
            emission_map: material.emission_map,
            emits_back: material.emits_back,
            ..Material::diffuse(material.name.clone(), Rgb::splat(0.5))
        };
        *material = painted;
    }
}

/// Shares of lookups that are kept, with the same lights and the same fog.
pub fn report(choice: &Choice) {
    let size = choice.size((320, 180));
    println!("gallery, frames {COUNTED:?} of 48, {} x {}", size.0, size.1);
    println!("{} camera and {SAMPLES} light samples; points in pixels seen directly", choice.spp);
    println!("wanted: at least 0.9 of the inferred points that paint has");
    let frames: Vec<u32> = COUNTED.collect();
    let mut plain = None;
    let mut rows = Vec::new();
    for (name, kept) in KINDS {
        let set = Set::load("gallery", |world| paint(world, kept));
        let stage = set.stage(choice.threads);
        let settings = set.settings(size, choice.spp, SAMPLES);
        let made = stage.frames(&settings, &set.shot, &frames);
        let sum = |of: fn(&ReuseCounts) -> u64| made.iter().map(|m| of(&m.reuse)).sum::<u64>();
        let (direct, inferred) = (sum(|c| c.direct), sum(|c| c.direct_inferred));
        let share = inferred as f64 / direct as f64;
        let of_plain = share / *plain.get_or_insert(share);
        rows.push(vec![
            name.into(),
            direct.to_string(),
            per_cent(inferred, direct),
            format!("{of_plain:.3}"),
            per_cent(sum(|c| c.specular_inferred), sum(|c| c.specular)),
        ]);
    }
    let head = ["", "direct points", "inferred", "of paint's", "other points inferred"];
    support::table(&head, &rows);
}
