//! Forests, trees, ground.

use super::super::builder::Builder;
use super::super::cameras::{Pose, Stage};
use super::super::dice::Dice;
use super::super::lamps::{self, Aim};
use super::super::obj::Obj;
use super::super::props;
use glam::DVec3;

/// Thin poles under a small sun: shadows as thin as pixels, over and over.
pub fn forest(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.45, 0.25));
    b.floor(DVec3::ZERO, [40.0, 40.0], "ground");
    b.paint("bark", dice.colour(0.3, 0.3));
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [25.0, 65.0]),
        distance: 60.0,
        irradiance: dice.within(2.0, 4.0),
    };
    let width = dice.scale(0.3, 4.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.3, 1.2);
    lamps::sky(b, dice, level);
    let mut poles = Obj::default();
    let thick = dice.scale(0.015, 0.12);
    for _ in 0..dice.count(60, 400) {
        let foot = DVec3::new(dice.within(-7.0, 7.0), 0.0, dice.within(-12.0, 7.0));
        // The camera's path stays free.
        if foot.x.abs() < 0.6 {
            continue;
        }
        let lean = 0.3 * dice.direction();
        let top = foot + DVec3::new(lean.x, dice.within(1.0, 4.0), lean.z);
        let radius = thick * dice.within(0.6, 1.4);
        poles.prism([foot, top], [radius, radius * dice.within(0.3, 1.0)], dice.count(3, 8));
    }
    b.mesh(poles, "bark", false);
    let height = dice.within(0.7, 2.0);
    let eye = DVec3::new(0.0, height, 8.0);
    let focus = DVec3::new(dice.within(-0.6, 0.6), dice.within(0.3, 0.8), 1.0);
    let far = Pose { eye: DVec3::new(0.0, height, -3.0), target: DVec3::new(0.0, 0.5, -9.0) };
    Stage { eye, focus, room: 1.5, far: Some(far) }
}

/// Trees and bushes of small leaves.
pub fn foliage(dice: &mut Dice, b: &mut Builder) -> Stage {
    b.paint("ground", dice.colour(0.4, 0.2));
    b.floor(DVec3::ZERO, [30.0, 30.0], "ground");
    let aim = Aim {
        at: DVec3::ZERO,
        towards: lamps::above(dice, [30.0, 75.0]),
        distance: 50.0,
        irradiance: dice.within(2.0, 4.5),
    };
    let width = dice.scale(0.5, 6.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.3, 1.5);
    lamps::sky(b, dice, level);
    let leaf = dice.scale(0.03, 0.12);
    for i in 0..dice.count(3, 8) {
        let place = dice.on_disc(DVec3::ZERO, 1.6);
        let height = dice.scale(0.4, 2.4);
        props::tree(dice, b, (place, &format!("tree{i}")), height, leaf);
    }
    let eye = DVec3::new(dice.within(-1.5, 1.5), dice.within(0.8, 2.6), dice.within(3.0, 4.5));
    let focus = DVec3::new(0.0, dice.within(0.2, 0.7), 0.0);
    let far = Pose { eye: DVec3::new(0.3, 1.8, 2.2), target: DVec3::new(0.0, 0.2, -0.5) };
    Stage { eye, focus, room: 1.5, far: Some(far) }
}

/// Bumpy ground under a sun that grazes it: long shadows, most of the ground at their rims.
pub fn low_sun(dice: &mut Dice, b: &mut Builder) -> Stage {
    hills(dice, b, [2.0, 12.0])
}

/// Hills, some with rocks on them.
pub fn terrain(dice: &mut Dice, b: &mut Builder) -> Stage {
    hills(dice, b, [20.0, 80.0])
}

/// Ground of one of two makes, under a sun at this elevation.
fn hills(dice: &mut Dice, b: &mut Builder, elevation: [f64; 2]) -> Stage {
    b.paint("sand", dice.colour(0.5, 0.2));
    let steps = dice.count(40, 200);
    if dice.chance(0.4) {
        let keys = format!("terrain = {{ vertices = {steps}, size = 16.0 }}");
        b.shape(&keys, "sand");
    } else {
        let waves = Waves::new(dice);
        let mut ground = Obj::default();
        ground.ground(8.0, steps, |x, z| waves.height(x, z));
        b.mesh(ground, "sand", dice.chance(0.5));
        if dice.chance(0.7) {
            waves.strew_rocks(dice, b);
        }
    }
    let towards = lamps::above(dice, elevation);
    // A slope that faces a grazing sun must not burn out, level ground not vanish.
    let irradiance = dice.within(1.5, 2.5) / towards.y.max(0.35);
    let aim = Aim { at: DVec3::ZERO, towards, distance: 60.0, irradiance };
    let width = dice.scale(0.5, 8.0);
    lamps::sun(b, dice, &aim, width);
    let level = dice.within(0.2, 1.0);
    lamps::sky(b, dice, level);
    let eye = DVec3::new(dice.within(-1.0, 1.0), dice.within(1.8, 3.2), 6.0);
    let far = Pose { eye: DVec3::new(0.0, 2.0, 0.0), target: DVec3::new(0.0, 0.3, -5.0) };
    Stage { eye, focus: DVec3::new(0.0, 0.3, 0.0), room: 2.0, far: Some(far) }
}

/// Rolling ground: a sum of waves, the shorter the lower.
struct Waves {
    /// Along x and z, phase, height.
    list: Vec<[f64; 4]>,
}

impl Waves {
    fn new(dice: &mut Dice) -> Self {
        let wave = |i| {
            let f = 0.5 * 1.6f64.powi(i);
            [f * dice.within(-1.0, 1.0), f * dice.within(-1.0, 1.0), dice.angle(), 0.35 / f]
        };
        Self { list: (1..8).map(wave).collect() }
    }

    fn height(&self, x: f64, z: f64) -> f64 {
        0.4 + self.list.iter().map(|[a, b, c, h]| h * (a * x + b * z + c).sin()).sum::<f64>()
    }

    fn strew_rocks(&self, dice: &mut Dice, b: &mut Builder) {
        b.paint("rock", dice.colour(0.4, 0.2));
        let mut rocks = Obj::default();
        for _ in 0..dice.count(10, 60) {
            let mut at = dice.on_disc(DVec3::ZERO, 4.0);
            let size = dice.scale(0.04, 0.35);
            at.y = self.height(at.x, at.z) + 0.3 * size;
            let radii = DVec3::new(1.0, dice.within(0.4, 0.9), 1.0) * size;
            rocks.ball(at, radii, dice.count(3, 7), props::any_turn(dice));
        }
        b.mesh(rocks, "rock", false);
    }
}
