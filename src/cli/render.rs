//! `tweenray render`: every frame of a shot, and a video of them.

use super::args::{OutputArgs, SceneArgs, SettingArgs};
use super::exit::Exit;
use super::progress::{Watch, duration};
use super::signals::Interrupt;
use super::stats::{self, RankStats};
use super::{job, say, values};
use crate::cluster::{self, Outcome, World};
use crate::effects::EffectPlan;
use crate::error::{Error, Result};
use crate::import::Loaded;
use crate::intersect::{self, Intersector};
use crate::output::{Format, FramePattern, Header, MANIFEST_FORMAT, video};
use crate::scene::{FrameRange, Scene, Settings, Shot};
use crate::sequence::{self, Plan, Target, Tracer};
use crate::shade::Renderer;
use clap::Args;
use rayon::ThreadPool;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Render the frames of a camera move
#[derive(Debug, Args)]
#[command(after_help = "\
Every option can also stand in the scene file; the command line wins.
Frames that exist with the same settings are kept, so the same command goes on where it stopped.

Exit codes: 0 done, 1 failed, 2 usage or bad input, 75 stopped and can be resumed.

Examples:
  tweenray render scene.toml -o 'out/frame_####.png' --frames 1..16 --size 640x360 --spp 4
  tweenray render bunny.obj --up z
  mpirun -n 4 tweenray render scene.toml")]
pub struct RenderArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    settings: SettingArgs,
}

/// Runs the command.
pub fn run(args: &RenderArgs) -> Exit {
    let world = match World::join() {
        Ok(world) => world,
        Err(error) => {
            say::error(&error);
            return Exit::of(&error);
        }
    };
    render(&world, args).unwrap_or_else(|error| {
        if world.is_root() {
            say::error(&error);
        }
        Exit::of(&error)
    })
}

fn render(world: &World, args: &RenderArgs) -> Result<Exit> {
    let start = Instant::now();
    let interrupt = Interrupt::listen()?;
    let job = world.agree(Job::load(args))?;
    if world.is_root() && !args.output.quiet {
        job.warnings.iter().for_each(say::warning);
    }
    let threads = args.output.threads.map_or_else(cluster::default_threads, |n| n as usize);
    let pool = world.agree(thread_pool(threads))?;
    let load_seconds = start.elapsed().as_secs_f64();
    let built = Instant::now();
    let intersector = world.agree(intersect::build(&job.scene, &job.settings, threads))?;
    let mut rank = RankStats {
        threads,
        load_seconds,
        build_seconds: built.elapsed().as_secs_f64(),
        render_seconds: 0.0,
        intersector_bytes: intersector.memory(),
        peak_memory_bytes: None,
    };
    let target = job.target(args, &world.same_everywhere("traces with", intersector.describe())?);
    let plan =
        world.from_root(|| pool.install(|| sequence::prepare(&target, job.frames)))?;
    if world.is_root() && !args.output.quiet {
        plan.notes.iter().for_each(say::note);
    }
    let rendering = Instant::now();
    let outcome =
        job.render(world, &target, &plan, &*intersector, &pool, &interrupt, args.output.quiet)?;
    rank.render_seconds = rendering.elapsed().as_secs_f64();
    let ranks = world.gather(&rank.with_peak())?;
    if !world.is_root() {
        let stopped = interrupt.stop.load(Ordering::Relaxed);
        return Ok(if stopped { Exit::Stopped } else { Exit::Done });
    }
    if let Some(path) = &args.output.stats {
        let seconds = start.elapsed().as_secs_f64();
        stats::write(path, &target.header, &plan, &outcome, &ranks, seconds)?;
    }
    finish(args, &job, &target, &plan, &outcome, start)
}

/// What is known once the scene is read.
struct Job {
    scene: Scene,
    scene_hash: String,
    shot: Shot,
    settings: Settings,
    frames: FrameRange,
    pattern: FramePattern,
    warnings: Vec<crate::error::Diagnostic>,
}

