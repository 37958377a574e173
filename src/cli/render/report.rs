//! The last lines that a job prints, and its exit code.

use super::round::{RenderJob, Round};
use super::site::Site;
use super::videos;
use crate::cli::audited::{error_of, worse_than_traced};
use crate::cli::choose::Judgement;
use crate::cli::exit::Exit;
use crate::cli::progress::{duration, percent};
use crate::cli::{say, stats};
use crate::error::{Error, Result};
use crate::scene::Policy;
use crate::stats::ReuseCounts;

/// Prints that the job was stopped before its first frame.
pub(super) fn stopped_while_choosing(site: &Site) -> Exit {
    if site.comm.is_root() {
        site.interrupt.say_stopped();
    }
    Exit::Stopped
}

/// Prints whether the target was reached, as the last line.
pub(super) fn say_verdict(judged: Option<Judgement>, quiet: bool) -> Result<()> {
    let verdict = match judged {
        Some(Judgement::Done(choice)) => choice.verdict(),
        _ => None,
    };
    verdict.filter(|_| !quiet).map_or(Ok(()), say::result)
}

/// Prints the results of a job that renders no more frames. `was_checking`: the job was stopped while
/// its frames were checked against the target.
pub(super) fn conclude(job: &RenderJob, round: &Round, was_checking: bool) -> Result<Exit> {
    let is_stopped = was_checking || round.unfinished > 0;
    if !job.site.comm.is_root() {
        return Ok(if is_stopped { Exit::Stopped } else { Exit::Done });
    }
    if let Some(path) = &job.request.options.stats {
        let seconds = job.site.clock.start.elapsed().as_secs_f64();
        let Round { plan, outcome, ranks, .. } = round;
        stats::write(path, &job.target.header, plan, outcome, ranks, seconds)?;
    }
    let done = if is_stopped { Err(Error::Stopped) } else { finish(job, round) };
    match done {
        Err(Error::Stopped) => {
            say_stopped(job, round);
            Ok(Exit::Stopped)
        }
        done => {
            let samples = judge_samples(job, round);
            let reuse = judge_reuse(job, round);
            Ok(samples.or(reuse).unwrap_or(done?))
        }
    }
}

/// Prints how to resume the job.
fn say_stopped(job: &RenderJob, round: &Round) {
    // A reason that came after the frames is only known here.
    let reason = round.reasons.iter().find(|reason| !reason.is_empty()).cloned();
    let reason = reason.unwrap_or_else(|| job.site.interrupt.reason());
    let finished = round.total() - round.outcome.unfinished;
    say::aside(format_args!(
        "stopped{reason}: {finished} of {} frames are finished in {}{}",
        round.total(),
        job.target.pattern,
        job.goes_on()
    ));
}

/// Prints the results of a job whose frames are all there, and makes its videos.
fn finish(job: &RenderJob, round: &Round) -> Result<Exit> {
    let result = |line: String| if job.site.quiet { Ok(()) } else { say::result(line) };
    let Round { plan, outcome, .. } = round;
    let frames = if round.total() == 1 { "frame" } else { "frames" };
    result(format!(
        "{} {frames} in {} ({} rendered, {} kept) in {}",
        round.total(),
        job.target.pattern,
        plan.render.len(),
        plan.kept.len(),
        duration(job.site.clock.start.elapsed().as_secs_f64())
    ))?;
    let policy = job.setup.settings.reuse.policy;
    reused(policy, &stats::reuse_of(outcome)).map_or(Ok(()), result)?;
    let audit = stats::audit_of(plan, outcome);
    let tolerance = job.setup.settings.reuse.tolerance;
    if let Some(line) = audit.and_then(|audit| error_of(&audit, tolerance)) {
        result(line)?;
    }
    if job.request.options.video {
        videos::make(job, round)?.into_iter().try_for_each(result)?;
    }
    Ok(Exit::Done)
}

/// The line about reuse; `None` if there was nothing to reuse.
fn reused(policy: Policy, counts: &ReuseCounts) -> Option<String> {
    let all = percent(counts.share()?, 1);
    let mirrored = counts.specular_share().map_or(String::new(), |share| {
        format!("; of those in mirrors, in glass or out of focus {}", percent(share, 1))
    });
    let what = match policy {
        // The policy reuses pixels, whatever they show.
        Policy::Colour => "pixels",
        Policy::Surface | Policy::Off => "lit surface points",
    };
    let in_part = match counts.inferred_in_part {
        0 => String::new(),
        _ => format!(", {} in part", percent(counts.share_in_part()?, 1)),
    };
    Some(format!("{all} of the {what} were reused{in_part}{mirrored}"))
}

/// Warns if inferred frames are less accurate than traced ones; returns an exit code if that is a failure.
fn judge_reuse(job: &RenderJob, round: &Round) -> Option<Exit> {
    let audits = stats::audits_of(&round.plan, &round.outcome);
    complain(job, worse_than_traced(&audits, job.setup.settings.reuse.tolerance)?)
}

/// Prints a warning about finished frames, or with `--strict` an error; then returns the exit code.
fn complain(job: &RenderJob, message: String) -> Option<Exit> {
    if job.request.options.strict {
        say::error(&Error::Failed(message));
        return Some(Exit::Failed);
    }
    say::unless(job.site.quiet, &[message], |m| say::warning(m));
    None
}

/// Warns of invalid samples; returns an exit code if they are a failure.
fn judge_samples(job: &RenderJob, round: &Round) -> Option<Exit> {
    let Round { plan, outcome, .. } = round;
    let bad = stats::bad_of(plan, outcome);
    if bad.is_none() {
        return None;
    }
    let rendered = outcome.frames.iter().map(|(_, report)| (report.frame, report.bad));
    let all = plan.kept_bad.iter().copied().chain(rendered);
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
    complain(job, message)
}
