//! Things under lamps of all kinds and numbers.

use super::super::builder::Builder;
use super::super::cameras::{Pose, Stage};
use super::super::dice::Dice;
use super::super::lamps::{self, Aim};
use super::super::obj::Obj;
use super::super::props;
use glam::DVec3;

/// A long hall with columns and many small lamps under its ceiling.
pub fn hall(dice: &mut Dice, b: &mut Builder) -> Stage {
    let (w, h, d) = (dice.within(2.0, 3.5), dice.within(2.6, 3.6), 10.0);
    b.paint("floor", dice.colour(0.55, 0.15));
    b.paint("wall", dice.colour(0.65, 0.15));
    b.floor(DVec3::ZERO, [2.0 * w, 2.0 * d], "floor");
    b.floor(DVec3::Y * h, [2.0 * w, 2.0 * d], "wall");
    for x in [-w, w] {
        b.wall(DVec3::new(x, 0.0, -d), [DVec3::Z * 2.0 * d, DVec3::Y * h], "wall");
    }
    b.wall(DVec3::new(-w, 0.0, -d), [DVec3::X * 2.0 * w, DVec3::Y * h], "wall");
    let rows = dice.count(4, 10);
    let quads = dice.chance(0.4);
    let size = dice.scale(0.03, 0.2);
    // Together about as bright over the floor whatever their number.
    let power = dice.within(14.0, 26.0) * 2.0 / rows as f64;
    for i in 0..rows {
        for x in [-0.6 * w, 0.6 * w] {
            let z = -d + 0.6 + (2.0 * d - 2.0) * (i as f64 + 0.5) / rows as f64;
            let at = DVec3::new(x, h * dice.within(0.75, 0.92), z);
            let intensity = lamps::warm(dice) * power * dice.within(0.7, 1.3);
            if quads {
                let area = 4.0 * size * size;
                b.quad_light([at, at - DVec3::Y], [2.0 * size; 2], intensity / area);
            } else {
                let area = std::f64::consts::PI * size * size;
                b.sphere_light(at, size, intensity / area);
            }
        }
    }
    let mut columns = Obj::default();
    for i in 0..dice.count(3, 8) {
        for x in [-0.75 * w, 0.75 * w] {
            let foot = DVec3::new(x, 0.0, 6.5 - 2.2 * i as f64);
            let radius = dice.within(0.1, 0.2);
            columns.prism([foot, foot + DVec3::Y * h], [radius; 2], 12);
        }
    }
    b.mesh(columns, "wall", dice.chance(0.5));
    for z in [0.0, 3.0, -3.0] {
        props::furniture(dice, b, DVec3::new(0.0, 0.0, z), 0.8);
    }
    let eye = DVec3::new(dice.within(-0.5, 0.5), dice.within(1.2, 1.9), 8.5);
    let far = Pose { eye: DVec3::new(0.2, 1.9, 0.0), target: DVec3::new(0.0, 0.5, -6.0) };
    Stage { eye, focus: DVec3::new(0.0, 0.8, 3.0), room: 1.0, far: Some(far) }
}

/// Things under one lamp that is next to a point: tracing has hardly any noise there.
pub fn tiny(dice: &mut Dice, b: &mut Builder) -> Stage {
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [25.0, 75.0]),
        distance: dice.within(2.5, 5.0),
        irradiance: dice.within(2.0, 4.0),
    };
    let radius = dice.scale(0.002, 0.03);
    lamps::sphere(b, dice, &aim, radius);
    b.ambient(0.08);
    still_life(dice, b)
}

/// Things under one light as wide as they are: all shadow is half shadow.
pub fn wide(dice: &mut Dice, b: &mut Builder) -> Stage {
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [35.0, 90.0]),
        distance: dice.within(2.5, 5.0),
        irradiance: dice.within(2.0, 3.5),
    };
    let size = dice.within(1.5, 5.0);
    let other = size * dice.within(0.5, 1.5);
    lamps::quad(b, dice, &aim, [size, other]);
    b.ambient(0.05);
    still_life(dice, b)
}

/// Point and directional lights beside quads and spheres.
pub fn mixed(dice: &mut Dice, b: &mut Builder) -> Stage {
    let to_light = lamps::above(dice, [20.0, 70.0]);
    let [x, y, z] = to_light.to_array();
    let level = dice.within(0.5, 1.5);
    b.hard_light(&format!(
        "directional = {{ to_light = [{x:.4}, {y:.4}, {z:.4}], irradiance = {level:.3} }}"
    ));
    for _ in 0..dice.count(1, 3) {
        let height = dice.within(1.2, 3.0);
        let at = dice.on_disc(DVec3::Y * height, 2.5);
        let [x, y, z] = at.to_array();
        let intensity = dice.within(1.0, 4.0);
        b.hard_light(&format!(
            "point = {{ position = [{x:.4}, {y:.4}, {z:.4}], intensity = {intensity:.3} }}"
        ));
    }
    for _ in 0..dice.count(1, 3) {
        let aim = Aim {
            at: DVec3::ZERO,
            towards: lamps::above(dice, [25.0, 80.0]),
            distance: dice.within(2.5, 4.0),
            irradiance: dice.within(0.6, 1.4),
        };
        let size = dice.scale(0.05, 1.0);
        if dice.chance(0.5) {
            lamps::quad(b, dice, &aim, [size; 2]);
        } else {
            lamps::sphere(b, dice, &aim, 0.5 * size);
        }
    }
    if dice.chance(0.5) {
        lamps::sky(b, dice, 0.6);
    }
    still_life(dice, b)
}

/// Things under nothing but sky.
pub fn sky_alone(dice: &mut Dice, b: &mut Builder) -> Stage {
    let level = dice.within(2.0, 3.2);
    lamps::sky(b, dice, level);
    still_life(dice, b)
}

/// A floor with things of some kinds on it.
fn still_life(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.5, 0.2));
    b.floor(DVec3::ZERO, [12.0, 12.0], "ground");
    for _ in 0..dice.count(2, 4) {
        let at = dice.on_disc(DVec3::ZERO, 1.2);
        props::any(dice, b, at);
    }
    let eye = DVec3::new(dice.within(-1.5, 1.5), dice.within(0.8, 2.0), dice.within(2.4, 3.8));
    let far = Pose { eye: DVec3::new(0.4, 1.6, 1.8), target: DVec3::new(0.0, 0.2, -0.8) };
    Stage { eye, focus: DVec3::new(0.0, 0.3, 0.0), room: 1.5, far: Some(far) }
}
