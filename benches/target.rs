//! `render --target` and `--budget`, as a user runs them: in how many frames a target is reached against
//! a converged reference, how much longer it takes than the fastest setting of a sweep that reaches it
//! in 95 % of them, and how near a budget of half the default's time is kept.
//!
//! `SCENE` (names under scenes/, or scene files, as those of `./x zoo`), `TARGETS` (dB, or `budget`),
//! `PIXELS`, `SPP` (of each reference), `LIGHTS` (shadow and sky samples of the sweep) and `THREADS` change
//! what is run, `PROGRAM` which program. With `KEEP`, a folder, references and sweeps are made once and read
//! again.
//!
//! A reference of four times the samples still has some tenth of the squared error, enough for a frame
//! at a target's edge to be counted as missed. So there are two with other seeds: the mean of the product
//! of the differences from both has the error of neither in it.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;
use tweenray::film::Image;
use tweenray::import::{self, LoadOptions};
use tweenray::math::Rgb;
use tweenray::measure::psnr;
use tweenray::output::read_image;

/// The program in a folder of its own.
struct Place {
    folder: PathBuf,
    scene: PathBuf,
    size: String,
    frames: u32,
    threads: String,
    /// CPU seconds of a job with next to nothing to trace.
    idle: f64,
}

/// The references: where each lies, and its seed.
const TRUTHS: [(&str, u32); 2] = [("truth", 77), ("truth_too", 78)];

/// A setting of the sweep: CPU seconds, options, PSNR of every frame.
type Swept = (f64, String, Vec<f64>);

fn var<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

impl Place {
    fn of(scene: &str, folder: &Path) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let scene_file = match scene.ends_with(".toml") {
            true => root.join(scene),
            false => root.join("scenes").join(scene).join("scene.toml"),
        };
        let loaded = import::load(&scene_file, &LoadOptions::default()).expect("a scene");
        let (width, height) = (loaded.settings.width, loaded.settings.height);
        let pixels: f64 = var("PIXELS", 12_000.0);
        let scale = (pixels / (f64::from(width) * f64::from(height))).sqrt();
        let edge = |length: u32| (f64::from(length) * scale).round();
        let mut place = Self {
            folder: folder.join(scene.replace('/', "_")),
            scene: scene_file,
            size: "4x4".into(),
            frames: loaded.shot.frames,
            threads: var("THREADS", "2".into()),
            idle: 0.0,
        };
        std::fs::create_dir_all(&place.folder).expect("a folder");
        place.idle = place.render("idle", "--frames 1 --spp 1 --overwrite").0;
        place.size = format!("{}x{}", edge(width), edge(height));
        place
    }

    /// Renders with `options`: CPU seconds of the program, which others on the machine change less than
    /// those of the clock, and what was said.
    fn render(&self, name: &str, options: &str) -> (f64, String) {
        let folder = self.folder.join(name);
        let mut command = Command::new(var("PROGRAM", env!("CARGO_BIN_EXE_tweenray").to_string()));
        command.arg("render").arg(&self.scene).arg("--no-video");
        command.args(["--size", &self.size, "--threads", &self.threads]);
        command.arg("-o").arg(folder.join("f_##.png"));
        let before = children_cpu();
        let ran = command.args(options.split_whitespace()).output().expect("the program starts");
        let seconds = children_cpu() - before;
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(ran.status.success(), "{options}: {said}");
        (seconds, said)
    }

    /// CPU seconds of a job with `options`, that of loading and building the scene left aside.
    fn tracing(&self, name: &str, options: &str) -> f64 {
        self.render(name, &format!("{options} --overwrite")).0 - self.idle
    }

    /// PSNR of every frame, dB.
    fn psnr(&self, name: &str) -> Vec<f64> {
        let read = |name: &str, frame: u32| {
            let file = self.folder.join(name).join(format!("f_{frame:02}.png"));
            read_image(file).expect("a frame")
        };
        let truths = |frame| TRUTHS.map(|(name, _)| read(name, frame));
        (1..=self.frames).map(|f| psnr(squared_error(&truths(f), &read(name, f)))).collect()
    }

    /// The references, made once.
    fn truth(&self) {
        let made = self.folder.join(format!("truths_{}", self.size));
        if made.exists() {
            return;
        }
        let spp: u32 = var("SPP", 256);
        for (name, seed) in TRUTHS {
            let truth = format!(
                "--spp {spp} --shadow-samples 8 --sky-samples 2 --bounces 16 --cutoff 1e-5 \
                 --policy off --png-bits 16 --seed {seed} --overwrite"
            );
            self.render(name, &truth);
        }
        std::fs::write(made, "").expect("a file");
    }

    /// A setting, rendered once: what it took and how far each frame is off.
    fn swept(&self, known: &mut Vec<Swept>, options: &str) -> Swept {
        if let Some(swept) = known.iter().find(|swept| swept.1 == options) {
            return swept.clone();
        }
        let seconds = self.tracing("swept", options);
        known.push((seconds, options.into(), self.psnr("swept")));
        known.last().expect("one").clone()
    }

    /// The settings of a sweep that may be fastest to bring 19 of 20 frames to `wanted`: for each number
    /// of shadow and sky samples, and with reuse and without, the fewest camera samples that do, unless
    /// they take longer than `most` seconds. More of them take longer, so these are all.
    fn rivals(&self, wanted: f64, most: f64) -> Vec<Swept> {
        let file = self.folder.join(format!("sweep_{}.json", self.size));
        let kept = std::fs::read(&file).ok();
        let mut known =
            kept.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
        let mut rivals = Vec::new();
        for lights in var("LIGHTS", "1 2 4 16".to_string()).split_whitespace() {
            for policy in ["off", "surface"] {
                let mut predicted = 0.0;
                for spp in [1, 2, 4, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256] {
                    if predicted * f64::from(spp) > 1.2 * most {
                        break;
                    }
                    let options = format!(
                        "--spp {spp} --shadow-samples {lights} --sky-samples {lights} \
                         --policy {policy}"
                    );
                    let swept = self.swept(&mut known, &options);
                    predicted = swept.0 / f64::from(spp);
                    let text = serde_json::to_vec(&known).expect("JSON");
                    std::fs::write(&file, text).expect("a file");
                    if reached(&swept.2, wanted) as f64 >= 0.95 * swept.2.len() as f64 {
                        rivals.push(swept);
                        break;
                    }
                }
            }
        }
        rivals
    }

    /// The shortest time of two turns of each of `options`.
    fn contest(&self, options: &[&str]) -> Vec<f64> {
        let mut seconds = vec![f64::INFINITY; options.len()];
        for _ in 0..2 {
            for (options, seconds) in options.iter().zip(&mut seconds) {
                *seconds = seconds.min(self.tracing("contest", options));
            }
        }
        seconds
    }
}

