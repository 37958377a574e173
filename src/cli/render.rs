//! `tweenray render`: every frame of a shot, and a video of them.

mod choosing;
mod round;
mod videos;

use super::args::{OutputArgs, SceneArgs, SettingArgs};
use super::choose::{Choice, ChoiceArgs, Judgement};
use super::exit::Exit;
use super::machine;
use super::progress::{duration, percent};
use super::request::Request;
use super::say;
use super::signals::Interrupt;
use super::stats;
use crate::cluster::{self, Binding, Communicator, Outcome};
use crate::error::{Error, Result, counted};
use crate::intersect;
use crate::output::manifest::AuditRow;
use crate::scene::{Policy, Settings};
use crate::stats::ReuseCounts;
use choosing::Choosing;
use clap::{Args, Command, FromArgMatches};
use round::{Clock, Frames, Round, Site};
use std::time::Instant;

/// Render the frames of a camera move
#[derive(Debug, Args)]
#[command(after_help = "\
Most options can also stand in the scene file; the command line wins.
Frames that exist with the same settings are kept, so the same command goes on where it stopped.

`tweenray status` says how far they are. A move that got longer keeps the frames that it shares.

SIGINT, SIGTERM and SIGUSR1 stop the job; a second SIGINT or SIGTERM ends it at once.
Exit codes: 0 done, 1 failed, 2 usage or bad input, 75 stopped and can be resumed,
76 the same since mpirun (or srun) was killed.

Examples:
  tweenray render scene.toml -o 'out/frame_####.png' --frames 1..16 --size 640x360 --spp 4
  tweenray render bunny.obj --up z
  tweenray render scene.toml --target psnr=45
  mpirun -n 4 tweenray render scene.toml")]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub choice: ChoiceArgs,
    #[command(flatten)]
    pub settings: SettingArgs,
}

/// The arguments of this command for `scene`, with the options in `words`.
///
/// Errors: `Error::Usage`: these are no options of the command.
pub fn parse(scene: &str, words: &[String]) -> Result<RenderArgs> {
    let command = RenderArgs::augment_args(Command::new("tweenray render"));
    let words = ["tweenray render", scene].into_iter().chain(words.iter().map(String::as_str));
    let parsed = command.try_get_matches_from(words);
    let parsed = parsed.and_then(|found| RenderArgs::from_arg_matches(&found));
    parsed.map_err(|wrong| {
        let text = wrong.to_string();
        Error::Usage(text.trim().trim_start_matches("error: ").into())
    })
}

/// How a job goes on of which no frame was begun: one that is to replace frames has to be told so again.
const NOTHING_DONE: &str = " before the first frame; give the same command again";

/// Runs the command.
pub fn run(args: &RenderArgs) -> Exit {
    let interrupt = Interrupt::new();
    let theirs = interrupt.clone();
    let tell_failure = move |error: &Error| {
        theirs.over();
        say::error(error);
        Exit::of(error).code()
    };
    let comm = match Communicator::init(tell_failure) {
        Ok(comm) => comm,
        Err(error) => return super::refused(&error),
    };
    let ended = render(&comm, &interrupt, args);
    // Others still hear what stops rank 0's video.
    if comm.is_root() || !matches!(ended, Ok(Exit::Done)) {
        interrupt.over();
    }
    let exit = ended.unwrap_or_else(|error| {
        if comm.has_unreported_failure() {
            comm.abort(&error);
        } else if comm.is_root() {
            say::error(&error);
        }
        Exit::of(&error)
    });
    // Rank 0 may make a video yet.
    comm.final_barrier();
    interrupt.over();
    if interrupt.is_orphan() {
        let exit = if exit == Exit::Stopped { Exit::Orphaned } else { exit };
        // Ending MPI would wait for a launcher that is not there.
        signal_hook::low_level::exit(exit.code().into());
    }
    exit
}

