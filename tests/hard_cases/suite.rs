//! What the hard cases share: two sizes, an outcome that counts, rays from seeds.
//!
//! A case is a function of its size. `cargo test` runs the small size of each as a test of its
//! own; `./x stress` runs the full size of all and prints a table.

#![allow(dead_code, reason = "the tests and the stress run each use their part")]

use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};
use tweenray::intersect::{Hit, Intersector, Ray};
use tweenray::stats::RayCounts;

/// How much of a case is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Seconds, all cases together.
    Small,
    /// The figures that the documentation states.
    Full,
}

impl Size {
    /// `small` or `full`.
    pub fn of<T>(self, small: T, full: T) -> T {
        match self {
            Self::Small => small,
            Self::Full => full,
        }
    }
}

/// The instruction set that cases of intersection run on.
static ISA: Mutex<Option<&'static str>> = Mutex::new(None);

/// The instruction set that Embree shall use in cases of intersection and spawned rays; `None` for the machine's best.
pub fn isa() -> Option<&'static str> {
    *ISA.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sets what [`isa`] says.
pub fn set_isa(isa: Option<&'static str>) {
    *ISA.lock().unwrap_or_else(PoisonError::into_inner) = isa;
}

/// A hard case.
pub struct Case {
    /// Its number, unique in the suite.
    pub number: u32,
    /// Its name.
    pub name: &'static str,
    /// What the best public test of its kind asks for, or what was measured without our rules.
    pub anchor: &'static str,
    /// Runs it.
    pub run: fn(Size) -> Outcome,
}

/// Lists a letter's cases and makes each a test: `number name "anchor" => function;`.
macro_rules! cases {
    ($($number:literal $name:ident $anchor:literal => $($run:ident)::+;)*) => {
        /// All cases of this letter.
        #[allow(dead_code, reason = "the stress run reads it, the tests do not")]
        pub const CASES: &[$crate::suite::Case] = &[$($crate::suite::Case {
            number: $number,
            name: stringify!($name),
            anchor: $anchor,
            run: $($run)::+,
        }),*];

        #[cfg(test)]
        mod tests {
            $(#[test]
            fn $name() {
                let outcome = super::$($run)::+($crate::suite::Size::Small);
                println!("{}", outcome.shown.join("\n"));
                outcome.skipped.iter().for_each(|part| println!("SKIPPED {part}"));
                outcome.assert();
            })*
        }
    };
}
pub(crate) use cases;

/// What a case found.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Rays, pixels, meshes: whatever was tried.
    pub trials: u64,
    /// Trials that failed.
    pub failures: u64,
    /// The share of trials that may fail: 0 unless the case says otherwise.
    pub allowed: f64,
    /// Measured figures, a line each.
    pub shown: Vec<String>,
    /// Some of the trials that failed, a line each.
    pub examples: Vec<String>,
    /// What is wrong whatever the counts say, a line each.
    pub wrong: Vec<String>,
    /// Parts that could not be run here, and why, a line each: such a case is no plain "ok".
    pub skipped: Vec<String>,
}

/// Examples that are kept.
const MOST_EXAMPLES: usize = 20;

impl Outcome {
    /// `failures` of `trials` failed.
    pub fn count(&mut self, trials: u64, failures: u64) {
        self.trials += trials;
        self.failures += failures;
    }

    /// One trial.
    pub fn check(&mut self, ok: bool, what: impl FnOnce() -> String) {
        self.trials += 1;
        if !ok {
            self.failures += 1;
            self.example(what());
        }
    }

    /// A line for the reader.
    pub fn show(&mut self, line: impl Into<String>) {
        self.shown.push(line.into());
    }

    /// A figure that must not exceed `at_most`.
    pub fn at_most(&mut self, name: &str, value: f64, at_most: f64) {
        self.show(format!("{name}: {value:.3e} (at most {at_most:.3e})"));
        if value.is_nan() || value > at_most {
            self.complain(format!("{name}: {value:e} exceeds {at_most:e}"));
        }
    }

