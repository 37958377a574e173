//! `tweenray accuracy`: what accuracy costs in time, on the user's own scene.

mod files;
mod given;
mod line;
mod measure;
mod page;

use super::args::{SceneArgs, SettingArgs, whole};
use super::exit::Exit;
use super::signals::Interrupt;
use super::{job, machine, say, values};
use crate::accuracy::{
    self, Candidate, CandidatePicture, Denoiser, Group, Ledger, Measured, OracleCrop, Sweep,
    TrialContext, Truth, Writing,
};
use crate::cluster;
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::import::Loaded;
use crate::intersect;
use crate::output::atomic;
use crate::output::manifest::Header;
use crate::reuse;
use crate::scene::limits::{MAX_SAMPLES, MAX_THREADS};
use crate::scene::{FrameRange, Scene, Settings};
use crate::sequence::fingerprint;
use clap::Args;
use measure::SweepJob;
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Measure what accuracy costs in time: error against seconds for every setting that matters
///
/// Renders some frames of the move as a converged reference and at each setting of a sweep, several
/// times in turns, and writes a page (report.html, which opens from disk), accuracy.csv and
/// accuracy.json. Each trial is saved in the folder's sweep/: the same command resumes a sweep that was
/// stopped, and more --turns extend one that is complete.
#[derive(Debug, Args)]
#[command(after_help = "\
Run nothing else on the machine meanwhile, since other work disturbs the times. Differences within
their noise are called noise. docs/accuracy.md explains the page.

A small --size, few --turns and fewer --knobs give a quick overview.

Examples:
  tweenray accuracy scene.toml -o accuracy
  tweenray accuracy scene.toml -o quick --size 320x180 --turns 3 --knobs reuse,samples")]
pub struct AccuracyArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Folder for the page and the figures
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Frames to look at, as in 1,8,9 [default: pairs at the start, the
    /// middle and the end]
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..))]
    frames: Vec<u32>,
    /// How often each setting is timed; 6 and more give intervals of 95 %, fewer than 5 say nothing
    /// about small differences
    #[arg(long, value_name = "N", default_value_t = 6, allow_negative_numbers = true,
        value_parser = whole(1, 1000))]
    turns: u32,
    /// Most camera samples of a pixel of the reference, which doubles them until it no longer changes
    #[arg(long, value_name = "N", default_value_t = 1024, allow_negative_numbers = true,
        value_parser = whole(64, MAX_SAMPLES))]
    reference_spp: u32,
    /// Options to vary: reuse, samples, specular, intersection, tree, oracle, writing, combinations, denoiser
    /// [default: all]
    #[arg(long, value_name = "LIST", value_delimiter = ',',
        value_parser = values::choice::<Group>(&["reuse", "samples", "specular", "intersection", "tree", "oracle", "writing", "combinations", "denoiser"]))]
    knobs: Vec<Group>,
    /// Program oidnDenoise of Intel Open Image Denoise, which frames of few samples are denoised with
    /// [default: oidnDenoise, if it is installed]
    #[arg(long, value_name = "PROGRAM")]
    denoiser: Option<PathBuf>,
    /// Measure everything anew, whatever the folder holds
    #[arg(long)]
    overwrite: bool,
    /// Stop after this long and exit with code 75, with the page of the results so far: 25m, 1h30m, or as
    /// Slurm writes it: 30 (minutes), 00:30:00, 1-12. In a Slurm job at the latest 30 s before its end
    #[arg(long, value_name = "TIME", value_parser = values::time_limit)]
    time_limit: Option<Duration>,
    /// Rendering threads [default: the cores this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole(1, MAX_THREADS))]
    threads: Option<u32>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    settings: SettingArgs,
}

/// The results of a sweep so far.
struct Outcome<'a> {
    base: &'a Settings,
    /// The effects that the scene needs.
    plan: EffectPlan,
    truth: &'a Truth,
    measured: Measured,
    pictures: Vec<CandidatePicture>,
    oracle: Option<OracleCrop>,
    oracle_was_wanted: bool,
    /// The denoiser that frames were given to.
    denoiser: Option<String>,
    lacks_denoiser: bool,
    writing: Option<Writing>,
    frames: &'a [u32],
    shown_frame: u32,
    shot_frames: u32,
    /// Turns that were asked for.
    turns: u32,
    threads: usize,
    tracer: String,
    /// Load of the machine over the last minute, before and after.
    load: [Option<f64>; 2],
    /// Wall seconds of this run of the program; `None` if it only read results of earlier runs.
    seconds: Option<f64>,
    /// Number of runs of the program that measured.
    runs: u32,
    /// Number of finished trials, and of all trials.
    trials: [usize; 2],
    /// Number of settings to compare.
    settings: usize,
}