fn render(comm: &Communicator, interrupt: &Interrupt, args: &RenderArgs) -> Result<Exit> {
    let start = Instant::now();
    interrupt.listen(comm.is_root())?;
    if let Some(launcher) = cluster::launcher_process() {
        interrupt.end_with(launcher);
    }
    interrupt.goes_on(NOTHING_DONE.into());
    interrupt.before_slurm_ends();
    interrupt.limit(start, args.output.time_limit);
    // Only one rank talks.
    let quiet = args.output.quiet || !comm.is_root();
    let mut request = Request::load(comm, &args.scene, &args.settings, &args.output)?;
    if args.output.time_limit.is_none() {
        interrupt.limit(start, request.time_limit);
    }
    comm.set_exchange(request.exchange);
    comm.agree(args.choice.check(&request))?;
    tell(quiet, &request.warnings, |w| say::warning(w));
    share_isa(comm, &mut request.settings, quiet)?;
    let order = cluster::rank_order(comm, args.output.rank_map.as_deref())?;
    let threads = match request.threads {
        Some(threads) => threads,
        None => comm.default_threads()?,
    };
    let pool = comm.agree(machine::thread_pool(threads))?;
    tell(quiet, comm.binding(threads)?.as_slice(), |binding| say::note(in_words(binding)));
    let loaded = Instant::now();
    let build = || intersect::build(&request.scene, &request.settings, threads);
    let intersector = comm.agree(pool.install(build))?;
    let built = Instant::now();
    let tracer = request.tracer(&intersector.describe())?;
    let tracer = comm.same_everywhere("traces with", tracer)?;
    let clock = Clock { start, loaded, built };
    let (intersector, pool, order) = (&*intersector, &pool, &order[..]);
    let site = Site { comm, intersector, pool, order, interrupt, clock, quiet };
    let base = request.settings.clone();
    let choosing = Choosing { args, base: &base, site: &site };
    let mut choice = match choosing.first(&request, &tracer) {
        Err(Error::Stopped) => {
            if comm.is_root() {
                interrupt.say_stopped();
            }
            return Ok(Exit::Stopped);
        }
        first => first?,
    };
    let mut is_again = false;
    loop {
        if let Some(choice) = &choice {
            request.settings = choice.settings(&base);
            (request.terms, request.recipes) = request.terms_and_recipes(&request.settings)?;
        }
        let mut target = request.target(tracer.clone());
        target.header.chosen = choice.as_ref().map(Choice::value);
        // What is replaced was this job's own.
        target.overwrite |= is_again;
        let round = site.render(&request, &target)?;
        let job = Frames { request: &request, target: &target, plan: &round.plan, site: &site };
        let judged = match round.unfinished {
            0 => choosing.next(&job, &round, choice.take()),
            _ => Ok(None),
        };
        let judged = match judged {
            // All frames are there, but were not all held against what was wanted.
            Err(Error::Stopped) => return conclude(&job, &round, true),
            other => other?,
        };
        let verdict = match judged {
            Some(Judgement::Again(tighter)) => {
                (choice, is_again) = (Some(tighter), true);
                continue;
            }
            Some(Judgement::Done(choice)) => choice.verdict(),
            None => None,
        };
        let exit = conclude(&job, &round, false)?;
        // Last, where it is seen.
        verdict.filter(|_| !quiet).map_or(Ok(()), say::result)?;
        return Ok(exit);
    }
}

/// Tells what there is to tell of a job that renders no more frames; `was_checking`: it was stopped
/// while these were held against what was wanted.
fn conclude(job: &Frames, round: &Round, was_checking: bool) -> Result<Exit> {
    let Round { plan, outcome, unfinished, ranks, .. } = round;
    let Site { comm, interrupt, clock: Clock { start, .. }, quiet, .. } = job.site;
    let is_stopped = was_checking || *unfinished > 0;
    if !comm.is_root() {
        return Ok(if is_stopped { Exit::Stopped } else { Exit::Done });
    }
    if let Some(path) = &job.request.stats {
        let seconds = start.elapsed().as_secs_f64();
        stats::write(path, &job.target.header, plan, outcome, ranks, seconds)?;
    }
    let done = if is_stopped { Err(Error::Stopped) } else { finish(job, outcome, *start, *quiet) };
    match done {
        Err(Error::Stopped) => {
            // One that came after the frames is only known here.
            let reason = round.reasons.iter().find(|reason| !reason.is_empty()).cloned();
            say_stopped(job, outcome, &reason.unwrap_or_else(|| interrupt.reason()));
            Ok(Exit::Stopped)
        }
        done => {
            let samples = judge_samples(job, outcome, *quiet);
            let reuse = judge_reuse(job, outcome, *quiet);
            Ok(samples.or(reuse).unwrap_or(done?))
        }
    }
}

