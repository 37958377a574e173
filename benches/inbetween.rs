//! Figures of inferred frames, as ratios: how accurate and how fast they are beside traced ones.
//!
//! Words pick sections: `cargo bench --bench inbetween -- cost flicker`. `--threads N` (2),
//! `--size WxH`, `--scene NAME`, and `--spp N` (1) for `quality` and `matter`, change what is run; `--all` judges every
//! frame in place of some, at the full size. What is compared takes turns, frame by frame.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "inbetween/accuracy.rs"]
mod accuracy;
#[path = "inbetween/cost.rs"]
mod cost;
#[path = "inbetween/lights.rs"]
mod lights;
#[path = "inbetween/matter.rs"]
mod matter;
#[path = "../tests/common/moves.rs"]
mod moves;
#[path = "inbetween/pan.rs"]
mod pan;
#[path = "inbetween/parts.rs"]
mod parts;
#[path = "../tests/common/sharpness.rs"]
mod sharpness;
mod support;

/// What the command line chose.
pub struct Choice {
    threads: usize,
    size: Option<(u32, u32)>,
    scene: Option<String>,
    spp: u32,
    all: bool,
}

impl Choice {
    /// The chosen size; else the full one where all is wanted, `small` where not.
    fn size(&self, small: (u32, u32)) -> (u32, u32) {
        self.size.unwrap_or(if self.all { (640, 360) } else { small })
    }

    /// Whether `scene` is wanted.
    fn takes(&self, scene: &str) -> bool {
        self.scene.as_ref().is_none_or(|wanted| wanted == scene)
    }
}

type Section = (&'static str, fn(&Choice));

const SECTIONS: [Section; 10] = [
    ("quality", accuracy::quality),
    ("policies", accuracy::policies),
    ("flicker", accuracy::flicker),
    ("sharpness", accuracy::sharp),
    ("cost", cost::report),
    ("parts", parts::report),
    ("pan", pan::speed),
    ("effects", pan::effects),
    ("lights", lights::report),
    ("matter", matter::report),
];

fn main() {
    support::title("inbetween");
    let mut choice = Choice { threads: 2, size: None, scene: None, spp: 1, all: false };
    let mut picked = Vec::new();
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        let mut value = || words.next().expect("a value behind the option");
        match word.as_str() {
            "--all" => choice.all = true,
            "--threads" => choice.threads = value().parse().expect("a number of threads"),
            "--spp" => choice.spp = value().parse().expect("a number of camera samples"),
            "--scene" => choice.scene = Some(value()),
            "--size" => choice.size = Some(size(&value())),
            name => match SECTIONS.iter().find(|(known, _)| *known == name) {
                Some(section) => picked.push(*section),
                None => panic!("'{name}' is none of {:?}", SECTIONS.map(|(name, _)| name)),
            },
        }
    }
    let sections = if picked.is_empty() { SECTIONS.to_vec() } else { picked };
    println!("{} threads", choice.threads);
    for (name, run) in sections {
        println!("\n-- {name}");
        let seconds = support::seconds(|| run(&choice));
        println!("({seconds:.0} s; load average {})", support::load_average());
    }
}

fn size(text: &str) -> (u32, u32) {
    let parts = text.split_once('x').expect("a size such as 640x360");
    (parts.0.parse().expect("a width"), parts.1.parse().expect("a height"))
}

/// `part` of `all`, per cent; "-" where there is nothing.
pub fn per_cent(part: u64, all: u64) -> String {
    if all == 0 { "-".into() } else { format!("{:.2} %", 100.0 * part as f64 / all as f64) }
}

/// Lower quartile, median and upper quartile in words: `2.31 (2.20 to 2.44)`.
pub fn quartiles(values: &[f64]) -> String {
    let [low, middle, high] = [0.25, 0.5, 0.75].map(|q| support::quantile(values, q));
    format!("{middle:.2} ({low:.2} to {high:.2})")
}
