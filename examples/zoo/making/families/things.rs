//! Curved things, mirrors and glass.

use super::super::builder::Builder;
use super::super::cameras::{Pose, Stage};
use super::super::dice::Dice;
use super::super::lamps::{self, Aim};
use super::super::obj::Obj;
use super::super::props;
use glam::DVec3;

/// Mirrors and glass over a checkered floor.
pub fn mirrors(dice: &mut Dice, b: &mut Builder) -> Stage {
    checkered_floor(dice, b);
    lamp_and_sky(dice, b);
    let count = dice.count(2, 6);
    props::reflectors(dice, b, DVec3::ZERO, count);
    props::furniture(dice, b, DVec3::new(0.3, 0.0, -0.8), 1.2);
    if dice.chance(0.5) {
        b.material("wall-mirror", "mirror = 0.85");
        let corner = DVec3::new(-3.0, 0.0, -2.5);
        b.wall(corner, [DVec3::X * 6.0, DVec3::Y * 2.4], "wall-mirror");
    }
    stage(dice)
}

/// Spheres, tori and balls of triangles, coarse and fine, smooth and faceted.
pub fn curved(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.5, 0.2));
    b.floor(DVec3::ZERO, [12.0, 12.0], "ground");
    lamp_and_sky(dice, b);
    for i in 0..dice.count(3, 7) {
        let at = dice.on_disc(DVec3::ZERO, 1.6);
        props::curved(dice, b, (at, &format!("curved{i}")), 0.5);
    }
    stage(dice)
}

fn checkered_floor(dice: &mut Dice, b: &mut Builder) {
    let colours = [dice.colour(0.3, 0.4), dice.colour(0.75, 0.2)];
    b.checkers("checkers", 4, colours);
    let mut floor = Obj::default();
    let repeats = dice.within(2.0, 6.0);
    floor.textured_quad(
        DVec3::new(-5.0, 0.0, 5.0),
        [DVec3::X * 10.0, DVec3::Z * -10.0],
        [repeats; 2],
    );
    b.mesh(floor, "checkers", false);
}

fn lamp_and_sky(dice: &mut Dice, b: &mut Builder) {
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [30.0, 80.0]),
        distance: dice.within(3.5, 6.0),
        irradiance: dice.within(2.0, 3.5),
    };
    let size = dice.scale(0.1, 2.0);
    if dice.chance(0.5) {
        lamps::quad(b, dice, &aim, [size; 2]);
    } else {
        lamps::sphere(b, dice, &aim, 0.5 * size);
    }
    let level = dice.within(0.3, 1.0);
    lamps::sky(b, dice, level);
}

fn stage(dice: &mut Dice) -> Stage {
    let eye = DVec3::new(dice.within(-1.5, 1.5), dice.within(0.9, 2.0), dice.within(3.2, 4.5));
    let far = Pose { eye: DVec3::new(0.4, 1.6, 2.0), target: DVec3::new(0.0, 0.2, -0.8) };
    Stage { eye, focus: DVec3::new(0.0, 0.4, 0.0), room: 1.5, far: Some(far) }
}