/// Holds every rank to the best instruction set that all their machines have, unless one was
/// asked for: frames differ in their last bits by it.
fn share_isa(comm: &Communicator, settings: &mut Settings, quiet: bool) -> Result<()> {
    let best: Vec<String> = comm.all_gather(machine::best_isa()?.to_string())?;
    let Some(isa) = machine::shared_isa(&best) else { return Ok(()) };
    // Where Embree would choose the same on every machine it may.
    let needed = comm.all_gather(isa != machine::detected_isa())?.contains(&true);
    if settings.isa.is_none() && needed {
        settings.isa = Some(isa.into());
        if best.iter().any(|other| other != isa) {
            let what = "the machines have different instruction sets; all use what they share:";
            tell(quiet, &[format!("{what} {isa}")], |note| say::note(note));
        }
    }
    Ok(())
}

/// What a launcher's binding costs, and what helps.
fn in_words(binding: &Binding) -> String {
    let Binding { ranks, cores, threads, of, idle } = *binding;
    let each = if ranks == 1 { "its rank".into() } else { format!("each of its {ranks} ranks") };
    let has = if ranks == 1 { "it has" } else { "a rank has" };
    let idle = if idle == 1 { "1 core idles".into() } else { format!("{idle} cores idle") };
    format!(
        "the launcher binds {each} to {cores} of this machine's {of} cores: {has} {}, and {idle}\n  \
         help: mpirun --bind-to none; with it --map-by ppr:1:node starts one rank a node",
        counted(threads, "thread")
    )
}

fn tell<T>(quiet: bool, words: &[T], say: fn(&T)) {
    if !quiet {
        words.iter().for_each(say);
    }
}

/// Says how to go on.
fn say_stopped(job: &Frames, outcome: &Outcome, reason: &str) {
    let finished = job.total() - outcome.unfinished;
    say::aside(format_args!(
        "stopped{reason}: {finished} of {} frames are finished in {}{}",
        job.total(),
        job.target.pattern,
        job.goes_on()
    ));
}

/// Says what there is now, and makes the videos of it: all frames asked for are there.
fn finish(job: &Frames, outcome: &Outcome, start: Instant, quiet: bool) -> Result<Exit> {
    let result = |line: String| if quiet { Ok(()) } else { say::result(line) };
    let frames = if job.total() == 1 { "frame" } else { "frames" };
    result(format!(
        "{} {frames} in {} ({} rendered, {} kept) in {}",
        job.total(),
        job.target.pattern,
        job.plan.render.len(),
        job.plan.kept.len(),
        duration(start.elapsed().as_secs_f64())
    ))?;
    let settings = &job.request.settings.reuse;
    reused(settings.policy, &stats::reuse_of(outcome)).map_or(Ok(()), result)?;
    let audit = stats::audit_of(job.plan, outcome);
    if let Some(line) = audit.and_then(|audit| audit_line(&audit)) {
        result(line)?;
    }
    if let Some(fps) = job.request.fps {
        videos::make(job, fps)?.into_iter().try_for_each(result)?;
    }
    Ok(Exit::Done)
}

/// How much of the job was reused, where anything could be.
fn reused(policy: Policy, counts: &ReuseCounts) -> Option<String> {
    let all = percent(counts.share()?, 1);
    let mirrored = counts.specular_share().map_or(String::new(), |share| {
        format!("; of those in mirrors and glass {}", percent(share, 1))
    });
    let what = match policy {
        // It takes over pixels, whatever they show.
        Policy::Colour => "pixels",
        Policy::Surface | Policy::Off => "lit surface points",
    };
    Some(format!("{all} of the {what} were reused{mirrored}"))
}

