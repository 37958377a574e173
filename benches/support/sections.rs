//! Benches in sections that words of the command line pick.

use super::{load_average, seconds, title};

/// What the command line chose.
pub struct Choice {
    pub threads: usize,
    pub size: Option<(u32, u32)>,
    pub scene: Option<String>,
    pub spp: u32,
    /// Repeats with other random numbers.
    pub runs: u64,
    pub all: bool,
}

/// A section's name, and what it does.
pub type Section = (&'static str, fn(&Choice));

impl Choice {
    /// The chosen size; else the full one where all is wanted, `small` where not.
    pub fn size(&self, small: (u32, u32)) -> (u32, u32) {
        self.size.unwrap_or(if self.all { (640, 360) } else { small })
    }

    /// Whether `scene` is wanted.
    pub fn takes(&self, scene: &str) -> bool {
        self.scene.as_ref().is_none_or(|wanted| wanted == scene)
    }
}

/// Runs those of `sections` that the command line names, all if it names none.
pub fn run(name: &str, sections: &[Section]) {
    title(name);
    let mut choice = Choice { threads: 2, size: None, scene: None, spp: 1, runs: 3, all: false };
    let mut picked = Vec::new();
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        let mut value = || words.next().expect("a value behind the option");
        match word.as_str() {
            "--all" => choice.all = true,
            "--threads" => choice.threads = value().parse().expect("a number of threads"),
            "--spp" => choice.spp = value().parse().expect("a number of camera samples"),
            "--runs" => choice.runs = value().parse().expect("a number of runs"),
            "--scene" => choice.scene = Some(value()),
            "--size" => choice.size = Some(size(&value())),
            name => match sections.iter().find(|(known, _)| *known == name) {
                Some(section) => picked.push(*section),
                None => {
                    let names: Vec<&str> = sections.iter().map(|(name, _)| *name).collect();
                    panic!("'{name}' is none of {names:?}");
                }
            },
        }
    }
    println!("{} threads", choice.threads);
    for (name, run) in if picked.is_empty() { sections.to_vec() } else { picked } {
        println!("\n-- {name}");
        let seconds = seconds(|| run(&choice));
        println!("({seconds:.0} s; load average {})", load_average());
    }
}

fn size(text: &str) -> (u32, u32) {
    let parts = text.split_once('x').expect("a size such as 640x360");
    (parts.0.parse().expect("a width"), parts.1.parse().expect("a height"))
}
