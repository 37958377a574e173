//! `./x stress`: every hard case in full size, as a table. Arguments name cases: `7`, `a`,
//! `watertight`, `costs` (of the hit rules); `--small` runs the small size.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "prints its table")]

mod a_intersection;
mod b_spawned_rays;
mod c_shading;
#[path = "../common/mod.rs"]
mod common;
mod costs;
mod f_statistics;
mod shapes;
mod suite;
#[path = "../../benches/support/mod.rs"]
mod support;

use std::io::Write;
use suite::{Case, Outcome, Size};

/// Letter, what it is about, its cases.
const LETTERS: [(&str, &str, &[Case]); 4] = [
    ("a", "intersection", a_intersection::CASES),
    ("b", "spawned rays", b_spawned_rays::CASES),
    ("c", "shading, normals, glass", c_shading::CASES),
    ("f", "statistics and effects", f_statistics::CASES),
];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let size = if words.iter().any(|w| w == "--small") { Size::Small } else { Size::Full };
    let names: Vec<&String> = words.iter().filter(|w| !w.starts_with("--")).collect();
    let wanted = |letter: &str, case: &Case| {
        names.is_empty()
            || names.iter().any(|n| {
                *n == letter || **n == case.number.to_string() || case.name.contains(n.as_str())
            })
    };
    support::title("stress: hard cases");
    println!("{HEAD}");
    let (mut run, mut failed) = (0, Vec::new());
    for (letter, about, cases) in LETTERS {
        let cases: Vec<&Case> = cases.iter().filter(|case| wanted(letter, case)).collect();
        if !cases.is_empty() {
            println!("{}. {about}", letter.to_uppercase());
        }
        for case in cases {
            let (outcome, seconds) = support::timed(|| (case.run)(size));
            print_row(case, &outcome, seconds);
            run += 1;
            if !outcome.passes() {
                failed.push(case.number);
            }
        }
    }
    let mut within = true;
    if names.is_empty() || names.iter().any(|n| *n == "costs") {
        println!(
            "\nWhat each hit rule costs: spheres_on_terrain, camera rays on one thread, frames"
        );
        println!("of 320 x 180 on all.");
        within = costs::report(size);
        run += 1;
    }
    let costs = if within { "" } else { "; the rules cost too much" };
    println!("\n{run} cases, {} failed{}{costs}", failed.len(), list(&failed));
    println!("load average at the end {}", support::load_average());
    if run == 0 || !failed.is_empty() || !within {
        std::process::exit(1);
    }
}

const HEAD: &str = "
case                                       rays    failures     bound    seconds  result
     anchor, then figures";

fn print_row(case: &Case, outcome: &Outcome, seconds: f64) {
    let (trials, failures, bound) = (outcome.trials, outcome.failures, outcome.bound());
    let result = if outcome.passes() { "ok" } else { "FAILED" };
    let (number, name) = (case.number, case.name);
    println!(
        "{number:>3}  {name:<30} {trials:>12}  {failures:>10}  {bound:>8.1e}  {seconds:>9.1}  {result}"
    );
    println!("     anchor: {}", case.anchor);
    outcome.shown.iter().for_each(|line| println!("     {line}"));
    if !outcome.passes() {
        outcome.faults().for_each(|line| println!("     wrong: {line}"));
    }
    // A run of minutes is watched.
    std::io::stdout().flush().unwrap();
}

fn list(failed: &[u32]) -> String {
    let failed: Vec<String> = failed.iter().map(u32::to_string).collect();
    if failed.is_empty() { String::new() } else { format!(": {}", failed.join(", ")) }
}