    /// A figure that must reach `at_least`: else the case is not hard, or its cure does nothing.
    pub fn at_least(&mut self, name: &str, value: f64, at_least: f64) {
        self.show(format!("{name}: {value:.3e} (at least {at_least:.3e})"));
        if value.is_nan() || value < at_least {
            self.complain(format!("{name}: {value:e} is below {at_least:e}"));
        }
    }

    /// Something that is wrong whatever the counts say.
    pub fn complain(&mut self, what: String) {
        self.wrong.push(what);
    }

    /// Leaves out a part that cannot be run here: says which, and why.
    pub fn skip(&mut self, what: impl Into<String>) {
        self.skipped.push(what.into());
    }

    /// Describes a failed trial, which is counted elsewhere.
    pub fn example(&mut self, what: String) {
        if self.examples.len() < MOST_EXAMPLES {
            self.examples.push(what);
        }
    }

    /// Takes in another outcome of the same case.
    pub fn merge(&mut self, other: Self) {
        self.count(other.trials, other.failures);
        self.shown.extend(other.shown);
        self.wrong.extend(other.wrong);
        self.skipped.extend(other.skipped);
        other.examples.into_iter().for_each(|line| self.example(line));
    }

    /// Both, for sums.
    pub fn merged(mut self, other: Self) -> Self {
        self.merge(other);
        self
    }

    /// Whether the case passes: few enough failures, nothing else wrong, something tried.
    pub fn passes(&self) -> bool {
        let few = self.failures as f64 <= self.allowed * self.trials as f64;
        self.trials > 0 && few && self.wrong.is_empty()
    }

    /// What is wrong and some of what failed, a line each.
    pub fn faults(&self) -> impl Iterator<Item = &String> {
        self.wrong.iter().chain(&self.examples)
    }

    /// Panics with what is wrong.
    pub fn assert(&self) {
        let (failures, trials) = (self.failures, self.trials);
        let faults: Vec<&str> = self.faults().map(String::as_str).collect();
        assert!(self.passes(), "{failures} of {trials} failed:\n{}", faults.join("\n"));
    }

    /// Upper end of the 95 % interval of the failure rate: 3/n when none failed (rule of three),
    /// else Wilson's (1927).
    pub fn bound(&self) -> f64 {
        let (n, k) = (self.trials as f64, self.failures as f64);
        if self.failures == 0 {
            return 3.0 / n;
        }
        let z = 1.645;
        let p = k / n;
        let middle = p + z * z / (2.0 * n);
        let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        (middle + half) / (1.0 + z * z / n)
    }
}

/// Random numbers of stream `stream` of a case's `seed`.
pub fn rng(seed: u64, stream: u64) -> Pcg64Mcg {
    // Odd factors keep seeds and streams apart.
    Pcg64Mcg::new(u128::from(seed) << 64 | u128::from(stream.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

/// Rays handed to an intersector at once.
pub const BATCH: u64 = 4096;

/// Makes `count` rays in batches on all cores, traces them with `intersector` and sums what
/// `judge` says of each batch. `make(i)` is ray number `i` and depends on nothing else.
pub fn trace<T: Send>(
    intersector: &dyn Intersector,
    count: u64,
    make: impl Fn(u64) -> Ray + Sync,
    judge: impl Fn(&[Ray], &[Option<Hit>]) -> T + Sync,
    sum: impl Fn(T, T) -> T + Sync + Send,
    zero: impl Fn() -> T + Sync + Send,
) -> T {
    (0..count.div_ceil(BATCH))
        .into_par_iter()
        .map_init(
            || (Vec::new(), Vec::new()),
            |(rays, hits), batch| {
                rays.clear();
                rays.extend((batch * BATCH..((batch + 1) * BATCH).min(count)).map(&make));
                hits.clear();
                hits.resize(rays.len(), None);
                intersector.intersect_batch(rays, hits, &mut RayCounts::default());
                judge(rays, hits)
            },
        )
        .reduce(zero, sum)
}

/// How many of `count` rays miss.
pub fn misses(intersector: &dyn Intersector, count: u64, make: impl Fn(u64) -> Ray + Sync) -> u64 {
    let judge =
        |_: &[Ray], hits: &[Option<Hit>]| hits.iter().filter(|h| h.is_none()).count() as u64;
    trace(intersector, count, make, judge, |a, b| a + b, || 0)
}
