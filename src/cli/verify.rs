//! `tweenray verify`: compares the intersector with the oracle on the user's own scene.

mod replay;
mod report;

use super::args::{SceneArgs, SettingArgs, TracingArgs, whole};
use super::exit::Exit;
use super::progress::duration;
use super::signals::Interrupt;
use super::{job, machine, say, values};
use crate::cluster;
use crate::error::{Error, Result};
use crate::import::Loaded;
use crate::intersect::{self, Oracle};
use crate::scene::limits::{MAX_SEED, MAX_THREADS};
use crate::scene::{IntersectorKind, Scene, Settings};
use crate::verify::{self, Check, Kind, RayId, Tally};
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::ThreadPool;
use std::io::IsTerminal;
use std::sync::atomic::Ordering;

/// Most rays of each kind.
const MOST_RAYS: u64 = 1 << 40;

/// Check the intersector: trace a scene with the f64 oracle too, and explain every difference
#[derive(Debug, Args)]
#[command(after_help = "\
Shoots camera, shadow, mirror and random rays and rays aimed at vertices and edges through both, and
classifies every difference. docs/verify.md says what the classes mean.

Exit codes: 0 every difference is explained, 1 some are not or too many slip past vertices, 2 usage,
bad input or nothing to compare, 75 stopped.

Examples:
  tweenray verify scene.toml
  tweenray verify bunny.obj --rays 10000 --seed 7 --json
  tweenray verify bunny.obj --ray vertex:1234")]
pub struct VerifyArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Rays of each of the six kinds [default: as many as take some minutes, at least 512]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(1..=MOST_RAYS))]
    rays: Option<u64>,
    /// Trace one ray again and print all details: camera:1234, or another kind
    #[arg(long, value_name = "KIND:NUMBER", value_parser = ray_id, conflicts_with = "rays")]
    ray: Option<RayId>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Threads [default: the cores this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole(1, MAX_THREADS))]
    threads: Option<u32>,
    /// Print nothing but the result and errors
    #[arg(short, long)]
    quiet: bool,
    /// Image size in pixels, which camera rays are shot for [default: 640x360]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    size: Option<(u32, u32)>,
    /// Seed of the rays [default: the scene's, or 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(0..=MAX_SEED))]
    seed: Option<u64>,
    #[command(flatten)]
    tracing: TracingArgs,
}

impl VerifyArgs {
    /// The options that take precedence over the scene file.
    fn settings(&self) -> SettingArgs {
        SettingArgs {
            size: self.size,
            seed: self.seed,
            tracing: self.tracing.clone(),
            ..SettingArgs::default()
        }
    }
}

fn ray_id(text: &str) -> std::result::Result<RayId, String> {
    let names = Kind::ALL.map(Kind::name);
    let wrong =
        || format!("a ray is KIND:NUMBER, as in camera:1234; kinds are {}", names.join(", "));
    let (name, index) = text.split_once(':').ok_or_else(wrong)?;
    let kind = Kind::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(wrong)?;
    let index = index.parse().ok().filter(|index| *index < MOST_RAYS).ok_or_else(wrong)?;
    Ok(RayId { kind, index })
}

/// Runs the command.
pub fn run(args: &VerifyArgs) -> Result<Exit> {
    let interrupt = Interrupt::new();
    interrupt.listen(true)?;
    let Loaded { world, shot, settings, warnings, .. } = job::load(&args.scene, &args.settings())?;
    let scene = world.into_scene(settings.rules.recentre)?;
    if !args.quiet {
        let lossy = job::mesh_warnings(&scene, &args.scene.scene);
        warnings.iter().chain(&lossy).for_each(say::warning);
    }
    refuse_the_pointless(&scene, &settings)?;
    let threads = args.threads.map_or_else(cluster::default_threads, |n| n as usize);
    let pool = machine::thread_pool(threads)?;
    let product = pool.install(|| intersect::build(&scene, &settings, threads))?;
    let oracle = Oracle::new(&scene);
    let check = Check::new(&scene, &settings, &shot, &*product, &oracle);
    match args.ray {
        Some(id) => replay::run(args, &check, id),
        None => all(args, &check, &pool, &interrupt),
    }
}

