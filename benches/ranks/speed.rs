//! Two ranks of one thread beside one rank of two threads, on a pan of 64 frames.

use crate::real::{Line, Ran, Stage};
use crate::{median, spread};

const WORDS: &str = "--size 400x300 --spp 4";

pub fn report(turns: usize) {
    println!(
        "64 frames of reflective_spheres, {WORDS}, on the same cores; MPI's start, reading and the"
    );
    println!("tree are left out of both (seconds of each stand behind)");
    let stage = Stage::of("reflective_spheres");
    let line = |ranks, threads| Line { ranks, threads, frames: 64, words: WORDS.into() };
    let lines = [line(1, 2), line(2, 1)];
    let (mut walls, mut cores) = (Vec::new(), Vec::new());
    println!(
        "  1 rank of 2: wall, core   2 ranks of 1: wall, core   speed by wall   by core seconds"
    );
    for turn in 0..turns {
        let mut took = [[0.0; 2]; 2];
        let mut rans = Vec::new();
        let mut frames = Vec::new();
        // Neither is always the first.
        for i in if turn % 2 == 0 { [0, 1] } else { [1, 0] } {
            let ran = stage.run(&lines[i]);
            frames.push(stage.frames());
            took[i] = [ran.wall(), ran.cpu - stage.start_of(&lines[i])];
            rans.push((i, ran));
        }
        assert_eq!(frames[0], frames[1], "bytes differ");
        let [one, two] = took;
        println!(
            "  {:19.2}, {:5.2}   {:18.2}, {:5.2}   {:13.3}   {:15.3}   starts: {}",
            one[0],
            one[1],
            two[0],
            two[1],
            one[0] / two[0],
            one[1] / two[1],
            starts(&rans)
        );
        walls.push(one[0] / two[0]);
        cores.push(one[1] / two[1]);
    }
    println!(
        "  speed of two ranks over one: by wall {}, by core seconds {}",
        spread(&walls),
        spread(&cores)
    );
    println!("  no byte differed; wanted: {:.2} or more, here {:.3}", 0.92, median(walls));
}

/// Seconds before the first frame, launcher included, of them those of the tree.
fn starts(rans: &[(usize, Ran)]) -> String {
    let of = |(i, ran): &(usize, Ran)| {
        let seconds = |name: &str| ran.stats[name].as_f64().unwrap();
        let before = seconds("load_seconds") + seconds("build_seconds");
        format!("{} ranks {before:.2} (tree {:.2})", i + 1, seconds("build_seconds"))
    };
    rans.iter().map(of).collect::<Vec<_>>().join(", ")
}
