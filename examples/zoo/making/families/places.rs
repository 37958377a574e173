//! Cities and rooms.

use super::super::builder::Builder;
use super::super::cameras::{Pose, Stage};
use super::super::dice::Dice;
use super::super::lamps::{self, Aim};
use super::super::obj::Obj;
use super::super::props;
use glam::DVec3;

/// Blocks along streets, seen in flight.
pub fn city(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.35, 0.1));
    b.floor(DVec3::ZERO, [60.0, 60.0], "ground");
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [20.0, 60.0]),
        distance: 100.0,
        irradiance: dice.within(2.0, 4.0),
    };
    let width = dice.scale(0.5, 5.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.4, 1.4);
    lamps::sky(b, dice, level);
    let tallest = dice.within(1.0, 3.5);
    let mut blocks = [Obj::default(), Obj::default()];
    for (i, k) in (-8..=8).flat_map(|i| (-10..=6).map(move |k| (i, k))) {
        // The middle street is the flight's.
        if i == 0 || dice.chance(0.1) {
            continue;
        }
        let half = DVec3::new(
            dice.within(0.25, 0.42),
            0.5 * dice.scale(0.3, tallest),
            dice.within(0.25, 0.42),
        );
        let centre = DVec3::new(f64::from(i), half.y, f64::from(k));
        let obj = &mut blocks[usize::from(dice.chance(0.5))];
        obj.block(centre, half, 0.0);
        for _ in 0..dice.count(0, 3) {
            let small = DVec3::new(0.06, 0.05, 0.06) * dice.within(0.5, 1.5);
            let on =
                centre + half * DVec3::new(dice.within(-0.7, 0.7), 1.0, dice.within(-0.7, 0.7));
            obj.block(on + DVec3::Y * small.y, small, 0.0);
        }
    }
    for (name, obj) in ["stone", "brick"].into_iter().zip(blocks) {
        b.paint(name, dice.colour(0.5, 0.3));
        b.mesh(obj, name, false);
    }
    let height = dice.within(0.4, tallest + 1.5);
    let eye = DVec3::new(0.0, height, 7.0);
    let focus = DVec3::new(0.0, 0.4 * height, dice.within(2.0, 4.0));
    let far = Pose { eye: DVec3::new(0.0, height, -2.0), target: DVec3::new(0.0, 0.3, -8.0) };
    Stage { eye, focus, room: 0.8, far: Some(far) }
}

/// A room whose floor, walls and boxes are textured.
pub fn textured(dice: &mut Dice, b: &mut Builder) -> Stage {
    let (w, h) = (dice.within(2.0, 3.0), dice.within(2.4, 3.0));
    for name in ["tiles", "paper", "crate"] {
        let colours = [dice.colour(0.35, 0.5), dice.colour(0.7, 0.25)];
        let squares = 2 * dice.count(1, 4);
        b.checkers(name, squares, colours);
    }
    let mut floor = Obj::default();
    let fine = dice.within(0.3, 2.0);
    floor.textured_quad(
        DVec3::new(-w, 0.0, 4.0),
        [DVec3::X * 2.0 * w, DVec3::Z * -6.0],
        [2.0 * w * fine, 6.0 * fine],
    );
    b.mesh(floor, "tiles", false);
    let mut walls = Obj::default();
    let fine = dice.within(0.2, 1.5);
    for (corner, along) in [
        (DVec3::new(-w, 0.0, -2.0), DVec3::X * 2.0 * w),
        (DVec3::new(-w, 0.0, 4.0), DVec3::Z * -6.0),
        (DVec3::new(w, 0.0, -2.0), DVec3::Z * 6.0),
    ] {
        walls.textured_quad(corner, [along, DVec3::Y * h], [along.length() * fine, h * fine]);
    }
    b.mesh(walls, "paper", false);
    let mut crates = Obj::default();
    for _ in 0..dice.count(2, 7) {
        let size = dice.within(0.15, 0.5);
        let at = dice.on_disc(DVec3::ZERO, 1.4);
        let half = DVec3::new(size, 0.0, size);
        crates.textured_block(at - half, at + half + DVec3::Y * 2.0 * size, 1.0);
    }
    b.mesh(crates, "crate", false);
    for _ in 0..dice.count(1, 3) {
        let aim = Aim {
            at: DVec3::ZERO,
            towards: DVec3::new(dice.within(-0.6, 0.6), 1.0, dice.within(-0.2, 0.8)),
            distance: h * 0.85,
            irradiance: dice.within(1.2, 2.2),
        };
        let size = dice.scale(0.08, 0.9);
        lamps::quad(b, dice, &aim, [size; 2]);
    }
    b.ambient(0.06);
    inside(dice, 3.6)
}

