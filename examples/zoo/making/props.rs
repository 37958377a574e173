//! Things that stand in scenes of several families.

use super::builder::Builder;
use super::dice::Dice;
use super::obj::Obj;
use glam::{DMat3, DVec3};
use std::f64::consts::FRAC_PI_2;

/// A turn by a random angle about a random axis.
pub fn any_turn(dice: &mut Dice) -> DMat3 {
    DMat3::from_axis_angle(dice.direction(), dice.angle())
}

/// Anything, about a unit wide.
pub fn any(dice: &mut Dice, b: &mut Builder, at: DVec3) {
    let name = b.fresh_name();
    match dice.count(0, 5) {
        0 => {
            let leaf = dice.scale(0.04, 0.12);
            let height = dice.within(0.6, 1.2);
            tree(dice, b, (at, &name), height, leaf);
        }
        1 => furniture(dice, b, at, 0.8),
        2 => {
            let count = dice.count(1, 2);
            reflectors(dice, b, at, count);
        }
        3 => {
            let (size, count) = (dice.scale(0.02, 0.08), dice.count(20, 80));
            litter(dice, b, at, &Litter { reach: 0.6, size, count });
        }
        4 => spikes(dice, b, (at, &name)),
        _ => curved(dice, b, (at, &name), 0.4),
    }
}

/// Branches with small leaves turned every way.
pub fn tree(dice: &mut Dice, b: &mut Builder, (at, name): (DVec3, &str), height: f64, leaf: f64) {
    let mut wood = Obj::default();
    let mut leaves = Obj::default();
    let top = at + DVec3::Y * height;
    wood.prism([at, top], [0.04 * height, 0.01 * height], 6);
    for _ in 0..dice.count(8, 18) {
        let from = at.lerp(top, dice.within(0.12, 1.0));
        let mut way = dice.direction();
        way.y = 0.5 * way.y.abs() + 0.1;
        let to = from + way * (0.45 * height * dice.within(0.5, 1.0));
        wood.prism([from, to], [0.012 * height, 0.004 * height], 4);
        for _ in 0..dice.count(10, 40) {
            let scatter = 0.12 * height * dice.unit();
            let centre = from.lerp(to, dice.within(0.3, 1.05)) + dice.direction() * scatter;
            let (u, v) = dice.direction().any_orthonormal_pair();
            let (u, v) = (u * leaf * dice.within(0.5, 1.0), v * leaf * dice.within(0.3, 0.6));
            leaves.polygon(&[centre - u, centre - v, centre + u, centre + v]);
        }
    }
    b.paint(&format!("{name}-wood"), dice.colour(0.3, 0.2));
    b.paint(&format!("{name}-leaf"), DVec3::new(0.2, 0.45, 0.1) * dice.within(0.6, 1.4));
    b.mesh(wood, &format!("{name}-wood"), false);
    b.mesh(leaves, &format!("{name}-leaf"), false);
}

/// Blocks of all proportions, some standing on one another.
pub fn furniture(dice: &mut Dice, b: &mut Builder, at: DVec3, reach: f64) {
    let name = b.fresh_name();
    let mut blocks = Obj::default();
    for _ in 0..dice.count(2, 5) {
        let half = reach
            * DVec3::new(dice.within(0.06, 0.3), dice.within(0.05, 0.4), dice.within(0.06, 0.3));
        let turn = if dice.chance(0.5) { 0.0 } else { dice.angle() };
        let foot = dice.on_disc(at, 0.7 * reach);
        blocks.block(foot + DVec3::Y * half.y, half, turn);
        if dice.chance(0.4) {
            let upper = half * dice.within(0.3, 0.8);
            blocks.block(foot + DVec3::Y * (2.0 * half.y + upper.y), upper, dice.angle());
        }
    }
    // A table: four legs under a top.
    let (top, leg) = (dice.within(0.3, 0.6) * reach, 0.025 * reach);
    let foot = dice.on_disc(at, 0.6 * reach);
    for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let place = foot + DVec3::new(0.3 * x, 0.0, 0.2 * z) * reach + DVec3::Y * 0.5 * top;
        blocks.block(place, DVec3::new(leg, 0.5 * top, leg), 0.0);
    }
    blocks.block(foot + DVec3::Y * top, DVec3::new(0.35, 0.02, 0.25) * reach, 0.0);
    b.paint(&name, dice.colour(0.5, 0.4));
    b.mesh(blocks, &name, false);
}

