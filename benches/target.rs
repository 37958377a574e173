//! `render --target` and `--budget`, as a user runs them: in how many frames a target is reached against
//! a converged reference, how much longer it takes than the fastest setting of a sweep that reaches it
//! in 95 % of them, and how near a budget of half the default's time is kept.
//!
//! `SCENE` (names under scenes/, or scene files, as those of `./x zoo`), `TARGETS` (dB, or `budget`),
//! `PIXELS`, `SPP` (of each reference), `LIGHTS` (shadow and sky samples of the sweep) and `THREADS` change
//! what is run, `PROGRAM` which program. With `KEEP`, a folder, references and sweeps are made once and read
//! again. `ZOO="SEED FIRST..LAST"` takes these scenes of the zoo in place of `SCENE`, with moves of `FRAMES`
//! frames. At the end, how many frames of all reach their target and how much time it takes.
//!
//! The probe of a job of seconds takes longer than the job. So its share is that of a job of a minute (`LONG`
//! seconds; with 0 it is left out): the same command for frames so large that they take that long, stopped when the
//! choice is made.
//!
//! A reference of four times the samples still has some tenth of the squared error, enough for a frame
//! at a target's edge to be counted as missed. So there are two with other seeds: the mean of the product
//! of the differences from both has the error of neither in it.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

#[path = "../examples/zoo/making/mod.rs"]
#[allow(dead_code, unused_imports, reason = "only the zoo itself takes all of it")]
mod making;
mod support;

use making::Specimen;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tweenray::film::Image;
use tweenray::import::{self, LoadOptions};
use tweenray::math::Rgb;
use tweenray::measure::psnr;
use tweenray::output::read_image;

