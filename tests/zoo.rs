//! A small, fixed part of the zoo (`./x zoo`): frames that are inferred are no further from the truth
//! than traced ones, tile by tile, with an allowance for chance.

#[path = "../examples/zoo/judging/mod.rs"]
#[allow(dead_code, unused_imports, reason = "only the zoo itself takes all of it")]
mod judging;
#[path = "../examples/zoo/making/mod.rs"]
#[allow(dead_code, unused_imports, reason = "only the zoo itself takes all of it")]
mod making;

use judging::{Plan, Program, Tile, judge};
use making::{FAMILIES, Settings, Specimen};

const SEED: u64 = 1;

/// Families, each with the camera samples of its pixels, and whether a lens blurs.
const SCENES: [(&str, usize, bool); 9] = [
    ("forest", 1, false),
    ("grating", 4, false),
    ("contact", 4, false),
    ("foliage", 1, false),
    ("mirrors", 1, false),
    ("cornell", 4, false),
    ("forest", 4, true),
    ("contact", 1, true),
    ("mirrors", 4, true),
];

#[test]
fn inferred_tiles_are_no_worse_than_traced_ones() {
    let program = Program::new(env!("CARGO_BIN_EXE_tweenray"));
    let plan = Plan { size: [96, 64], judged: 4, between_only: true, timed: false };
    let folder = tempfile::tempdir().expect("a folder to work in");
    let mut broken = String::new();
    for (family, spp, has_lens) in SCENES {
        let index = FAMILIES.iter().position(|f| f.name == family).expect("a family");
        let mut specimen = Specimen::new(SEED, index as u64, 4);
        if has_lens {
            specimen = specimen.with_lens(SEED);
        }
        let settings = Settings { spp, light: 16 };
        let verdict =
            judge(&program, &specimen, settings, &plan, &folder.path().join(&specimen.name))
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
