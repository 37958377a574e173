//! `./x gallery [EFFECT ...]`: a picture of each effect beside the same frame without it, and what the effect costs, into
//! `docs/gallery.md` and `docs/pictures`; several minutes. With names of effects it renders their pictures alone.
//!
//! Each effect is a scene file of `scenes/gallery`, in which `#with` and `#without` mark what differs. Images and meshes beside them
//! are made in code.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for people")]

mod assets;
mod effect;
mod frame;
mod page;

use effect::{EFFECTS, Effect};
use frame::Frame;
use page::{Cost, Entry};
use std::path::Path;
use tweenray::measure::median;

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");
const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/gallery");
/// Name and size of the picture that shows one frame alone.
const WHOLE: (&str, (u32, u32)) = ("scene", (640, 360));
/// Camera samples a pixel of the pictures.
const PICTURE_SAMPLES: u32 = 100;
/// Camera samples a pixel of the frames whose time is taken.
const TIMED_SAMPLES: u32 = 8;
/// Pairs of frames whose times are compared.
const PAIRS: usize = 7;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let known = |name: &String| EFFECTS.iter().any(|(known, _)| known == name);
    if let Some(name) = wanted.iter().find(|name| !known(name)) {
        let all: Vec<&str> = EFFECTS.iter().map(|(name, _)| *name).collect();
        println!("no effect {name:?}; there are {}", all.join(", "));
        std::process::exit(2);
    }
    let folder = tempfile::tempdir().unwrap();
    assets::write(folder.path());
    assets::write(Path::new(SCENES));
    let mut entries = Vec::new();
    for effect in EFFECTS.iter().map(|(name, text)| Effect::read(name, text)) {
        if wanted.is_empty() || wanted.iter().any(|name| name == effect.name) {
            let frames =
                [&effect.with, &effect.without].map(|text| Frame::new(folder.path(), text));
            paint(&effect, &frames);
            if effect.name == WHOLE.0 {
                let path = Path::new(DOCS).join("pictures/gallery.jpg");
                let frame = Frame::of_size(folder.path(), &effect.with, WHOLE.1);
                frame::save(&path, &frame.picture(PICTURE_SAMPLES));
                println!("{}", path.display());
            }
            if wanted.is_empty() {
                let cost = cost(&frames);
                println!("{}: {:.2} times the CPU time", effect.name, cost.ratio.interval.estimate);
                entries.push(Entry { effect, cost });
            }
        }
    }
    if wanted.is_empty() {
        page::write(Path::new(DOCS), &entries);
        println!("{DOCS}/gallery.md");
    }
}

/// Writes the picture of an effect: the frame with it on the left, without it on the right.
fn paint(effect: &Effect, frames: &[Frame; 2]) {
    let pictures = frames.each_ref().map(|frame| frame.picture(PICTURE_SAMPLES));
    let path = Path::new(DOCS).join("pictures").join(effect.picture());
    frame::save_beside(&path, &pictures);
    println!("{}", path.display());
}

/// What the first frame takes beside the second: times in turns, each pair's order swapped.
fn cost(frames: &[Frame; 2]) -> Cost {
    // Both once before, for tables that are made at their first use.
    let rays = frames.each_ref().map(|frame| frame.render(TIMED_SAMPLES).1);
    let seconds = |i: usize| frames[i].render(TIMED_SAMPLES).2;
    let ratios: Vec<f64> = (0..PAIRS)
        .map(|pair| {
            let first = pair % 2;
            let (a, b) = (seconds(first), seconds(1 - first));
            if first == 0 { a / b } else { b / a }
        })
        .collect();
    Cost { ratio: median(&ratios).unwrap(), rays, pixels: frames[0].pixels() }
}
