//! A small, fixed part of the zoo (`./x zoo`): frames that are inferred are no further from the truth
//! than traced ones, tile by tile, with an allowance for chance.

#[path = "../examples/zoo/judging/mod.rs"]
#[allow(dead_code, unused_imports, reason = "only the zoo itself takes all of it")]
mod judging;
#[path = "../examples/zoo/making/mod.rs"]
#[allow(dead_code, unused_imports, reason = "only the zoo itself takes all of it")]
mod making;

use judging::{Plan, Program, Tile, judge};
use making::{Change, FAMILIES, Settings, Specimen};

const SEED: u64 = 1;

const LENS: Option<Change> = Some(Specimen::with_lens);
const GLOSS: Option<Change> = Some(Specimen::with_gloss);
const MATTER: Option<Change> = Some(Specimen::with_matter);
const FOG: Option<Change> = Some(Specimen::with_fog);

/// Families, each with the camera samples of its pixels.
const SCENES: [(&str, usize, Option<Change>); 17] = [
    ("forest", 1, None),
    ("grating", 4, None),
    ("contact", 4, None),
    ("foliage", 1, None),
    ("mirrors", 1, None),
    ("cornell", 4, None),
    ("city", 4, None),
    ("blinds", 1, None),
    ("lamps", 1, None),
    ("tiny-lamp", 4, None),
    ("forest", 4, LENS),
    ("contact", 1, LENS),
    ("mirrors", 4, LENS),
    ("contact", 4, GLOSS),
    ("mirrors", 1, GLOSS),
    ("contact", 1, MATTER),
    ("cornell", 4, FOG),
];

#[test]
fn inferred_tiles_are_no_worse_than_traced_ones() {
    let program = Program::new(env!("CARGO_BIN_EXE_tweenray"));
    let plan = Plan { size: [96, 64], judged: 4, between_only: true, timed: false };
    let folder = tempfile::tempdir().expect("a folder to work in");
    let mut broken = String::new();
    for (number, (family, spp, change)) in SCENES.into_iter().enumerate() {
        let index = FAMILIES.iter().position(|f| f.name == family).expect("a family");
        let mut specimen = Specimen::new(SEED, index as u64, 4);
        if let Some(change) = change {
            specimen = change(specimen, SEED);
        }
        let settings = Settings { spp, most: None, light: 16 };
        let verdict =
            judge(&program, &specimen, settings, &plan, &folder.path().join(number.to_string()))
                .unwrap_or_else(|e| panic!("{family}: {e}"));
        assert_eq!(verdict.frames.len(), 2, "{family}: frames 2 and 3 are judged");
        for frame in &verdict.frames {
            for tile in frame.tiles.iter().filter(|tile| !tile.keeps()) {
                broken += &told(&specimen.name, frame.frame, tile);
            }
        }
    }
    assert!(broken.is_empty(), "RMSE in display steps, tiles of 32 x 32:\n{broken}");
}

fn told(family: &str, frame: usize, tile: &Tile) -> String {
    let [x, y] = tile.place;
    let [inferred, traced, bound] = [tile.inferred, tile.traced, tile.bound].map(f64::sqrt);
    format!(
        "{family}, frame {frame}, tile {x},{y}: inferred {inferred:.2}, traced {traced:.2}, \
         at most {bound:.2} by chance\n"
    )
}
