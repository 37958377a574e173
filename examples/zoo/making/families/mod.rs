//! The families of scenes.

mod lamps;
mod nature;
mod places;
mod shadows;
mod things;

use super::builder::Builder;
use super::cameras::Stage;
use super::dice::Dice;

/// A kind of scene.
pub struct Family {
    /// Its name in tables and on the command line.
    pub name: &'static str,
    /// Builds one, and says where a camera can go.
    pub make: fn(&mut Dice, &mut Builder) -> Stage,
    /// Whether it stands on open, level ground at y = 0, where more things can be put down.
    pub is_open: bool,
}

const fn open(name: &'static str, make: fn(&mut Dice, &mut Builder) -> Stage) -> Family {
    Family { name, make, is_open: true }
}

const fn closed(name: &'static str, make: fn(&mut Dice, &mut Builder) -> Stage) -> Family {
    Family { name, make, is_open: false }
}

/// All families.
pub const FAMILIES: [Family; 19] = [
    open("forest", nature::forest),
    open("grating", shadows::grating),
    open("foliage", nature::foliage),
    open("city", places::city),
    open("contact", shadows::contact),
    closed("lamps", lamps::hall),
    open("tiny-lamp", lamps::tiny),
    open("wide-light", lamps::wide),
    closed("low-sun", nature::low_sun),
    open("mirrors", things::mirrors),
    closed("terrain", nature::terrain),
    open("blinds", shadows::blinds),
    open("fence", shadows::fence),
    open("curved", things::curved),
    closed("textured", places::textured),
    closed("window-room", places::window_room),
    closed("cornell", places::cornell),
    open("mixed-lights", lamps::mixed),
    open("sky-alone", lamps::sky_alone),
];
