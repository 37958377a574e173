//! Which share of the surface points is inferred in the hall of `scenes/gallery`, painted and with one kind of material at a time.

use super::moves::Set;
use super::{Choice, per_cent, support};
use tweenray::math::Rgb;
use tweenray::scene::{Material, ShotLens, World};
use tweenray::stats::ReuseCounts;

/// In-between frames of the move that are counted, first and last.
const COUNTED: [u32; 2] = [20, 27];
const SAMPLES: u32 = 16;

const FLOOR: &[&str] = &["floor"];
const WALL: &[&str] = &["wall"];
const GLOSS: &[&str] = &["gold", "car", "plastic", "silver"];
const GLASS: &[&str] = &["clear", "frosted", "amber", "pane", "wax"];
const SHELL: &[&str] = &["shell"];
/// A wall that sunlight falls through.
const LATTICE: &str = "lattice";

/// The rows of the table: materials that stay as they are, while all others are painted, and whether the lattice stands.
const ROWS: [(&str, &[&[&str]], bool); 7] = [
    ("paint alone", &[], false),
    ("floor: gloss, colour and roughness by images", &[FLOOR], false),
    ("wall: colour and normals by images", &[WALL], false),
    ("rough metal, plastic, coat, mirror", &[GLOSS], false),
    ("glass: clear, rough, tinted, thin, in part", &[GLASS], false),
    ("all of these, vertex colours", &[FLOOR, WALL, GLOSS, GLASS, SHELL], false),
    ("paint, and the sun through a lattice of cut-outs", &[&[LATTICE]], true),
];

/// Paints all materials but those that are `kept`. What emits goes on to emit.
fn paint(world: &mut World, kept: &[&str], has_lattice: bool) {
    for name in kept {
        assert!(world.materials.iter().any(|m| m.name == *name), "no material '{name}'");
    }
    if !has_lattice {
        let World { meshes, materials, .. } = world;
        meshes.retain(|mesh| materials[mesh.material as usize].name != LATTICE);
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

/// Shares of points that are inferred, under the same lights and in the same fog.
pub fn report(choice: &Choice) {
    let size = choice.size((320, 180));
    let [first, last] = COUNTED;
    let (width, height) = size;
    println!("gallery without its lens, frames {first} to {last}, {width} x {height}");
    println!("{} camera and {SAMPLES} light samples", choice.spp);
    println!("wanted: at least 0.9 of the share of all points that is inferred of paint");
    let frames: Vec<u32> = (first..=last).collect();
    let mut plain = None;
    let mut rows = Vec::new();
    for (name, kept, has_lattice) in ROWS {
        let mut set = Set::load("gallery", |world| paint(world, &kept.concat(), has_lattice));
        set.shot.lens = ShotLens::Pinhole;
        let stage = set.stage(choice.threads);
        let settings = set.settings(size, choice.spp, SAMPLES);
        let made = stage.frames(&settings, &set.shot, &frames);
        let sum = |of: fn(&ReuseCounts) -> u64| made.iter().map(|m| of(&m.reuse)).sum::<u64>();
        let direct = [sum(|c| c.direct_inferred), sum(|c| c.direct)];
        let specular = [sum(|c| c.specular_inferred), sum(|c| c.specular)];
        let all = [direct[0] + specular[0], direct[1] + specular[1]];
        let share = all[0] as f64 / all[1] as f64;
        let of_paint = share / *plain.get_or_insert(share);
        let mut row = vec![name.into()];
        for [inferred, points] in [direct, specular, all] {
            row.extend([points.to_string(), per_cent(inferred, points)]);
        }
        row.push(format!("{of_paint:.3}"));
        rows.push(row);
    }
    let head =
        ["", "direct", "inferred", "mirrors, glass", "inferred", "all", "inferred", "of paint's"];
    support::table(&head, &rows);
}
