//! Figures of inferred frames, as ratios: how accurate and how fast they are beside traced ones.
//!
//! Words pick sections: `cargo bench --bench inbetween -- cost flicker`. `--threads N` (2),
//! `--size WxH`, `--scene NAME`, and `--spp N` (1) for `quality` and `matter`, change what is run; `--all` judges every
//! frame in place of some, at the full size. What is compared takes turns, frame by frame.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "inbetween/accuracy.rs"]
mod accuracy;
#[path = "inbetween/cost.rs"]
mod cost;
#[path = "inbetween/lights.rs"]
mod lights;
#[path = "inbetween/matter.rs"]
mod matter;
#[path = "../tests/common/moves.rs"]
mod moves;
#[path = "inbetween/pan.rs"]
mod pan;
#[path = "inbetween/parts.rs"]
mod parts;
#[path = "../tests/common/sharpness.rs"]
mod sharpness;
mod support;

use support::sections::{self, Choice, Section};

const SECTIONS: [Section; 10] = [
    ("quality", accuracy::quality),
    ("policies", accuracy::policies),
    ("flicker", accuracy::flicker),
    ("sharpness", accuracy::sharp),
    ("cost", cost::report),
    ("parts", parts::report),
    ("pan", pan::speed),
    ("effects", pan::effects),
    ("lights", lights::report),
    ("matter", matter::report),
];

fn main() {
    sections::run("inbetween", &SECTIONS);
}

/// `part` of `all`, per cent; "-" where there is nothing.
pub fn per_cent(part: u64, all: u64) -> String {
    if all == 0 { "-".into() } else { format!("{:.2} %", 100.0 * part as f64 / all as f64) }
}

/// Lower quartile, median and upper quartile in words: `2.31 (2.20 to 2.44)`.
pub fn quartiles(values: &[f64]) -> String {
    support::quantiles(values, [0.25, 0.5, 0.75], 2)
}
