//! `render --target psnr=…`, as a user runs it: in how many frames it is reached against a converged
//! reference, and how much longer it takes than the fastest setting of a sweep that reaches it in as many
//! (95 %).
//!
//! `SCENE`, `TARGETS`, `SIZE`, `FRAMES`, `SPP` (of the reference) and `THREADS` change what is run.
#![allow(clippy::print_stdout, reason = "a bench prints its figures")]

mod support;

use std::path::{Path, PathBuf};
use std::process::Command;
use tweenray::measure::{mse, psnr};
use tweenray::output::read_image;

/// The program in a folder of its own.
struct Place {
    folder: tempfile::TempDir,
    scene: PathBuf,
    size: String,
    frames: u32,
    threads: String,
}

fn var<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

impl Place {
    /// Renders with `options`: seconds that rendering took, and what was said.
    fn render(&self, name: &str, options: &str) -> (f64, String) {
        let stats = self.folder.path().join("stats.json");
        let mut command = Command::new(env!("CARGO_BIN_EXE_tweenray"));
        command.arg("render").arg(&self.scene).arg("--no-video").arg("--stats").arg(&stats);
        command.args(["--size", &self.size, "--threads", &self.threads]);
        command.arg("--frames").arg(format!("1..{}", self.frames));
        command.arg("-o").arg(self.folder.path().join(name).join("f_##.png"));
        let ran = command.args(options.split_whitespace()).output().expect("the program starts");
        let said = String::from_utf8_lossy(&ran.stderr).into_owned();
        assert!(ran.status.success(), "{options}: {said}");
        let text = std::fs::read(stats).expect("statistics");
        let stats: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
        // Of the last round: frames that were rendered again are counted once.
        let frames = stats["frames"].as_array().expect("frames");
        let seconds = |f: &serde_json::Value| f["trace_seconds"].as_f64().expect("seconds");
        (frames.iter().map(seconds).sum(), said)
    }

    /// PSNR of every frame, dB.
    fn psnr(&self, name: &str) -> Vec<f64> {
        let read = |name: &str, frame: u32| {
            let file = self.folder.path().join(name).join(format!("f_{frame:02}.png"));
            read_image(file).expect("a frame")
        };
        (1..=self.frames).map(|f| psnr(mse(&read("truth", f), &read(name, f)))).collect()
    }
}

fn reached(frames: &[f64], target: f64) -> usize {
    frames.iter().filter(|psnr| **psnr >= target).count()
}

fn main() {
    support::title("target");
    let scenes = var("SCENE", "cornell demo reflective_spheres spheres_on_terrain".to_string());
    let targets = var("TARGETS", "40 45 50".to_string());
    for scene in scenes.split_whitespace() {
        let place = Place {
            folder: tempfile::tempdir().expect("a folder"),
            scene: Path::new(env!("CARGO_MANIFEST_DIR"))
                .join("scenes")
                .join(scene)
                .join("scene.toml"),
            size: var("SIZE", "128x72".into()),
            frames: var("FRAMES", 8),
            threads: var("THREADS", "2".into()),
        };
        let seconds = support::seconds(|| run(scene, &place, &targets));
        println!("({seconds:.0} s; load average {})", support::load_average());
    }
}

fn run(scene: &str, place: &Place, targets: &str) {
    let spp: u32 = var("SPP", 256);
    place.render(
        "truth",
        &format!(
            "--spp {spp} --shadow-samples 8 --sky-samples 8 --bounces 16 --cutoff 1e-5 \
             --policy off --png-bits 16 --seed 77"
        ),
    );
    let mut swept = Vec::new();
    for spp in [1, 2, 4, 8, 16, 32, 64] {
        for lights in [1, 4, 16] {
            for policy in ["off", "surface"] {
                let options = format!(
                    "--spp {spp} --shadow-samples {lights} --sky-samples {lights} --policy {policy}"
                );
                let (seconds, _) = place.render("swept", &(options.clone() + " --overwrite"));
                swept.push((seconds, options, place.psnr("swept")));
            }
        }
    }
    let mut rows = Vec::new();
    for target in targets.split_whitespace() {
        let (seconds, said) =
            place.render("chosen", &format!("--target psnr={target} --overwrite"));
        let wanted: f64 = target.parse().expect("a PSNR");
        let frames = place.psnr("chosen");
        let enough = |frames: &[f64]| reached(frames, wanted) as f64 >= 0.95 * frames.len() as f64;
        let best = swept.iter().filter(|(.., frames)| enough(frames));
        let best = best.min_by(|a, b| a.0.total_cmp(&b.0));
        let fastest = best.map_or("-".into(), |(s, options, _)| format!("{s:.2} s {options}"));
        let line = |start: &str| {
            let found = said.lines().rfind(|line| line.starts_with(start));
            found.unwrap_or_default().to_string()
        };
        rows.push(vec![
            scene.into(),
            target.into(),
            format!("{}/{}", reached(&frames, wanted), frames.len()),
            format!("{:.1}", support::quantile(&frames, 0.0)),
            format!("{seconds:.2} s"),
            best.map_or("-".into(), |(s, ..)| format!("{:.2}", seconds / s)),
            said.matches("tightened").count().to_string(),
            fastest,
        ]);
        println!("{}\n{}\n{}", line("for psnr"), line("came out"), line("the probe"));
    }
    support::table(
        &["scene", "dB", "reached", "worst", "time", "over swept", "again", "fastest swept"],
        &rows,
    );
}