/// Refuses checks that could only pass.
fn refuse_the_pointless(scene: &Scene, settings: &Settings) -> Result<()> {
    if settings.intersector == IntersectorKind::Oracle {
        let message = "verify compares an intersector with the oracle; comparing the oracle with \
                       itself shows nothing\n  help: --intersector embree";
        return Err(Error::Usage(message.into()));
    }
    if scene.triangle_count() == 0 && scene.spheres.is_empty() {
        return Err(Error::Usage("nothing to compare: the scene has no geometry".into()));
    }
    Ok(())
}

fn all(args: &VerifyArgs, check: &Check, pool: &ThreadPool, interrupt: &Interrupt) -> Result<Exit> {
    let threads = pool.current_num_threads();
    let triangles = check.scene.triangle_count();
    let rays = args.rays.unwrap_or_else(|| verify::default_rays(triangles));
    let kinds = Kind::ALL.len() as u64;
    if !args.quiet {
        say::aside(format_args!(
            "{kinds} x {rays} rays against {triangles} triangles: {:.1e} ray-triangle pairs of the \
             oracle, about {} on {threads} threads",
            (kinds * rays) as f64 * triangles as f64,
            duration(verify::estimate(rays, triangles, threads))
        ));
    }
    let bar = (!args.quiet && std::io::stderr().is_terminal()).then(|| bar(kinds * rays));
    let progress = |more| bar.iter().for_each(|bar| bar.inc(more));
    let tally = interrupt.watched(|| pool.install(|| check.run(rays, &interrupt.stop, &progress)));
    bar.iter().for_each(ProgressBar::finish_and_clear);
    let complete = !interrupt.stop.load(Ordering::Relaxed);
    report::print(args, check, &tally, complete)?;
    if !complete {
        say_stopped(&tally, kinds * rays);
        return Ok(Exit::Stopped);
    }
    Ok(if tally.passed() { Exit::Done } else { Exit::Failed })
}

fn say_stopped(tally: &Tally, rays: u64) {
    say::aside(format_args!(
        "stopped: {} of {rays} rays were compared, {} differences among them are unexplained",
        tally.total(),
        tally.unexplained()
    ));
}

fn bar(rays: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(rays), ProgressDrawTarget::stderr_with_hz(10));
    let template = "{pos} of {len} rays  {bar:30}  left {eta}";
    bar.set_style(ProgressStyle::with_template(template).unwrap_or(ProgressStyle::default_bar()));
    bar
}

/// The command that traces one ray of this run again: the same words, without those that choose
/// rays and manner.
fn replay_command(id: RayId) -> String {
    let mut words = vec!["tweenray".to_string()];
    // A name that is not UTF-8 cannot be printed as it is.
    let given = std::env::args_os().skip(1);
    let mut given = given.map(|word| word.to_string_lossy().into_owned());
    while let Some(word) = given.next() {
        match word.as_str() {
            "--json" | "--quiet" | "-q" => {}
            "--rays" | "--threads" => drop(given.next()),
            _ if word.starts_with("--rays=") || word.starts_with("--threads=") => {}
            _ => words.push(quoted(&word)),
        }
    }
    words.extend(["--ray".into(), id.to_string()]);
    words.join(" ")
}

/// A word quoted for the shell.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:,=+@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', r"'\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_named_by_kind_and_number() {
        assert_eq!(ray_id("edge:7"), Ok(RayId { kind: Kind::Edge, index: 7 }));
        for wrong in ["edge", "edge:", "edge:-1", "side:1", ":", "edge:99999999999999999999"] {
            assert!(ray_id(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn odd_names_are_quoted_for_the_shell() {
        assert_eq!(quoted("a/b-c.obj"), "a/b-c.obj");
        assert_eq!(quoted("my scene.toml"), "'my scene.toml'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
