//! Things whose shadows are the picture: gratings, coins, blinds, fences.

use super::super::builder::Builder;
use super::super::cameras::{Pose, Stage};
use super::super::dice::Dice;
use super::super::lamps::{self, Aim};
use super::super::obj::Obj;
use super::super::props;
use glam::DVec3;

/// A fine grid above the floor, out of sight: stripes as fine as the pixels that see them.
pub fn grating(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.6, 0.15));
    b.floor(DVec3::ZERO, [20.0, 20.0], "ground");
    b.paint("bar", dice.colour(0.25, 0.2));
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [40.0, 85.0]),
        distance: 25.0,
        irradiance: dice.within(2.5, 5.0),
    };
    let width = dice.scale(0.3, 3.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.2, 0.8);
    lamps::sky(b, dice, level);
    let height = dice.within(1.6, 3.0);
    let pitch = dice.scale(0.03, 0.3);
    let half = dice.within(2.0, 4.0);
    let bar = pitch * dice.within(0.1, 0.25);
    let mut bars = Obj::default();
    let crossed = dice.chance(0.5);
    let count = (2.0 * half / pitch) as i32;
    for i in 0..count {
        let at = -half + pitch * f64::from(i);
        bars.block(DVec3::new(at, height, 0.0), DVec3::new(bar, bar, half), 0.0);
        if crossed {
            bars.block(DVec3::new(0.0, height, at), DVec3::new(half, bar, bar), 0.0);
        }
    }
    b.mesh(bars, "bar", false);
    let eye = DVec3::new(dice.within(-1.5, 1.5), dice.within(0.5, 1.4), dice.within(2.5, 4.0));
    let far = Pose { eye: DVec3::new(1.0, 0.8, 0.5), target: DVec3::new(0.0, 0.0, -2.0) };
    Stage { eye, focus: DVec3::ZERO, room: 2.0, far: Some(far) }
}

/// Small things at rest on a floor, under a small lamp: shadows that start at nothing.
pub fn contact(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.55, 0.2));
    b.floor(DVec3::ZERO, [8.0, 8.0], "ground");
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [20.0, 70.0]),
        distance: dice.within(1.5, 3.0),
        irradiance: dice.within(2.0, 4.0),
    };
    let size = dice.scale(0.04, 0.4);
    let other = size * dice.within(0.6, 1.6);
    lamps::quad(b, dice, &aim, [size, other]);
    let level = dice.within(0.2, 1.0);
    lamps::sky(b, dice, level);
    let size = dice.scale(0.02, 0.1);
    let count = dice.count(40, 250);
    props::litter(dice, b, DVec3::ZERO, &props::Litter { reach: 1.3, size, count });
    let eye = DVec3::new(dice.within(-1.2, 1.2), dice.within(0.35, 1.0), dice.within(1.2, 2.0));
    let far = Pose { eye: DVec3::new(0.3, 0.4, 0.7), target: DVec3::new(0.0, 0.0, -0.8) };
    Stage { eye, focus: DVec3::ZERO, room: 0.8, far: Some(far) }
}

/// A room whose light falls through the slats of a blind.
pub fn blinds(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.55, 0.2));
    b.floor(DVec3::ZERO, [8.0, 8.0], "ground");
    b.paint("wall", dice.colour(0.65, 0.1));
    b.wall(DVec3::new(-4.0, 0.0, -3.0), [DVec3::X * 8.0, DVec3::Y * 3.5], "wall");
    b.wall(DVec3::new(4.0, 0.0, -3.0), [DVec3::Z * 7.0, DVec3::Y * 3.5], "wall");
    let aim = Aim {
        at: DVec3::ZERO,
        towards: DVec3::new(-1.0, dice.within(0.4, 0.9), dice.within(-0.3, 0.6)),
        distance: 20.0,
        irradiance: dice.within(3.0, 5.0),
    };
    let width = dice.scale(0.5, 6.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.3, 1.0);
    lamps::sky(b, dice, level);
    b.paint("slat", dice.colour(0.6, 0.2));
    let mut slats = Obj::default();
    let pitch = dice.scale(0.05, 0.2);
    let half = DVec3::new(0.004, 0.5 * pitch * dice.within(0.6, 1.1), 2.5);
    let tilt = glam::DMat3::from_rotation_z(dice.within(-1.2, 1.2));
    for i in 1..(3.5 / pitch) as i32 {
        slats.turned_block(DVec3::new(-2.5, pitch * f64::from(i), 0.0), half, tilt);
    }
    b.mesh(slats, "slat", false);
    if dice.chance(0.6) {
        props::furniture(dice, b, DVec3::new(0.5, 0.0, -0.5), 1.5);
    }
    let eye = DVec3::new(dice.within(-1.0, 1.0), dice.within(1.0, 2.0), dice.within(3.0, 4.0));
    let far = Pose { eye: DVec3::new(0.0, 1.3, 1.5), target: DVec3::new(1.0, 0.5, -2.0) };
    Stage { eye, focus: DVec3::new(0.6, 0.6, -1.0), room: 1.2, far: Some(far) }
}

/// A picket fence, and its shadow on the ground before it.
pub fn fence(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.5, 0.2));
    b.floor(DVec3::ZERO, [30.0, 30.0], "ground");
    let behind = DVec3::new(dice.within(-0.8, 0.8), dice.within(0.3, 1.0), -1.0);
    let aim =
        Aim { at: DVec3::ZERO, towards: behind, distance: 40.0, irradiance: dice.within(2.5, 4.5) };
    let width = dice.scale(0.4, 6.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.3, 1.2);
    lamps::sky(b, dice, level);
    b.paint("picket", dice.colour(0.7, 0.1));
    let rows = dice.count(1, 3);
    let (pitch, height) = (dice.scale(0.06, 0.25), dice.within(0.7, 1.4));
    let mut pickets = Obj::default();
    for row in 0..rows {
        let z = -1.2 * row as f64;
        for i in 0..(8.0 / pitch) as i32 {
            let x = -4.0 + pitch * f64::from(i);
            let half = DVec3::new(pitch * 0.3, 0.5 * height * dice.within(0.92, 1.0), 0.015);
            pickets.block(DVec3::new(x, half.y, z), half, 0.0);
        }
        for y in [0.25, 0.75] {
            let centre = DVec3::new(0.0, y * height, z - 0.04);
            pickets.block(centre, DVec3::new(4.0, 0.04, 0.02), 0.0);
        }
    }
    b.mesh(pickets, "picket", false);
    let eye = DVec3::new(dice.within(-1.5, 1.5), dice.within(0.8, 2.0), dice.within(3.0, 5.0));
    let far = Pose { eye: DVec3::new(0.0, 1.8, 1.2), target: DVec3::new(0.0, 0.2, -2.5) };
    Stage { eye, focus: DVec3::new(0.0, 0.3, 0.3), room: 2.0, far: Some(far) }
}
