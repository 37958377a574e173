//! F. Statistics and effects.

mod duel;
mod effects;
mod shadows;

use crate::suite::cases;

cases! {
    60 oracle_duel "no public test of its kind" => duel::oracle_duel;
    61 soft_shadows "Mitsuba: 99.75 % of pixels accept" => shadows::soft_shadows;
    62 effects_cost_nothing "a branch a pixel in renderers that decide as they go" => effects::effects_cost_nothing;
}
