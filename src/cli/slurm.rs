//! `tweenray slurm`: a batch script that renders a sequence on a cluster, in as many runs as the time limit makes
//! necessary.

mod script;

use super::args::{SceneArgs, whole};
use super::exit::Exit;
use super::render::{self, RenderArgs};
use super::request::{aovs, place, uploads};
use super::{job, references, say, values};
use crate::cluster;
use crate::error::{Error, Result};
use crate::import::Loaded;
use crate::output::FramePattern;
use crate::sequence::checkpoint;
use clap::Args;
use script::Script;
use std::path::Path;
use std::time::Duration;

/// Default time between the signal to stop and the limit.
const NOTICE: Duration = Duration::from_secs(60);
/// Longest such time that Slurm accepts.
const MOST_NOTICE: Duration = Duration::from_secs(65_535);
/// Longest time limit; no queue allows more.
const MOST_TIME: Duration = Duration::from_secs(366 * 86_400);

/// Print a Slurm batch script that renders a sequence, in as many runs as its time limit makes necessary
///
/// The job stops before its limit and is requeued until `tweenray status` says that the sequence is
/// complete, or until a run makes no progress. The scene is read now, so that mistakes are reported before
/// the job waits in a queue.
#[derive(Debug, Args)]
#[command(after_help = "\
What follows -- goes to `tweenray render`. Paths are taken from the current folder.
The job sees none of your shell's variables: --setup says what it needs.

Examples:
  tweenray slurm scene.toml --nodes 4 --time 30m > job.sh && sbatch job.sh
  tweenray slurm scene.toml --nodes 4 --time 30m --setup 'module load openmpi' -- --spp 64 | sbatch
  tweenray slurm scene.toml --nodes 2 --cpus 16 --time 4h --sbatch partition=long | sbatch")]
pub struct SlurmArgs {
    /// Scene file (.toml), or a bare mesh (.obj, .ply, .glb, .gltf)
    #[arg(value_name = "SCENE")]
    scene: String,
    /// Nodes
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole(1, 100_000))]
    nodes: u32,
    /// Time limit of a run, as the queue allows: 30m, 4h, 2d, or as Slurm writes it: 30 (minutes),
    /// 00:30:00, 1-12
    #[arg(long, value_name = "TIME", value_parser = values::time_limit)]
    time: Duration,
    /// Processes on each node; its cores are shared out among them
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true,
        value_parser = whole(1, 4096))]
    tasks_per_node: u32,
    /// Cores of each process [default: whole nodes, without other jobs]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole(1, 4096))]
    cpus: Option<u32>,
    /// How long before the limit the processes get the signal to stop [default: 60s, or a quarter of the
    /// time]
    #[arg(long, value_name = "TIME", value_parser = values::time)]
    notice: Option<Duration>,
    /// One more option of sbatch, as in partition=long or account=physics; repeatable
    #[arg(long, value_name = "OPTION", value_parser = option)]
    sbatch: Vec<String>,
    /// A line of shell before the first process starts, as in 'module load openmpi' or 'export A=B';
    /// repeatable
    #[arg(long, value_name = "LINE", value_parser = one_line)]
    setup: Vec<String>,
    /// Options of `tweenray render`
    #[arg(last = true, value_name = "OPTIONS", value_parser = one_line)]
    render: Vec<String>,
}

/// Runs the command.
pub fn run(args: &SlurmArgs) -> Result<Exit> {
    let notice = notice(args.time, args.notice)?;
    let render = render::parse(&args.scene, &args.render)?;
    one_line(&args.scene).map_err(Error::Usage)?;
    let RenderArgs { scene, job, settings, .. } = &render;
    let mut loaded = job::load(scene, settings)?;
    refuse_overwrite(job.overwrite, loaded.options.overwrite, scene)?;
    let (frames, pattern) = place(scene, job, &mut loaded)?;
    check_files(&render, &loaded, &pattern, args.nodes * args.tasks_per_node)?;
    let references = checkpoint::folder(&pattern);
    let whole = frames.first == 1 && frames.last == loaded.shot.frames;
    let script = Script {
        program: &text(&std::env::current_exe().map_err(|e| Error::Failed(e.to_string()))?)?,
        folder: &text(&std::env::current_dir().map_err(|e| Error::Failed(e.to_string()))?)?,
        words: &super::words(),
        scene: &args.scene,
        render: &args.render,
        pattern: &pattern.to_string(),
        frames: (!whole).then_some(frames),
        references: &text(&references)?,
        nodes: args.nodes,
        tasks_per_node: args.tasks_per_node,
        cpus: args.cpus,
        minutes: args.time.as_secs().div_ceil(60),
        notice: notice.as_secs(),
        sbatch: &args.sbatch,
        setup: &args.setup,
    };
    say::text(&script.text())?;
    Ok(Exit::Done)
}

/// How long before the limit Slurm is to send the signal.
fn notice(time: Duration, asked: Option<Duration>) -> Result<Duration> {
    if time < Duration::from_secs(60) {
        return Err(Error::Usage("--time: Slurm counts in minutes: at least 1m".into()));
    }
    if time > MOST_TIME {
        return Err(Error::Usage("--time: no run takes longer than a year".into()));
    }
    let notice = asked.unwrap_or(NOTICE.min(time / 4));
    let wrong = match notice {
        _ if notice >= time => "--notice is as long as --time: nothing would be rendered",
        _ if notice > MOST_NOTICE => "--notice: Slurm takes 65535s at most",
        _ => return Ok(notice),
    };
    Err(Error::Usage(wrong.into()))
}

/// Checks that the files that options name exist, so that mistakes are found before the job waits in a queue.
fn check_files(
    render: &RenderArgs,
    loaded: &Loaded,
    pattern: &FramePattern,
    ranks: u32,
) -> Result<()> {
    let Loaded { shot, settings, options, .. } = loaded;
    aovs(&render.settings, options, settings, pattern)?;
    render.job.rank_map.iter().try_for_each(|map| cluster::check_rank_map(map, ranks))?;
    references::check(&options.references, pattern, settings)?;
    uploads(&options.uploads, shot, settings).map(drop)
}

/// Refuses `--overwrite`, with which every requeued run would begin anew.
fn refuse_overwrite(option: bool, in_scene: bool, scene: &SceneArgs) -> Result<()> {
    let place = match (option, in_scene) {
        (true, _) => "--overwrite".to_string(),
        (_, true) => format!("`overwrite` in {}", scene.scene.display()),
        _ => return Ok(()),
    };
    Err(Error::Usage(format!(
        "with {place} every run of the job would begin anew, and none would get done\n  \
         help: leave it out, and remove what is to be replaced or choose another output with -o"
    )))
}

/// An option of sbatch, with its dashes or without.
fn option(text: &str) -> std::result::Result<String, String> {
    match text.trim_start_matches('-').trim().is_empty() {
        true => Err("an option of sbatch is written NAME=VALUE or NAME".into()),
        false => one_line(text),
    }
}

/// Words that become lines of the script.
fn one_line(text: &str) -> std::result::Result<String, String> {
    match text.chars().any(char::is_control) {
        true => Err(format!("{text:?} holds a line break or the like, which a script cannot")),
        false => Ok(text.into()),
    }
}

fn text(path: &Path) -> Result<String> {
    let wrong = || format!("{} cannot be written into a script", path.display());
    path.to_str().and_then(|text| one_line(text).ok()).ok_or_else(|| Error::Usage(wrong()))
}
