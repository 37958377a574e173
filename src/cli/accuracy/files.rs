//! The figures for other programs: JSON and CSV.

use super::{AccuracyArgs, Outcome};
use crate::accuracy::{CandidateRow, OracleCrop, Writing};
use crate::cli::machine::Machine;
use crate::error::Result;
use crate::measure::Median;
use crate::output::atomic;
use crate::output::manifest::Header;
use crate::page::accuracy::KnobText;
use crate::stats::RayKind;
use serde::Serialize;
use serde_json::Value;

#[derive(Serialize)]
struct Document<'a> {
    tweenray: &'a str,
    command: &'a [String],
    scene: String,
    tracer: &'a str,
    machine: Machine,
    threads: usize,
    /// Load of the machine over a minute, before and after.
    load: [Option<f64>; 2],
    frames: &'a [u32],
    shot_frames: u32,
    turns: u32,
    /// Number of finished trials, and of all trials; they differ if the sweep was stopped.
    trials: [usize; 2],
    /// Runs of the program that measured them.
    runs: u32,
    default: Value,
    reference: Reference,
    /// Path of the denoiser's program and hash of its file, if frames were denoised.
    denoiser: Option<&'a str>,
    rows: &'a [CandidateRow],
    oracle: Option<OracleCrop>,
    writing: Option<Writing>,
    /// The page's sentences about each group of options.
    knobs: Vec<KnobText>,
}

#[derive(Serialize)]
struct Reference {
    settings: Value,
    /// Change by the last doubling, and the goal for it, display steps.
    change: f64,
    wanted: f64,
}

/// Writes `accuracy.json` and `accuracy.csv` beside the page.
pub fn write(args: &AccuracyArgs, outcome: &Outcome, command: &[String]) -> Result<()> {
    let (folder, truth) = (&args.output, outcome.truth);
    let document = Document {
        tweenray: crate::output::VERSION,
        command,
        scene: args.scene.scene.display().to_string(),
        tracer: &outcome.tracer,
        machine: Machine::here(),
        threads: outcome.threads,
        load: outcome.load,
        frames: outcome.frames,
        shot_frames: outcome.shot_frames,
        turns: args.turns,
        trials: outcome.trials,
        runs: outcome.runs,
        default: Header::settings(outcome.base),
        reference: Reference {
            settings: Header::settings(&truth.settings),
            change: truth.change,
            wanted: truth.wanted,
        },
        denoiser: outcome.denoiser.as_deref(),
        rows: &outcome.measured.rows,
        oracle: outcome.oracle,
        writing: outcome.writing,
        knobs: super::page::knobs(outcome),
    };
    atomic::write_json(&folder.join("accuracy.json"), &document)?;
    let csv = csv(&outcome.measured.rows);
    atomic::write(folder.join("accuracy.csv"), |w| w.write_all(csv.as_bytes())).map(drop)
}

/// Columns of the CSV, as in the page's tables, up to the rays of a turn by kind.
const BEFORE_RAYS: &str = "knob,options,seconds,seconds_low,seconds_high,cpu_seconds,cpu_seconds_low,\
    cpu_seconds_high,time_ratio,time_ratio_low,time_ratio_high,cpu_ratio,cpu_ratio_low,cpu_ratio_high,confidence,mse,rmse_steps,psnr,ssim,flip,share_over_2,flicker,\
    error_ratio,error_ratio_low,error_ratio_high,pixels_over_2_from_default,rays_per_frame,camera_samples";
/// The columns after those.
const AFTER_RAYS: &str = "build_seconds,memory_bytes,on_front,on_cpu_front";

fn csv(rows: &[CandidateRow]) -> String {
    let rays = RayKind::ALL.map(|kind| format!("rays_{}", kind.key())).join(",");
    let head = format!("{BEFORE_RAYS},{rays},{AFTER_RAYS}\n");
    head + &rows.iter().map(line).collect::<String>()
}

fn line(row: &CandidateRow) -> String {
    // No option holds a comma or a quote.
    let number = |x: f64| if x.is_finite() { x.to_string() } else { String::new() };
    let ends = |m: &Median| [m.interval.estimate, m.interval.low, m.interval.high].map(number);
    let ratio = |m: &Option<Median>| m.as_ref().map_or_else(Default::default, ends);
    let knob = serde_json::to_value(row.knob).unwrap_or_default();
    let mut cells = vec![knob.as_str().unwrap_or_default().to_string(), row.options.clone()];
    cells.extend(ends(&row.seconds.median));
    cells.extend(ends(&row.cpu_seconds.median));
    cells.extend(ratio(&row.time_ratio));
    cells.extend(ratio(&row.cpu_ratio));
    cells.push(number(row.seconds.median.confidence));
    let e = &row.errors;
    cells.extend([e.mse, e.rmse_steps, e.psnr, e.ssim, e.flip, e.share_over_2].map(number));
    cells.push(e.flicker.map_or(String::new(), number));
    cells.extend(ratio(&row.error_ratio));
    cells.push(row.change.map_or(String::new(), |c| c.over_2.to_string()));
    cells.push(number(row.rays_per_frame));
    // Empty where all pixels take as many.
    cells.push(row.camera_samples.map_or(String::new(), number));
    cells.extend(RayKind::ALL.map(|kind| row.rays[kind].to_string()));
    cells.push(number(row.build_seconds.median.interval.estimate));
    cells.push(row.memory_bytes.to_string());
    cells.push(row.on_front.to_string());
    cells.push(row.on_cpu_front.to_string());
    cells.join(",") + "\n"
}
