//! How often what frames to come need should be put on disk: what it takes, and what a kill costs.

use crate::median;
use crate::real::{Line, Stage};

const EVERY: [&str; 5] = ["off", "0s", "3s", "10s", "30s"];
/// Frames of the segment that are there when the job is killed.
const KILLED_AT: usize = 40;

pub fn report(turns: usize) {
    for (scene, words) in [("demo", "--size 320x180"), ("reflective_spheres", "--size 640x360")] {
        println!(
            "65 frames of {scene}, {words}, one segment, on two threads; seconds of a core, the median"
        );
        println!(
            "of {turns} turns. Lost: what a job took more that was killed when {KILLED_AT} frames were there"
        );
        println!("  --checkpoint   writing it   of the job      MB   lost by a kill");
        let stage = Stage::of(scene);
        let line = |every: &str| {
            let words = format!("{words} --checkpoint {every}");
            Line { ranks: 1, threads: 2, frames: 65, words }
        };
        let mut whole = Vec::new();
        let mut rows = vec![Vec::new(); EVERY.len()];
        for _ in 0..turns {
            // What a job takes that nobody disturbs, whichever way its references are kept.
            let ran = stage.run(&line("off"));
            let start = stage.start_of(&line("off"));
            let frames = stage.frames();
            whole.push(ran.cpu - start);
            for (i, every) in EVERY.into_iter().enumerate() {
                let ran = stage.run(&line(every));
                let rank = &ran.stats["ranks"][0];
                let figure = |name: &str| rank[name].as_f64().unwrap();
                let (seconds, bytes) = (figure("checkpoint_seconds"), figure("checkpoint_bytes"));
                let share = seconds / figure("busy_seconds");
                let killed = stage.kill_after(&line(every), KILLED_AT);
                let resumed = stage.run_on(&line(every)).cpu;
                assert_eq!(stage.frames(), frames, "bytes differ");
                let lost = killed + resumed - 2.0 * start - (ran.cpu - start);
                rows[i].push([seconds, share, bytes, lost]);
            }
        }
        for (every, row) in EVERY.into_iter().zip(&rows) {
            let of = |k: usize| median(row.iter().map(|figures| figures[k]));
            println!(
                "  {every:>12}   {:8.2} s   {:8.2} %   {:5.1}   {:12.1} s",
                of(0),
                100.0 * of(1),
                of(2) / 1e6,
                of(3)
            );
        }
        println!(
            "  a job that nobody disturbs takes {:.1} s of a core; no byte differed",
            median(whole)
        );
    }
}