/// Says so, with what to do, where the audit is sure that inferred frames are less true than traced ones, by
/// more than `tolerance` display steps.
fn worse_than_traced(audit: &AuditRow, tolerance: f32) -> Option<String> {
    let ([rmse, low, _], [traced, _, high]) = (audit.rmse?, audit.rmse_traced?);
    (low > high.max(tolerance.into())).then(|| {
        format!(
            "inferred frames are less true than traced ones (RMSE {}/255 against {}/255): trace them \
             with --policy off, or raise --probes",
            steps(rmse),
            steps(traced)
        )
    })
}

/// How good the inferred frames are, in words.
fn audit_line(audit: &AuditRow) -> Option<String> {
    let ([rmse, low, high], [traced, ..]) = (audit.rmse?, audit.rmse_traced?);
    Some(format!(
        "inferred frames: RMSE {}/255 ({}–{}); tracing each frame: {}/255",
        steps(rmse),
        steps(low),
        steps(high),
        steps(traced)
    ))
}

/// Display steps in two digits or so.
fn steps(x: f64) -> String {
    match x {
        ..0.0095 => format!("{x:.3}"),
        ..0.095 => format!("{x:.2}"),
        _ => format!("{x:.1}"),
    }
}

/// Says where inferred frames are less true than traced ones; an exit code where that is a failure.
fn judge_reuse(job: &Frames, outcome: &Outcome, quiet: bool) -> Option<Exit> {
    let audit = stats::audit_of(job.plan, outcome)?;
    let message = worse_than_traced(&audit, job.request.settings.reuse.tolerance)?;
    if job.request.strict {
        say::error(&Error::Failed(message));
        return Some(Exit::Failed);
    }
    tell(quiet, &[message], |m| say::warning(m));
    None
}

/// Says how many samples are invalid; an exit code where that is a failure.
fn judge_samples(job: &Frames, outcome: &Outcome, quiet: bool) -> Option<Exit> {
    let bad = stats::bad_of(job.plan, outcome);
    if bad.is_none() {
        return None;
    }
    let rendered = outcome.frames.iter().map(|(_, report)| (report.frame, report.bad));
    let all = job.plan.kept_bad.iter().copied().chain(rendered);
    let first = all.filter(|(_, bad)| !bad.is_none()).min_by_key(|(frame, _)| *frame);
    let place = first.and_then(|(frame, bad)| Some((frame, bad.first?)));
    let place = place.map_or(String::new(), |(frame, [x, y])| {
        format!("; the first at pixel {x},{y} of frame {frame}")
    });
    let samples = if bad.total() == 1 { "invalid camera sample" } else { "invalid camera samples" };
    let message = format!(
        "{} {samples} ({bad}){place}\n  \
         help: --flag-bad on shows such pixels in magenta",
        bad.total()
    );
    if job.request.strict {
        say::error(&Error::Failed(message));
        return Some(Exit::Failed);
    }
    tell(quiet, &[message], |m| say::warning(m));
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::AuditSums;

    #[test]
    fn inferred_frames_are_called_worse_only_where_that_is_sure_and_seen() {
        let audit = |rmse, traced| AuditRow {
            rmse: Some(rmse),
            rmse_inferred_pixels: None,
            rmse_traced: Some(traced),
            sums: AuditSums::default(),
        };
        let is_worse = |rmse, traced| worse_than_traced(&audit(rmse, traced), 0.25).is_some();
        assert!(is_worse([5.7, 5.0, 6.4], [2.7, 2.5, 2.9]));
        assert!(!is_worse([2.9, 2.6, 3.2], [2.7, 2.5, 2.9]), "chance");
        assert!(!is_worse([0.2, 0.15, 0.24], [0.05, 0.04, 0.06]), "nobody sees it");
    }
}
