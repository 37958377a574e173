//! `tweenray accuracy`: what accuracy costs in time, on the user's own scene.

mod files;
mod page;

use super::args::{SceneArgs, SettingArgs};
use super::exit::Exit;
use super::progress::duration;
use super::signals::Interrupt;
use super::{job, say, values};
use crate::accuracy::{
    self, Candidate, Group, Heard, Measured, OracleCrop, Picture, Stage, Sweep, Truth,
};
use crate::cluster;
use crate::effects::EffectPlan;
use crate::error::{Error, Result, counted};
use crate::import::Loaded;
use crate::intersect;
use crate::output::atomic;
use crate::scene::limits::{MAX_SAMPLES, MAX_THREADS};
use crate::scene::{Scene, Settings};
use clap::Args;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::PathBuf;
use std::time::Instant;

/// Measure what accuracy costs in time: error against seconds for every setting that matters
///
/// Renders some frames of the move at a converged reference and at each setting of a sweep, several
/// times in turns, and writes a page (report.html, which opens from disk), accuracy.csv and
/// accuracy.json.
#[derive(Debug, Args)]
#[command(after_help = "\
Times are only as good as the machine is quiet: run nothing else beside it. A difference that is
smaller than its noise is called that. docs/accuracy.md says how to read the page.

A small --size, few --turns and fewer --knobs make a quick look of it.

Examples:
  tweenray accuracy scene.toml -o accuracy
  tweenray accuracy scene.toml -o quick --size 320x180 --turns 3 --knobs reuse,samples")]
pub struct AccuracyArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the page and the figures
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Frames to look at, as in 1,8,9 [default: the first, and two neighbours]
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..))]
    frames: Vec<u32>,
    /// How often each setting is timed; 6 and more give intervals of 95 %, fewer than 5 say nothing
    /// about small differences
    #[arg(long, value_name = "N", default_value_t = 6, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    turns: u32,
    /// Most camera samples of the reference, which doubles them until it no longer changes
    #[arg(long, value_name = "N", default_value_t = 1024, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(64..=i64::from(MAX_SAMPLES)))]
    reference_spp: u32,
    /// What is turned: reuse, samples, specular, intersection, oracle, combinations [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',',
        value_parser = values::choice::<Group>(&["reuse", "samples", "specular", "intersection", "oracle", "combinations"]))]
    knobs: Vec<Group>,
    /// Rendering threads [default: the cores this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_THREADS)))]
    threads: Option<u32>,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingArgs,
}

/// Everything that came out.
struct Outcome {
    base: Settings,
    truth: Truth,
    measured: Measured,
    pictures: Vec<Picture>,
    oracle: Option<OracleCrop>,
    oracle_was_wanted: bool,
    frames: Vec<u32>,
    shown_frame: u32,
    shot_frames: u32,
    threads: usize,
    tracer: String,
    /// Load of the machine over the last minute, before and after.
    load: [Option<f64>; 2],
    seconds: f64,
}

/// Runs the command.
pub fn run(args: &AccuracyArgs) -> Result<Exit> {
    let start = Instant::now();
    let interrupt = Interrupt::listen()?;
    let Loaded { world, shot, settings: base, warnings, .. } =
        job::load(&args.scene, &args.settings)?;
    if !args.quiet {
        warnings.iter().for_each(say::warning);
    }
    if base.crop.is_some() {
        let message = "accuracy looks at whole frames: what a crop leaves black would count as right\n  \
                       help: leave --crop out; a smaller --size is faster";
        return Err(Error::Usage(message.into()));
    }
    atomic::make_room(args.output.join("report.html"))?;
    let frames = frames(args, shot.frames)?;
    let groups = if args.knobs.is_empty() { Group::ALL.to_vec() } else { args.knobs.clone() };
    // Rounded twice, about the scene's own centre and not, where that is compared.
    let otherwise = groups.contains(&Group::Intersection).then(|| world.clone());
    let scene = world.into_scene(base.rules.recentre)?;
    let otherwise = otherwise.and_then(|world| world.into_scene(!base.rules.recentre).ok());
    let candidates = candidates(&scene, &base, shot.frames, &groups, otherwise.is_some());
    let threads = args.threads.map_or_else(cluster::default_threads, |n| n as usize);
    let pool = thread_pool(threads)?;
    let intersector = pool.install(|| intersect::build(&scene, &base, threads))?;
    let stage = Stage {
        scene: &scene,
        otherwise: otherwise.as_ref(),
        shot: &shot,
        base: &base,
        intersector: &*intersector,
        pool: &pool,
        stop: &interrupt.stop,
    };
    let load = super::machine::load();
    let sweep =
        Sweep { stage: &stage, candidates: &candidates, frames: &frames, turns: args.turns };
    // First: whoever is out of patience loses no sweep.
    let oracle = match groups.contains(&Group::Oracle) {
        true => {
            if !args.quiet {
                say::aside("the oracle, on a crop");
            }
            interrupt.watched(|| accuracy::on_a_crop(&stage, sweep.shown_frame()))?
        }
        false => None,
    };
    let (truth, measured, pictures) = interrupt.watched(|| measure(args, &sweep))?;
    let outcome = Outcome {
        truth,
        measured,
        pictures,
        oracle,
        oracle_was_wanted: groups.contains(&Group::Oracle),
        shown_frame: sweep.shown_frame(),
        frames: frames.clone(),
        shot_frames: shot.frames,
        threads,
        tracer: intersector.describe(),
        load: [load, super::machine::load()],
        seconds: start.elapsed().as_secs_f64(),
        base: base.clone(),
    };
    finish(args, &outcome)
}

