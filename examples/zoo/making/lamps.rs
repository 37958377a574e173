//! Lights that give a scene the exposure that is wanted, whatever their size.

use super::builder::Builder;
use super::dice::Dice;
use glam::DVec3;
use std::f64::consts::PI;

/// Where light falls: the point whose irradiance is set, and the direction towards the light.
pub struct Aim {
    pub at: DVec3,
    pub towards: DVec3,
    pub distance: f64,
    /// Irradiance of a surface that faces the light, W/m².
    pub irradiance: f64,
}

impl Aim {
    fn centre(&self) -> DVec3 {
        self.at + self.towards.normalize() * self.distance
    }

    /// The radiance of a lamp of this area that faces the point.
    fn radiance(&self, area: f64) -> f64 {
        self.irradiance * self.distance * self.distance / area
    }
}

/// A direction `elevation` degrees above the horizon.
pub fn above(dice: &mut Dice, elevation: [f64; 2]) -> DVec3 {
    let (e, a) = (dice.within(elevation[0], elevation[1]).to_radians(), dice.angle());
    DVec3::new(e.cos() * a.cos(), e.sin(), e.cos() * a.sin())
}

/// A tint of lamps: warm to neutral.
pub fn warm(dice: &mut Dice) -> DVec3 {
    let w = dice.within(0.0, 0.4);
    DVec3::new(1.0, 1.0 - 0.35 * w, 1.0 - w)
}

/// A sphere light of this radius.
pub fn sphere(b: &mut Builder, dice: &mut Dice, aim: &Aim, radius: f64) {
    let radiance = warm(dice) * aim.radiance(PI * radius * radius);
    b.sphere_light(aim.centre(), radius, radiance);
}

/// A quad light of this size that faces the point.
pub fn quad(b: &mut Builder, dice: &mut Dice, aim: &Aim, size: [f64; 2]) {
    let radiance = warm(dice) * aim.radiance(size[0] * size[1]);
    b.quad_light([aim.centre(), aim.at], size, radiance);
}

/// A far sphere light, as wide as `degrees` seen from the scene.
pub fn sun(b: &mut Builder, dice: &mut Dice, aim: &Aim, degrees: f64) {
    sphere(b, dice, aim, aim.distance * (0.5 * degrees).to_radians().tan());
}

/// A blue to grey sky that gives this irradiance where nothing blocks it.
pub fn sky(b: &mut Builder, dice: &mut Dice, irradiance: f64) {
    let blue = dice.within(0.0, 0.6);
    let tint = DVec3::new(1.0 - 0.5 * blue, 1.0 - 0.25 * blue, 1.0);
    b.sky(tint * irradiance / PI, true);
}
