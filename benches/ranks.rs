//! Jobs of several ranks, and of one that is killed, as a user runs them. What is compared takes turns.
//!
//! Words pick sections: `cargo bench --features mpi --bench ranks -- speed exchange checkpoint`;
//! `--turns N` (5) says how often. Ranks share the cores that the bench may use (`taskset -c 0,1` gives
//! them two). On a machine that others use too, wall times tell how busy it was, and seconds of a core
//! what was done.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]
#![allow(clippy::unwrap_used, dead_code, reason = "shared with a program for people")]

#[path = "ranks/checkpoint.rs"]
mod checkpoint;
#[path = "ranks/exchange.rs"]
mod exchange;
#[path = "../tests/common/mpirun.rs"]
mod launcher;
#[path = "../examples/scaling/real.rs"]
mod real;
#[path = "ranks/speed.rs"]
mod speed;

type Section = (&'static str, fn(usize));

const SECTIONS: [Section; 3] =
    [("speed", speed::report), ("exchange", exchange::report), ("checkpoint", checkpoint::report)];

fn main() {
    if !cfg!(feature = "mpi") {
        println!("skipped: ranks need --features mpi");
        return;
    }
    let mut turns = 5;
    let mut picked = Vec::new();
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        match &*word {
            "--turns" => turns = words.next().and_then(|n| n.parse().ok()).expect("--turns N"),
            "--list" => return,
            _ => picked.push(word),
        }
    }
    let is_known = |word: &String| SECTIONS.iter().any(|(name, _)| name == word);
    assert!(picked.iter().all(is_known), "sections: speed, exchange, checkpoint");
    for (name, report) in SECTIONS {
        if picked.is_empty() || picked.iter().any(|word| word == name) {
            println!("\n{name} (load average {})", load());
            report(turns);
            println!("load average {}", load());
        }
    }
}

fn load() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().unwrap_or("unknown").into()
}

/// The middle one.
fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The least, the middle one and the most, with two digits.
fn spread(values: &[f64]) -> String {
    let edge = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap_or(f64::NAN);
    let middle = median(values.iter().copied());
    format!("{middle:.3} ({:.3} to {:.3})", edge(f64::min), edge(f64::max))
}