/// Runs the command.
pub fn run(args: &AccuracyArgs) -> Result<Exit> {
    let start = Instant::now();
    let interrupt = Interrupt::new();
    interrupt.listen(true)?;
    let Loaded { world, shot, settings: base, options, warnings, .. } =
        job::load(&args.scene, &args.settings)?;
    if !args.quiet {
        warnings.iter().for_each(say::warning);
    }
    if base.crop.is_some() {
        let message = "accuracy compares whole frames: the black pixels outside a crop would count as exact\n  \
                       help: leave --crop out; a smaller --size is faster";
        return Err(Error::Usage(message.into()));
    }
    atomic::make_room(args.output.join("report.html"))?;
    let frames = frames(args, shot.frames)?;
    let mut groups = if args.knobs.is_empty() { Group::ALL.to_vec() } else { args.knobs.clone() };
    let denoiser = denoiser(args, &groups)?;
    let lacks_denoiser = denoiser.is_none() && groups.contains(&Group::Denoiser);
    groups.retain(|group| *group != Group::Denoiser);
    groups.extend(denoiser.as_ref().map(|_| Group::Denoiser));
    let hash = fingerprint(&world, &shot);
    // Rounded twice, about the scene's own centre and not, where that is compared.
    let otherwise = groups.contains(&Group::Intersection).then(|| world.clone());
    let scene = world.into_scene(base.rules.recentre)?;
    let otherwise = otherwise.and_then(|world| world.into_scene(!base.rules.recentre).ok());
    let candidates = candidates(&scene, &base, shot.frames, &groups, otherwise.is_some());
    let threads = args.threads.or(options.threads);
    let threads = threads.map_or_else(cluster::default_threads, |n| n as usize);
    let pool = machine::thread_pool(threads)?;
    let building = Instant::now();
    let intersector = pool.install(|| intersect::build(&scene, &base, threads))?;
    let context = TrialContext {
        scene: &scene,
        otherwise: otherwise.as_ref(),
        shot: &shot,
        base: &base,
        intersector: &*intersector,
        build_seconds: building.elapsed().as_secs_f64(),
        pool: &pool,
        stop: &interrupt.stop,
    };
    let sweep = Sweep {
        context: &context,
        candidates: &candidates,
        frames: &frames,
        turns: args.turns,
        denoiser: denoiser.as_ref(),
    };
    let terms = terms(args, &sweep, &hash);
    let ledger = Ledger::open(&args.output.join("sweep"), &terms, args.overwrite)?;
    let oracle_was_wanted = groups.contains(&Group::Oracle);
    interrupt.before_slurm_ends();
    interrupt.limit(start, args.time_limit.or(options.time_limit));
    let job = SweepJob {
        args,
        sweep: &sweep,
        interrupt: &interrupt,
        line: line::ProgressLine::new(args.quiet),
        oracle_was_wanted,
        writing_is_wanted: groups.contains(&Group::Writing),
        lacks_denoiser,
        load: machine::load(),
        start,
    };
    job.run(ledger)
}

/// The denoiser that was asked for, or one that is there and runs where none was; `None` where none is wanted.
fn denoiser(args: &AccuracyArgs, groups: &[Group]) -> Result<Option<Denoiser>> {
    if args.denoiser.is_none() && !groups.contains(&Group::Denoiser) {
        return Ok(None);
    }
    let program = args.denoiser.clone().unwrap_or("oidnDenoise".into());
    let is_asked_for = args.denoiser.is_some() || args.knobs.contains(&Group::Denoiser);
    let found = match Denoiser::find(&program) {
        Err(_) if !is_asked_for => None,
        found => found?,
    };
    if found.is_none() && is_asked_for {
        return Err(Error::Usage(format!(
            "there is no program {}, which denoised frames need\n  help: install Intel Open Image Denoise, and give the \
             path of its program with --denoiser",
            program.display()
        )));
    }
    Ok(found)
}

/// Everything that the figures depend on, by name; a sweep resumes only if it is equal.
fn terms(args: &AccuracyArgs, sweep: &Sweep, hash: &str) -> Map<String, Value> {
    let context = sweep.context;
    let names: Vec<String> = sweep.candidates.iter().map(Candidate::name).collect();
    let mut terms = Map::new();
    if let Value::Object(settings) = Header::settings(context.base) {
        terms.extend(settings.into_iter().map(|(name, value)| (name.replace('_', "-"), value)));
    }
    let others = [
        ("frames", json!(sweep.frames)),
        ("settings to compare", json!(names)),
        ("reference-spp", json!(args.reference_spp)),
        ("threads", json!(context.pool.current_num_threads())),
        ("scene content", json!(hash)),
        ("tweenray version", json!(crate::output::VERSION)),
        ("tracer", json!(context.intersector.describe())),
        ("machine", json!(machine::Machine::here().cpu)),
    ];
    terms.extend(others.map(|(name, value)| (name.to_string(), value)));
    terms.extend(sweep.denoiser.map(|d| ("denoiser".to_string(), json!(d.describe()))));
    terms
}

fn frames(args: &AccuracyArgs, count: u32) -> Result<Vec<u32>> {
    if args.frames.is_empty() {
        return Ok(accuracy::chosen_frames(count));
    }
    let mut frames = args.frames.clone();
    frames.sort_unstable();
    frames.dedup();
    let is_there = |f: &u32| values::in_shot(FrameRange { first: *f, last: *f }, count);
    frames.iter().try_for_each(is_there).map_err(Error::Usage)?;
    Ok(frames)
}

/// The candidates of the sweep. Without the scene in its own coordinates (some scenes cannot be rounded there),
/// the candidate for `--recentre off` is left out.
fn candidates(
    scene: &Scene,
    base: &Settings,
    frames: u32,
    groups: &[Group],
    otherwise: bool,
) -> Vec<Candidate> {
    let looks_up = |s: &Settings| !reuse::channels(scene, s).is_empty();
    let mut all =
        accuracy::candidates(base, &EffectPlan::of(scene, base), frames, &looks_up, groups);
    all.retain(|c| otherwise || c.settings.rules.recentre == base.rules.recentre);
    all
}
