//! What the benches share: interleaved repeats, medians and ratios, plain tables.
//!
//! A shared machine changes its speed from second to second. So the candidates of a comparison
//! take turns within one process, and a comparison is the median of the turns' own ratios.
#![allow(dead_code, reason = "each bench uses its part")]
#![allow(clippy::print_stdout, reason = "benches print their figures")]

pub mod camera_rays;
pub mod sections;

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use tweenray::embree::{BuildOptions, CommittedScene, Quality, SceneBuilder};
use tweenray::import::{self, LoadOptions, Loaded};
use tweenray::scene::Scene;

/// Seconds of each turn of one candidate.
pub struct Times(Vec<f64>);

/// A candidate: its name and what a turn of it does.
pub type Candidate<'a> = (String, Box<dyn FnMut() + 'a>);

/// Lets every candidate have its turn, `turns` times over, after one turn that does not count.
pub fn take_turns(turns: usize, candidates: &mut [Candidate]) -> Vec<Times> {
    let mut times: Vec<Times> = candidates.iter().map(|_| Times(Vec::new())).collect();
    for turn in 0..=turns {
        for ((_, run), times) in candidates.iter_mut().zip(&mut times) {
            let seconds = seconds(run);
            if turn > 0 {
                times.0.push(seconds);
            }
        }
    }
    times
}

/// One turn each, for what takes too long to repeat.
pub fn take_a_turn(candidates: &mut [Candidate]) -> Vec<Times> {
    candidates.iter_mut().map(|(_, run)| Times(vec![seconds(run)])).collect()
}

/// Wall seconds of one call.
pub fn seconds<T>(run: impl FnOnce() -> T) -> f64 {
    timed(run).1
}

/// A call's result and its wall seconds.
pub fn timed<T>(run: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = black_box(run());
    (result, start.elapsed().as_secs_f64())
}

impl Times {
    /// Middle of the turns.
    pub fn median(&self) -> f64 {
        quantile(&self.0, 0.5)
    }

    /// Half the distance of the quartiles over the median, per cent.
    pub fn spread(&self) -> f64 {
        50.0 * (quantile(&self.0, 0.75) - quantile(&self.0, 0.25)) / self.median()
    }

    /// This over `other`, turn by turn: lower quartile, median, upper quartile.
    pub fn over(&self, other: &Self) -> [f64; 3] {
        let ratios: Vec<f64> = self.0.iter().zip(&other.0).map(|(a, b)| a / b).collect();
        [0.25, 0.5, 0.75].map(|q| quantile(&ratios, q))
    }

    /// This less `other`, turn by turn: the median, seconds.
    pub fn less(&self, other: &Self) -> f64 {
        let differences: Vec<f64> = self.0.iter().zip(&other.0).map(|(a, b)| a - b).collect();
        quantile(&differences, 0.5)
    }
}

/// The value below which the share `q` of `values` lies.
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = q * (sorted.len() - 1) as f64;
    let (low, part) = (at.floor() as usize, at.fract());
    sorted[low] + part * (sorted[at.ceil() as usize] - sorted[low])
}

/// Three quantiles of `values` in words, the middle one first: `2.31 (2.20 to 2.44)`.
pub fn quantiles(values: &[f64], shares: [f64; 3], digits: usize) -> String {
    let [low, middle, high] = shares.map(|q| quantile(values, q));
    format!("{middle:.digits$} ({low:.digits$} to {high:.digits$})")
}

/// Prints a bench's name and the machine's state: figures mean little without.
pub fn title(name: &str) {
    println!("\n== {name} ==");
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    println!("{cores} cores, load average {}", load_average());
}

/// The machine's load over the last minute, five minutes, quarter of an hour.
pub fn load_average() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').take(3).collect::<Vec<_>>().join(" ")
}

/// Prints rows in columns: the first one to the left, the others to the right.
pub fn table(head: &[&str], rows: &[Vec<String>]) {
    let head = head.iter().map(ToString::to_string).collect();
    let all: Vec<&Vec<String>> = std::iter::once(&head).chain(rows).collect();
    let width = |k: usize| all.iter().map(|r| r[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    println!();
    for row in &all {
        let cells = row.iter().zip(&widths).enumerate();
        let cells: Vec<String> = cells
            .map(|(k, (c, w))| if k == 0 { format!("{c:<w$}") } else { format!("{c:>w$}") })
            .collect();
        println!("{}", cells.join("  ").trim_end());
    }
}

/// The common bench scene.
pub fn bench_scene() -> Loaded {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/spheres_on_terrain/scene.toml");
    import::load(&file, &LoadOptions::default()).expect("the bench scene loads")
}

/// Most memory that this process held so far, or "untold" where the kernel does not say.
pub fn peak_memory() -> String {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.trim().trim_end_matches(" kB").parse::<f64>().ok());
    match kilobytes.filter(|k| *k > 0.0) {
        Some(k) => format!("{:.0} MB", k * 1024e-6),
        None => "untold".into(),
    }
}

/// The scene's triangles in Embree, as the intersect layer builds them.
pub fn commit(scene: &Scene, threads: usize) -> CommittedScene<'_> {
    let (robust, quality) = (true, Quality::Medium);
    let options = BuildOptions { threads, isa: None, robust, quality, compact: false };
    let mut builder = SceneBuilder::new(&options).expect("a device");
    for mesh in &scene.meshes {
        let (positions, triangles) = (&mesh.positions, &mesh.triangles);
        let none = std::iter::empty();
        let added = builder.add_triangles(positions, mesh.vertex_count, triangles, none);
        added.expect("valid triangles");
    }
    builder.commit().expect("a scene")
}