/// How small things lie about.
pub struct Litter {
    pub reach: f64,
    pub size: f64,
    pub count: usize,
}

/// Coins, pebbles and balls that lie on the ground.
pub fn litter(dice: &mut Dice, b: &mut Builder, at: DVec3, how: &Litter) {
    let name = b.fresh_name();
    let mut things = Obj::default();
    let kind = dice.count(0, 3);
    for _ in 0..how.count {
        let foot = dice.on_disc(at, how.reach);
        let r = how.size * dice.within(0.5, 1.5);
        match if kind == 3 { dice.count(0, 2) } else { kind } {
            0 => {
                let thick = DVec3::Y * r * dice.within(0.08, 0.4);
                things.prism([foot, foot + thick], [r; 2], 16);
            }
            1 => {
                let flat = dice.within(0.3, 0.8);
                let turn = DMat3::from_rotation_y(dice.angle());
                let radii = DVec3::new(r, flat * r, r * dice.within(0.6, 1.0));
                things.ball(foot + DVec3::Y * flat * r, radii, 5, turn);
            }
            _ => things.ball(foot + DVec3::Y * r, DVec3::splat(r), 8, DMat3::IDENTITY),
        }
    }
    b.paint(&name, dice.colour(0.5, 0.5));
    b.mesh(things, &name, false);
}

/// Mirror and glass spheres side by side.
pub fn reflectors(dice: &mut Dice, b: &mut Builder, at: DVec3, count: usize) {
    let reach = 0.75 * (count as f64).sqrt();
    let mut placed: Vec<(DVec3, f64)> = Vec::new();
    for _ in 0..8 * count {
        let (foot, r) = (dice.on_disc(at, reach), dice.within(0.15, 0.5));
        // Glass must not touch other glass.
        if placed.len() == count || placed.iter().any(|(p, q)| p.distance(foot) < r + q + 0.05) {
            continue;
        }
        placed.push((foot, r));
        let name = b.fresh_name();
        match dice.count(0, 3) {
            0 => b.material(&name, "mirror = 0.9"),
            1 => b.material(&name, "glass = { ior = 1.5 }"),
            2 => b.material(&name, "glass = { ior = 1.33, tint = [0.8, 0.95, 0.9] }"),
            _ => b.material(&name, "diffuse = [0.3, 0.05, 0.05]\nmirror = 0.4"),
        }
        b.sphere(foot + DVec3::Y * (r + 0.001), r, &name);
    }
}

/// A bundle of thin rods.
pub fn spikes(dice: &mut Dice, b: &mut Builder, (at, name): (DVec3, &str)) {
    let mut rods = Obj::default();
    let radius = dice.scale(0.005, 0.03);
    for _ in 0..dice.count(10, 50) {
        let foot = dice.on_disc(at, 0.5);
        let lean = 0.4 * dice.direction();
        let tip = foot + DVec3::new(lean.x, dice.within(0.3, 1.2), lean.z);
        rods.prism([foot, tip], [radius, 0.5 * radius], 5);
    }
    b.paint(name, dice.colour(0.5, 0.4));
    b.mesh(rods, name, false);
}

/// One curved thing of triangles, or an exact sphere.
pub fn curved(dice: &mut Dice, b: &mut Builder, (at, name): (DVec3, &str), size: f64) {
    b.paint(name, dice.colour(0.5, 0.5));
    let mut obj = Obj::default();
    let r = size * dice.within(0.5, 1.2);
    let steps = dice.count(6, 40);
    match dice.count(0, 3) {
        0 => return b.sphere(at + DVec3::Y * r, r, name),
        1 => obj.ball(at + DVec3::Y * r, DVec3::splat(r), steps, DMat3::IDENTITY),
        2 => {
            let tube = r * dice.within(0.15, 0.45);
            let upright = dice.chance(0.5);
            let turn = if upright { DMat3::from_rotation_x(FRAC_PI_2) } else { DMat3::IDENTITY };
            let rise = if upright { r + tube } else { tube };
            let turn = DMat3::from_rotation_y(dice.angle()) * turn;
            obj.torus(at + DVec3::Y * rise, [r, tube], steps, turn);
        }
        _ => {
            let radii = DVec3::new(r, 1.4 * r, 0.7 * r);
            obj.ball(at + DVec3::Y * 1.4 * r, radii, steps, DMat3::from_rotation_y(dice.angle()));
        }
    }
    b.mesh(obj, name, dice.chance(0.6));
}
