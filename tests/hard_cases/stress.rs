//! `./x stress`: every hard case in full size, as a table. Arguments name cases: `7`, `a`,
//! `watertight`, `costs` (of the hit rules); `--small` runs the small size, `--list` only names the
//! cases. `--each-isa` runs the cases of intersection and spawned rays (`a`, `b`) under each instruction set that the
//! processor has, in place of its best alone. A word that names nothing ends it with exit code 2.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "prints its table"
)]

mod a_intersection;
mod b_spawned_rays;
mod c_shading;
#[path = "../common/mod.rs"]
mod common;
mod costs;
mod d_reuse;
mod f_statistics;
#[path = "../common/moves.rs"]
mod moves;
mod shapes;
#[path = "../common/sharpness.rs"]
mod sharpness;
#[allow(dead_code, missing_docs, reason = "the audit's tests use all of it")]
#[path = "../audit/shots.rs"]
mod shots;
mod suite;
#[path = "../../benches/support/mod.rs"]
mod support;

use std::io::Write;
use suite::{Case, Outcome, Size};

/// Letter, what it is about, its cases.
const LETTERS: [(&str, &str, &[Case]); 5] = [
    ("a", "intersection", a_intersection::CASES),
    ("b", "spawned rays", b_spawned_rays::CASES),
    ("c", "shading, normals, glass", c_shading::CASES),
    ("d", "reuse between frames", d_reuse::CASES),
    ("f", "statistics and effects", f_statistics::CASES),
];

/// Picks the costs of the hit rules.
const COSTS: &str = "costs";

/// Runs the cases of [`OF_ISA`] under each instruction set.
const EACH_ISA: &str = "--each-isa";
/// The letters of the cases whose rays Embree traces as [`suite::isa`] says.
const OF_ISA: [&str; 2] = ["a", "b"];

/// Whether `name` picks a case of `letter`.
fn picks(name: &str, letter: &str, case: &Case) -> bool {
    match LETTERS.iter().any(|(l, ..)| *l == name) {
        true => name == letter,
        false => name == case.number.to_string() || case.name.contains(name),
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let (flags, names): (Vec<&str>, Vec<&str>) =
        words.iter().map(String::as_str).partition(|w| w.starts_with("--"));
    let all = || LETTERS.iter().flat_map(|(l, _, cases)| cases.iter().map(move |c| (*l, c)));
    let unknown_flag = |flag: &&&str| !["--small", "--list", EACH_ISA].contains(*flag);
    let names_nothing = |name: &&&str| **name != COSTS && !all().any(|(l, c)| picks(name, l, c));
    if let Some(word) = flags.iter().find(unknown_flag).or_else(|| names.iter().find(names_nothing))
    {
        eprintln!("stress: '{word}' is neither a case nor an option; --list names the cases");
        std::process::exit(2);
    }
    let wanted = |letter: &str, case: &Case| {
        names.is_empty() || names.iter().any(|name| picks(name, letter, case))
    };
    if flags.contains(&"--list") {
        for (letter, case) in all().filter(|(letter, case)| wanted(letter, case)) {
            println!("{letter} {:>3}  {}", case.number, case.name);
        }
        println!("       {COSTS}");
        return;
    }
    let size = if flags.contains(&"--small") { Size::Small } else { Size::Full };
    support::title("stress: hard cases");
    let mut tally = Tally::default();
    let run = |tally: &mut Tally, letters: &[&str]| {
        println!("{HEAD}");
        for (letter, about, cases) in LETTERS.iter().filter(|(l, ..)| letters.contains(l)) {
            let cases: Vec<&Case> = cases.iter().filter(|case| wanted(letter, case)).collect();
            if !cases.is_empty() {
                println!("{}. {about}", letter.to_uppercase());
            }
            cases.into_iter().for_each(|case| tally.run(case, size));
        }
    };
    let mut within = true;
    if flags.contains(&EACH_ISA) {
        for isa in a_intersection::isa::sets_here() {
            println!("\nEmbree's {isa}");
            suite::set_isa(Some(isa));
            run(&mut tally, &OF_ISA);
        }
    } else {
        run(&mut tally, &LETTERS.map(|(letter, ..)| letter));
        if names.is_empty() || names.contains(&COSTS) {
            println!(
                "\nWhat each hit rule costs: spheres_on_terrain, camera rays on one thread, frames"
            );
            println!("of 320 x 180 on all.");
            within = costs::report(size);
            tally.cases += 1;
        }
    }
    let costs = if within { "" } else { "; the rules cost too much" };
    println!("\n{}{costs}", tally.in_words());
    println!("load average at the end {}", support::load_average());
    if !tally.failed.is_empty() || !within {
        std::process::exit(1);
    }
}

/// How the cases came out.
#[derive(Default)]
struct Tally {
    cases: usize,
    /// Numbers of the cases.
    failed: Vec<u32>,
    /// Numbers of the cases of which a part was skipped.
    skipped: Vec<u32>,
}

impl Tally {
    /// Runs a case and prints its row.
    fn run(&mut self, case: &Case, size: Size) {
        let (outcome, seconds) = support::timed(|| (case.run)(size));
        print_row(case, &outcome, seconds);
        self.cases += 1;
        if !outcome.passes() {
            self.failed.push(case.number);
        } else if !outcome.skipped.is_empty() {
            self.skipped.push(case.number);
        }
    }

    /// `57 cases, 1 failed: 12, 0 skipped in part`
    fn in_words(&self) -> String {
        let counted = |numbers: &[u32]| (numbers.len(), list(numbers));
        let ((failures, failed), (parts, skipped)) =
            (counted(&self.failed), counted(&self.skipped));
        format!("{} cases, {failures} failed{failed}, {parts} skipped in part{skipped}", self.cases)
    }
}

const HEAD: &str = "
case                                       rays    failures     bound    seconds  result
     anchor, then figures";

fn print_row(case: &Case, outcome: &Outcome, seconds: f64) {
    let (trials, failures, bound) = (outcome.trials, outcome.failures, outcome.bound());
    let result = match outcome.passes() {
        true if outcome.skipped.is_empty() => "ok",
        true => "skipped",
        false => "FAILED",
    };
    let (number, name) = (case.number, case.name);
    println!(
        "{number:>3}  {name:<30} {trials:>12}  {failures:>10}  {bound:>8.1e}  {seconds:>9.1}  {result}"
    );
    println!("     anchor: {}", case.anchor);
    outcome.shown.iter().for_each(|line| println!("     {line}"));
    outcome.skipped.iter().for_each(|line| println!("     skipped: {line}"));
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