/// The program in a folder of its own.
struct Place {
    folder: PathBuf,
    scene: PathBuf,
    /// Edges of the scene's frames as its file has them, and what they are multiplied with.
    edges: [u32; 2],
    scale: f64,
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
        let mut place = Self {
            folder: folder.join(scene.replace('/', "_")),
            scene: scene_file,
            edges: [width, height],
            scale: (pixels / (f64::from(width) * f64::from(height))).sqrt(),
            size: "4x4".into(),
            frames: loaded.shot.frames,
            threads: var("THREADS", "2".into()),
            idle: 0.0,
        };
        std::fs::create_dir_all(&place.folder).expect("a folder");
        place.idle = place.render("idle", "--frames 1 --spp 1 --overwrite").0;
        place.size = place.times(1.0);
        place
    }

    /// The size of frames with `factor` times as many pixels.
    fn times(&self, factor: f64) -> String {
        let edge = |length: u32| (f64::from(length) * self.scale * factor.sqrt()).round();
        let [width, height] = self.edges.map(edge);
        format!("{width}x{height}")
    }

    fn command(&self, name: &str, size: &str, options: &str) -> Command {
        let folder = self.folder.join(name);
        let mut command = Command::new(var("PROGRAM", env!("CARGO_BIN_EXE_tweenray").to_string()));
        command.arg("render").arg(&self.scene).arg("--no-video");
        command.args(["--size", size, "--threads", &self.threads]);
        command.arg("-o").arg(folder.join("f_##.png")).args(options.split_whitespace());
        command
    }

    /// Renders with `options`: CPU seconds of the program, which others on the machine change less than
    /// those of the clock, and what was said.
    fn render(&self, name: &str, options: &str) -> (f64, String) {
        self.try_render(name, options).unwrap_or_else(|said| panic!("{options}: {said}"))
    }

    /// The same; what was said where the program fails.
    fn try_render(&self, name: &str, options: &str) -> Result<(f64, String), String> {
        let before = children_cpu();
        let ran = self.command(name, &self.size, options).output().expect("the program starts");
        let seconds = children_cpu() - before;
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        if ran.status.success() { Ok((seconds, said)) } else { Err(said) }
    }

    /// CPU seconds of a job with `options`, that of loading and building the scene left aside.
    fn tracing(&self, name: &str, options: &str) -> f64 {
        self.render(name, &format!("{options} --overwrite")).0 - self.idle
    }

    /// The share that the probe has of a job whose rendering takes `LONG` seconds, where that of this size takes
    /// `seconds`: by the clock, of the time predicted. `None` where `LONG` is 0.
    fn share_of_probe(&self, target: &str, seconds: f64) -> Option<f64> {
        let long = var("LONG", 60.0);
        if long <= 0.0 {
            return None;
        }
        let size = self.times((long / seconds).max(1.0));
        let options = format!("--target psnr={target} --overwrite");
        let mut command = self.command("long", &size, &options);
        let mut program = command.stderr(Stdio::piped()).spawn().expect("the program starts");
        let (mut probe, mut rendering) = (f64::NAN, f64::NAN);
        for line in BufReader::new(program.stderr.take().expect("a pipe")).lines() {
            let line = line.expect("text");
            if let Some((_, words)) = line.split_once("a frame, ") {
                rendering = read_seconds(words);
            }
            if let Some((_, words)) = line.split_once("the probe took ") {
                probe = read_seconds(words);
                break;
            }
        }
        // It may have ended by itself, for a target out of reach.
        let _ = program.kill();
        program.wait().expect("an end");
        Some(probe / rendering)
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
    /// they take longer than `most` seconds or than a rival. More of them take longer, so these are all.
    fn rivals(&self, wanted: f64, mut most: f64) -> Vec<Swept> {
        let file = self.folder.join(format!("sweep_{}.json", self.size));
        let kept = std::fs::read(&file).ok();
        let mut known: Vec<Swept> =
            kept.and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
        let mut rivals = Vec::new();
        for lights in var("LIGHTS", "1 2 4 16".to_string()).split_whitespace() {
            for policy in ["off", "surface"] {
                let mut predicted = 0.0;
                for spp in [1, 2, 4, 8, 16, 24, 32, 48, 64, 96, 128, 192, 256] {
                    let options = format!(
                        "--spp {spp} --shadow-samples {lights} --sky-samples {lights} \
                         --policy {policy}"
                    );
                    // What an earlier run swept is there to be compared with.
                    let is_known = known.iter().any(|swept| swept.1 == options);
                    if !is_known && predicted * f64::from(spp) > 1.2 * most {
                        break;
                    }
                    let swept = self.swept(&mut known, &options);
                    predicted = swept.0 / f64::from(spp);
                    let text = serde_json::to_vec(&known).expect("JSON");
                    std::fs::write(&file, text).expect("a file");
                    if reached(&swept.2, wanted) as f64 >= 0.95 * swept.2.len() as f64 {
                        most = most.min(swept.0);
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

/// The seconds in words such as `2 min 41 s, 20 % more`.
fn read_seconds(words: &str) -> f64 {
    let words: Vec<&str> = words.split([' ', ',']).collect();
    let unit = |unit: &str| {
        [("ms", 1e-3), ("s", 1.0), ("min", 60.0), ("h", 3600.0)]
            .iter()
            .find_map(|(name, seconds)| (*name == unit).then_some(*seconds))
    };
    let pairs =
        words.chunks_exact(2).map_while(|pair| Some(pair[0].parse::<f64>().ok()? * unit(pair[1])?));
    pairs.sum()
}

/// The last line of what was said that holds `what`.
fn line(said: &str, what: &str) -> String {
    said.lines().rfind(|line| line.contains(what)).unwrap_or_default().to_string()
}

/// A scene's name in the tables, and its file.
type Named = (String, String);

/// The scenes of `ZOO`, written to `folder`.
fn zoo(folder: &Path, wanted: &str) -> Vec<Named> {
    let words: Vec<u64> = wanted.split([' ', '.']).filter_map(|word| word.parse().ok()).collect();
    let [seed, first, last] = words[..] else { panic!("ZOO=\"SEED FIRST..LAST\", not {wanted:?}") };
    let write = |index| {
        let specimen = Specimen::new(seed, index, var("FRAMES", 8));
        let folder = folder.join(format!("zoo_{seed}_{index}"));
        specimen.write(&folder, "move.toml", &specimen.poses, 1).expect("a scene");
        let name = format!("{} ({index})", specimen.name);
        (name, folder.join("move.toml").to_string_lossy().into_owned())
    };
    (first..=last).map(write).collect()
}

/// A target of a scene and what came of it.
struct Outcome {
    target: String,
    /// PSNR of every frame, dB.
    frames: Vec<f64>,
    reached: usize,
    /// CPU seconds of what was chosen, with what was rendered before it was tightened.
    seconds: f64,
    /// These over those of the fastest swept, if any reached the target.
    ratio: Option<f64>,
    /// The probe's share of a job of `LONG` seconds, if that was measured.
    probe: Option<f64>,
    tightened: usize,
    chosen: String,
    swept: String,
}

impl Outcome {
    const HEADS: [&'static str; 11] = [
        "scene",
        "dB",
        "reached",
        "worst",
        "time",
        "over swept",
        "probe",
        "with probe",
        "again",
        "chosen",
        "swept",
    ];

    /// Time over that of the fastest swept in a job of `LONG` seconds, the probe's included.
    fn with_probe(&self) -> Option<f64> {
        Some(self.ratio? * (1.0 + self.probe?))
    }

    fn cells(&self, scene: &str) -> Vec<String> {
        let or_none = |ratio: Option<f64>| ratio.map_or("-".into(), |ratio| format!("{ratio:.2}"));
        vec![
            scene.into(),
            self.target.clone(),
            format!("{}/{}", self.reached, self.frames.len()),
            format!("{:.1}", support::quantile(&self.frames, 0.0)),
            format!("{:.2} s", self.seconds),
            or_none(self.ratio),
            or_none(self.probe),
            or_none(self.with_probe()),
            self.tightened.to_string(),
            self.chosen.clone(),
            self.swept.clone(),
        ]
    }
}

fn main() {
    support::title("target");
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = var("KEEP", temporary.path().to_path_buf());
    let scenes = var("SCENE", "cornell demo reflective_spheres spheres_on_terrain".to_string());
    let scenes = match std::env::var("ZOO") {
        Ok(wanted) => zoo(&folder, &wanted),
        Err(_) => scenes.split_whitespace().map(|scene| (scene.into(), scene.into())).collect(),
    };
    let targets = var("TARGETS", "40 45 50".to_string());
    let mut all = Vec::new();
    for (name, scene) in &scenes {
        let place = Place::of(scene, &folder);
        let seconds = support::seconds(|| all.extend(run(name, &place, &targets)));
        println!("({seconds:.0} s; load average {})", support::load_average());
    }
    summary(&all);
}

fn run(scene: &str, place: &Place, targets: &str) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for target in targets.split_whitespace() {
        match target {
            "budget" => budget(scene, place),
            _ => outcomes.extend(outcome(place, target)),
        }
    }
    if !outcomes.is_empty() {
        let rows: Vec<_> = outcomes.iter().map(|outcome| outcome.cells(scene)).collect();
        support::table(&Outcome::HEADS, &rows);
    }
    outcomes
}

fn summary(all: &[Outcome]) {
    let sum = |of: fn(&Outcome) -> usize| all.iter().map(of).sum::<usize>();
    let (reached, frames) = (sum(|o| o.reached), sum(|o| o.frames.len()));
    println!(
        "all: {reached} of {frames} frames reach their target ({:.1} %)",
        100.0 * reached as f64 / frames.max(1) as f64
    );
    let figures = [
        ("time over the fastest swept", all.iter().filter_map(|o| o.ratio).collect::<Vec<_>>()),
        ("the probe's share of a job of a minute", all.iter().filter_map(|o| o.probe).collect()),
        ("both", all.iter().filter_map(Outcome::with_probe).collect()),
    ];
    for (what, figures) in figures.iter().filter(|(_, figures)| !figures.is_empty()) {
        let [median, most] = [0.5, 1.0].map(|q| support::quantile(figures, q));
        println!("{what}: median {median:.2}, worst {most:.2}, of {}", figures.len());
    }
}

/// What came of `target`; `None` where it is refused.
fn outcome(place: &Place, target: &str) -> Option<Outcome> {
    place.truth();
    let options = format!("--target psnr={target} --overwrite");
    let said = match place.try_render("chosen", &options) {
        Ok((_, said)) => said,
        Err(said) => {
            println!("{target} dB is refused: {said}");
            return None;
        }
    };
    let wanted: f64 = target.parse().expect("a PSNR");
    let frames = place.psnr("chosen");
    let choices = said.lines().filter(|line| line.contains(": --spp"));
    let choices: Vec<&str> = choices.filter_map(|line| Some(line.split_once(": ")?.1)).collect();
    let (chosen, before) = choices.split_last().expect("a choice");
    let before: f64 = before.iter().map(|options| place.tracing("contest", options)).sum();
    let mut best = place.rivals(wanted, place.tracing("contest", chosen));
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Times that were kept are of another hour: the two fastest run again, in turns with the choice.
    let rivals: Vec<&str> = best.iter().take(2).map(|(_, options, _)| options.as_str()).collect();
    let seconds = place.contest(&[&[*chosen][..], &rivals].concat());
    let fastest = seconds[1..].iter().copied().fold(f64::INFINITY, f64::min);
    println!("{}\n{}", line(&said, "predicted:"), line(&said, "came out"));
    let taken = before + seconds[0];
    Some(Outcome {
        target: target.into(),
        reached: reached(&frames, wanted),
        frames,
        seconds: taken,
        ratio: fastest.is_finite().then_some(taken / fastest),
        probe: place.share_of_probe(target, seconds[0]),
        tightened: choices.len() - 1,
        chosen: (*chosen).into(),
        swept: rivals.first().map_or("-", |options| options).into(),
    })
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