fn thread_pool(threads: usize) -> Result<ThreadPool> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| Error::Failed(format!("cannot start {threads} threads: {e}")))
}

fn frames(args: &AccuracyArgs, count: u32) -> Result<Vec<u32>> {
    if args.frames.is_empty() {
        return Ok(accuracy::chosen_frames(count));
    }
    let mut frames = args.frames.clone();
    frames.sort_unstable();
    frames.dedup();
    match frames.iter().find(|f| **f > count) {
        Some(frame) => Err(Error::Usage(format!(
            "frame {frame} lies outside the shot, which has frames 1..{count}"
        ))),
        None => Ok(frames),
    }
}

/// Without the other rounding of the scene, the candidate that needs it is left out: some scenes
/// cannot be rounded where they stand.
fn candidates(
    scene: &Scene,
    base: &Settings,
    frames: u32,
    groups: &[Group],
    otherwise: bool,
) -> Vec<Candidate> {
    let mut all = accuracy::candidates(base, &EffectPlan::of(scene, base), frames, groups);
    all.retain(|c| otherwise || c.settings.rules.recentre == base.rules.recentre);
    all
}

fn measure(args: &AccuracyArgs, sweep: &Sweep) -> Result<(Truth, Measured, Vec<Picture>)> {
    let tell = |text: String| {
        if !args.quiet {
            say::aside(text);
        }
    };
    let trials = sweep.candidates.len() * (args.turns as usize + 1);
    tell(format!(
        "{} on {}, {}",
        counted(sweep.candidates.len(), "setting"),
        counted(sweep.frames.len(), "frame"),
        counted(trials, "trial")
    ));
    let wanted = sweep.least_noise()? / 4.0;
    let settings: Vec<&Settings> = sweep.candidates.iter().map(|c| &c.settings).collect();
    let settings = accuracy::truth_settings(sweep.stage.base, &settings);
    let heard = |spp: u32, change: Option<f64>| {
        let change = change.map_or(String::new(), |change| {
            format!(", {change:.3}/255 away from half as many; wanted {wanted:.3}")
        });
        tell(format!("reference: {spp} camera samples{change}"));
    };
    let truth = accuracy::converge(
        sweep.stage,
        settings,
        sweep.frames,
        wanted,
        args.reference_spp,
        &heard,
    )?;
    let start = Instant::now();
    let mut heard = |h: Heard| {
        let Heard { done, of, turn, candidate } = h;
        let left = match done {
            0 => String::new(),
            n => {
                let each = start.elapsed().as_secs_f64() / n as f64;
                format!("  left {}", duration(each * (of - n) as f64))
            }
        };
        let name = page::name_of(&candidate.options);
        let turn = if turn == 0 { "warm-up".into() } else { format!("turn {turn}") };
        tell(format!("{} of {of}  {turn}  {name}{left}", done + 1));
    };
    let (measured, pictures) = sweep.run(&truth, &mut heard)?;
    Ok((truth, measured, pictures))
}

fn finish(args: &AccuracyArgs, outcome: &Outcome) -> Result<Exit> {
    let command = super::words();
    files::write(&args.output, args, outcome, &command)?;
    let page = page::page(args, outcome, &command)?;
    let out = args.output.join("report.html");
    let html = page.to_html()?;
    atomic::write(&out, |w| w.write_all(html.as_bytes()))?;
    if !args.quiet {
        page.summary.iter().chain(&page.warnings).try_for_each(say::result)?;
        say::result(format!("{}, in {}", out.display(), duration(outcome.seconds)))?;
    }
    Ok(Exit::Done)
}
