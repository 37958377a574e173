//! B. Spawned rays.

mod gaps;
mod self_hits;
mod shadows;
mod terminator;

use crate::suite::cases;

cases! {
    26 reintersect "pbrt: 1,000 triangles, 1,000 rays each, degenerate ones skipped" => self_hits::reintersect;
    27 offset_far "a fixed offset of 1e-4: 49.7 % at 1e4" => self_hits::offset_far;
    28 minimum_visible_gap "Mitsuba before 2025: 1,500 ulp; Wächter and Binder: 256" => gaps::minimum_visible;
    29 closed_box_dark "no public test" => shadows::closed_box;
    30 contact_shadow "no public test" => shadows::contact;
    31 shadow_terminator "Cycles: an offset by hand, +3.0 % time" => terminator::terminator;
}