/// The squared error of `image` without that of the `truths`.
fn squared_error(truths: &[Image; 2], image: &Image) -> f64 {
    let [a, b] = truths;
    let all = image.rgb.iter().zip(a.rgb.iter().zip(&b.rgb));
    let product = |(x, (a, b)): (&Rgb, (&Rgb, &Rgb))| {
        let [a, b] = [*x - *a, *x - *b].map(|apart| apart.as_dvec3());
        a.dot(b) / 3.0
    };
    let sum: f64 = all.map(product).sum();
    // Next to no error may come out as less than none.
    (sum / image.rgb.len() as f64).max(1e-12)
}

/// CPU seconds of all programs that this one ran, in hundredths; Linux tells them.
fn children_cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    let fields = text.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace();
    // User and system time of children that ended (proc(5), fields 16 and 17).
    fields.skip(13).take(2).map(|ticks| ticks.parse::<f64>().expect("a number")).sum::<f64>()
        / 100.0
}

fn reached(frames: &[f64], target: f64) -> usize {
    frames.iter().filter(|psnr| **psnr >= target).count()
}

/// The last line of what was said that holds `what`.
fn line(said: &str, what: &str) -> String {
    said.lines().rfind(|line| line.contains(what)).unwrap_or_default().to_string()
}

fn main() {
    support::title("target");
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = var("KEEP", temporary.path().to_path_buf());
    let scenes = var("SCENE", "cornell demo reflective_spheres spheres_on_terrain".to_string());
    let targets = var("TARGETS", "40 45 50".to_string());
    for scene in scenes.split_whitespace() {
        let place = Place::of(scene, &folder);
        let seconds = support::seconds(|| run(scene, &place, &targets));
        println!("({seconds:.0} s; load average {})", support::load_average());
    }
}

fn run(scene: &str, place: &Place, targets: &str) {
    let mut rows = Vec::new();
    for target in targets.split_whitespace() {
        match target {
            "budget" => budget(scene, place),
            _ => rows.push(row(scene, place, target)),
        }
    }
    let heads =
        ["scene", "dB", "reached", "worst", "time", "over swept", "again", "chosen", "swept"];
    if !rows.is_empty() {
        support::table(&heads, &rows);
    }
}

fn row(scene: &str, place: &Place, target: &str) -> Vec<String> {
    place.truth();
    let (_, said) = place.render("chosen", &format!("--target psnr={target} --overwrite"));
    let wanted: f64 = target.parse().expect("a PSNR");
    let frames = place.psnr("chosen");
    let chosen = line(&said, ": --spp");
    let chosen = chosen.split_once(": ").map_or("", |(_, options)| options);
    let mut best = place.rivals(wanted, place.tracing("contest", chosen));
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Times that were kept are of another hour: the two fastest run again, in turns with the choice.
    let rivals: Vec<&str> = best.iter().take(2).map(|(_, options, _)| options.as_str()).collect();
    let seconds = place.contest(&[&[chosen][..], &rivals].concat());
    let fastest = seconds[1..].iter().copied().fold(f64::INFINITY, f64::min);
    println!(
        "{}\n{}\n{}",
        line(&said, "predicted:"),
        line(&said, "came out"),
        line(&said, "probe t")
    );
    vec![
        scene.into(),
        target.into(),
        format!("{}/{}", reached(&frames, wanted), frames.len()),
        format!("{:.1}", support::quantile(&frames, 0.0)),
        format!("{:.2} s", seconds[0]),
        if rivals.is_empty() { "-".into() } else { format!("{:.2}", seconds[0] / fastest) },
        said.matches("tightened").count().to_string(),
        chosen.into(),
        rivals.first().map_or("-", |options| options).into(),
    ]
}

/// A budget of half the default's time, all included; and the same by CPU time, which other programs on
/// the machine change less.
fn budget(scene: &str, place: &Place) {
    let ((default_cpu, _), default) = support::timed(|| place.render("default", "--overwrite"));
    let half = (0.5 * default).round().max(1.0);
    let options = format!("--budget {half}s --overwrite");
    let ((cpu, said), taken) = support::timed(|| place.render("within", &options));
    let off = |taken: f64, half: f64| 100.0 * (taken / half - 1.0);
    println!(
        "{scene}: default {default:.1} s; budget {half} s, took {taken:.1} s ({:+.0} %); CPU \
         {default_cpu:.1} s and {cpu:.1} s, {:+.0} % off the half",
        off(taken, half),
        off(cpu, default_cpu * half / default)
    );
    for what in ["predicted:", "came out", "probe t"] {
        println!("{}", line(&said, what));
    }
}