/// A room with a window: the sun and the sky come in through it, and a ceiling lamp helps.
pub fn window_room(dice: &mut Dice, b: &mut Builder) -> Stage {
    let (w, h) = (2.4, 2.6);
    b.paint("floor", dice.colour(0.5, 0.2));
    b.paint("wall", dice.colour(0.7, 0.1));
    b.floor(DVec3::new(0.0, 0.0, 1.0), [2.0 * w, 6.0], "floor");
    b.floor(DVec3::new(0.0, h, 1.0), [2.0 * w, 6.0], "wall");
    b.wall(DVec3::new(-w, 0.0, -2.0), [DVec3::X * 2.0 * w, DVec3::Y * h], "wall");
    b.wall(DVec3::new(w, 0.0, -2.0), [DVec3::Z * 6.0, DVec3::Y * h], "wall");
    // The wall with the window: two panels beside it, two above and below.
    let (from, to) = (dice.within(-1.5, -0.5), dice.within(0.5, 2.0));
    let (low, high) = (dice.within(0.2, 1.0), dice.within(1.6, 2.4));
    let panel = |b: &mut Builder, [z0, z1]: [f64; 2], [y0, y1]: [f64; 2]| {
        let corner = DVec3::new(-w, y0, z0);
        b.wall(corner, [DVec3::Z * (z1 - z0), DVec3::Y * (y1 - y0)], "wall");
    };
    panel(b, [-2.0, from], [0.0, h]);
    panel(b, [to, 4.0], [0.0, h]);
    panel(b, [from, to], [0.0, low]);
    panel(b, [from, to], [high, h]);
    let mut bars = Obj::default();
    for i in 0..=dice.count(1, 5) {
        let z = from + (to - from) * i as f64 / 5.0;
        let half = DVec3::new(0.03, 0.5 * (high - low), 0.02);
        bars.block(DVec3::new(-w, 0.5 * (low + high), z), half, 0.0);
    }
    b.mesh(bars, "wall", false);
    let aim = Aim {
        at: DVec3::ZERO,
        towards: DVec3::new(-1.0, dice.within(0.3, 0.9), dice.within(-0.4, 0.4)),
        distance: 30.0,
        irradiance: dice.within(3.0, 6.0),
    };
    let width = dice.scale(0.5, 5.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(4.0, 9.0);
    lamps::sky(b, dice, level);
    if dice.chance(0.6) {
        let at = DVec3::new(dice.within(-1.0, 1.0), h - 0.05, dice.within(-0.5, 1.5));
        let size = dice.scale(0.1, 0.6);
        let radiance = DVec3::splat(dice.within(3.0, 6.0) / (size * size));
        b.quad_light([at, at - DVec3::Y], [size; 2], radiance);
    }
    props::furniture(dice, b, DVec3::new(0.3, 0.0, -0.5), 1.5);
    props::furniture(dice, b, DVec3::new(-0.5, 0.0, 0.8), 0.7);
    inside(dice, 3.7)
}

/// A closed box with a lamp in its ceiling and things in it.
pub fn cornell(dice: &mut Dice, b: &mut Builder) -> Stage {
    let (w, h) = (1.5, 2.5);
    let grey = dice.within(0.55, 0.75);
    b.paint("white", DVec3::splat(grey));
    b.paint("left", DVec3::new(0.6, 0.08, 0.06));
    b.paint("right", DVec3::new(0.12, 0.45, 0.15));
    b.floor(DVec3::new(0.0, 0.0, 0.75), [2.0 * w, 4.5], "white");
    b.floor(DVec3::new(0.0, h, 0.75), [2.0 * w, 4.5], "white");
    b.wall(DVec3::new(-w, 0.0, -1.5), [DVec3::X * 2.0 * w, DVec3::Y * h], "white");
    b.wall(DVec3::new(-w, 0.0, -1.5), [DVec3::Z * 4.5, DVec3::Y * h], "left");
    b.wall(DVec3::new(w, 0.0, -1.5), [DVec3::Z * 4.5, DVec3::Y * h], "right");
    let size = dice.scale(0.1, 1.2);
    let at = DVec3::new(dice.within(-0.5, 0.5), h - 0.01, dice.within(-0.5, 0.5));
    let radiance = lamps::warm(dice) * dice.within(7.0, 12.0) / (size * size);
    b.quad_light([at, at - DVec3::Y], [size; 2], radiance);
    b.ambient(0.06);
    for i in 0..dice.count(2, 3) {
        let place = DVec3::new(0.9 * (i as f64 - 0.8), 0.0, dice.within(-0.8, 0.4));
        let half = DVec3::new(0.3, 0.5 * dice.within(0.4, 1.4), 0.3) * dice.within(0.7, 1.2);
        let mut block = Obj::default();
        block.block(place + DVec3::Y * half.y, half, dice.angle());
        if dice.chance(0.25) {
            b.material(&format!("polished{i}"), "diffuse = 0.1\nmirror = 0.75");
        } else {
            b.paint(&format!("polished{i}"), dice.colour(0.5, 0.4));
        }
        b.mesh(block, &format!("polished{i}"), false);
    }
    if dice.chance(0.5) {
        let at = DVec3::new(dice.within(-0.8, 0.8), 0.0, dice.within(0.4, 1.0));
        props::reflectors(dice, b, at, 1);
    }
    inside(dice, 2.8)
}

/// A camera inside a room, near its open end.
fn inside(dice: &mut Dice, z: f64) -> Stage {
    let eye = DVec3::new(dice.within(-0.4, 0.4), dice.within(1.0, 1.7), z);
    Stage { eye, focus: DVec3::new(dice.within(-0.3, 0.3), 0.8, 0.0), room: 0.8, far: None }
}