impl Job {
    fn load(args: &RenderArgs) -> Result<Self> {
        let loaded = job::load(&args.scene, &args.settings)?;
        let frames = frames_of(&args.output, &loaded)?;
        let name = args.output.output.clone().or(loaded.output.clone());
        let name = name.unwrap_or_else(|| default_output(&args.scene.scene));
        let pattern = FramePattern::parse(&name)?;
        if frames.first < frames.last && !pattern.is_numbered() {
            return Err(Error::Usage(format!(
                "`{name}` names one file for {} frames\n  help: write #### where the frame number \
                 goes, as in out/frame_####.png",
                frames.last - frames.first + 1
            )));
        }
        let Loaded { world, shot, settings, warnings, .. } = loaded;
        let scene_hash = sequence::fingerprint(&world, &shot);
        let scene = world.into_scene(settings.rules.recentre)?;
        Ok(Self { scene, scene_hash, shot, settings, frames, pattern, warnings })
    }

    fn target(&self, args: &RenderArgs, tracer: &str) -> Target {
        Target {
            pattern: self.pattern.clone(),
            header: Header {
                manifest: MANIFEST_FORMAT,
                tweenray: env!("CARGO_PKG_VERSION").into(),
                scene: args.scene.scene.display().to_string(),
                scene_hash: self.scene_hash.clone(),
                shot_frames: self.shot.frames,
                files: self.pattern.file_name(),
                tracer: tracer.into(),
                settings: Header::settings(&self.settings),
            },
            overwrite: args.output.overwrite,
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn render(
        &self,
        world: &World,
        target: &Target,
        plan: &Plan,
        intersector: &dyn Intersector,
        pool: &ThreadPool,
        interrupt: &Interrupt,
        quiet: bool,
    ) -> Result<Outcome> {
        let (kept, total) = (plan.kept.len(), plan.kept.len() + plan.render.len());
        let watch = Watch::new(kept, total, quiet || !world.is_root());
        let plan_of_effects = EffectPlan::of(&self.scene, &self.settings);
        let tracer = Tracer {
            renderer: Renderer {
                scene: &self.scene,
                settings: &self.settings,
                plan: plan_of_effects,
                intersector,
            },
            shot: &self.shot,
            pool,
            with_gbuffer: self.pattern.format() == Format::Exr,
            stop: &interrupt.stop,
            progress: &watch,
        };
        let done = |report: &_| watch.frame_done(report);
        let work = || cluster::render(world, target, plan, &tracer, &interrupt.stop, &done);
        let outcome = interrupt.watched(work);
        watch.finish();
        if let (Err(error), true) = (&outcome, world.size() > 1) {
            say::error(error);
            world.abort(Exit::of(error).code());
        }
        outcome
    }
}

/// Says what there is now, and makes the video of a complete sequence.
fn finish(
    args: &RenderArgs,
    job: &Job,
    target: &Target,
    plan: &Plan,
    outcome: &Outcome,
    start: Instant,
) -> Result<Exit> {
    let rendered = outcome.frames.len();
    let total = plan.kept.len() + plan.render.len();
    if outcome.unfinished > 0 {
        let again = if args.output.overwrite { " without --overwrite" } else { "" };
        say::aside(format_args!(
            "stopped: {} of {total} frames are finished in {}; the same command{again} goes on \
             from here",
            total - outcome.unfinished,
            target.pattern
        ));
        return Ok(Exit::Stopped);
    }
    let said = |line: String| if args.output.quiet { drop(line) } else { say::result(line) };
    let frames = if total == 1 { "frame" } else { "frames" };
    said(format!(
        "{total} {frames} in {} ({rendered} rendered, {} kept) in {}",
        target.pattern,
        plan.kept.len(),
        duration(start.elapsed().as_secs_f64())
    ));
    if total > 1 && !args.output.no_video {
        let fps = args.output.fps.unwrap_or(24);
        said(make_video(job, fps)?);
    }
    Ok(Exit::Done)
}
