//! One round of a job: all ranks render the frames that are missing.

use super::site::Site;
use crate::cli::choose::Choice;
use crate::cli::progress::Watch;
use crate::cli::request::{Request, Setup};
use crate::cli::say;
use crate::cli::stats::RankStats;
use crate::cluster::{self, Outcome, RankJob};
use crate::error::Result;
use crate::output::{SequenceLock, atomic};
use crate::reuse::colour::AgreementRule;
use crate::scene::{Aov, Aovs, Policy};
use crate::sequence::checkpoint::{self, Checkpoints};
use crate::sequence::{
    ColourMaker, FrameContext, Plan, Pyramid, RankMaker, SurfaceReuse, Target, Tracer,
};
use crate::shade::Renderer;
use std::time::Instant;

/// The result of one round.
pub(super) struct Round {
    pub plan: Plan,
    pub outcome: Outcome,
    /// Number of frames that were not rendered; known on every rank.
    pub unfinished: usize,
    pub seconds: f64,
    /// Statistics of each rank; known on rank 0.
    pub ranks: Vec<RankStats>,
    pub reasons: Vec<String>,
    /// Keeps jobs of other settings out until the videos and the check of the frames are done.
    _lock: SequenceLock,
}

/// Everything that rendering the frames needs.
pub(super) struct RenderJob<'a> {
    pub site: &'a Site<'a>,
    pub request: &'a Request,
    pub setup: Setup,
    pub target: Target,
}

impl Round {
    /// Number of frames asked for.
    pub fn total(&self) -> usize {
        total(&self.plan)
    }
}

fn total(plan: &Plan) -> usize {
    plan.kept.len() + plan.render.len()
}

impl<'a> RenderJob<'a> {
    /// The job with its own settings or those of `choice`. If it `is_again`, it replaces its own frames.
    pub fn new(
        site: &'a Site<'a>,
        request: &'a Request,
        choice: Option<&Choice>,
        is_again: bool,
    ) -> Result<Self> {
        let base = &request.settings;
        let setup = request.setup(choice.map_or_else(|| base.clone(), |c| c.settings(base)))?;
        let mut target = request.target(&setup, &site.tracer);
        target.header.chosen = choice.map(Choice::value);
        target.overwrite |= is_again;
        Ok(Self { site, request, setup, target })
    }

    /// Renders the missing frames. All ranks call it.
    pub fn render(&self) -> Result<Round> {
        let Site { comm, pool, interrupt, quiet, .. } = self.site;
        let (request, target) = (self.request, &self.target);
        comm.from_root(|| request.options.stats.as_ref().map_or(Ok(()), atomic::make_room))?;
        let lock = cluster::lock(comm, target)?;
        if !lock.is_kept() {
            let folder = target.pattern.folder().display();
            let what =
                "is on a file system without locks: nothing keeps a job of other settings out";
            say::unless(*quiet, &[format!("{folder} {what}")], |n| say::note(n));
        }
        let plan = cluster::prepare(comm, pool, target, request.frames)?;
        say::unless(*quiet, &plan.notes, |n| say::note(n));
        interrupt.goes_on(self.goes_on());
        let begun = Instant::now();
        let (outcome, rank) = self.frames(&plan)?;
        let seconds = begun.elapsed().as_secs_f64();
        let ranks = comm.gather(&rank.with_peak())?;
        // Whichever rank was asked to stop knows why.
        let reasons = comm.gather(&interrupt.reason())?;
        // A rank that was asked to stop when all its frames were finished has stopped no more than the video.
        let unfinished = comm.from_root(|| Ok(outcome.unfinished))?;
        if unfinished == 0 && comm.is_root() {
            checkpoint::clear(target);
        }
        Ok(Round { plan, outcome, unfinished, seconds, ranks, reasons, _lock: lock })
    }

    /// Renders the frames of `plan`; returns the outcome and this rank's statistics.
    fn frames(&self, plan: &Plan) -> Result<(Outcome, RankStats)> {
        let Site { comm, pool, order, interrupt, quiet, intersector, clock, .. } = self.site;
        let watch = Watch::new(plan.kept.len(), total(plan), *quiet);
        let checkpoints = self.checkpoints();
        let maker = self.maker(&watch, &checkpoints)?;
        let (target, stop) = (&self.target, &interrupt.stop);
        let done = |report: &_| watch.frame_done(report);
        let job = RankJob {
            comm,
            rank_order: order,
            target,
            plan,
            maker: &*maker,
            stop,
            threads: pool.current_num_threads(),
            done: &done,
        };
        let outcome = interrupt.watched(|| cluster::render(&job));
        watch.finish();
        let notes = outcome.as_ref().map_or_else(|_| maker.notes(), |o| o.notes.clone());
        say::unless(*quiet, &notes, |n| say::note(n));
        if let (Err(error), true) = (&outcome, comm.size() > 1) {
            // The other ranks are in the middle of their frames and would wait for this one.
            comm.abort(error);
        }
        let (outcome, saved) = (outcome?, maker.save_cost());
        let rank = RankStats {
            threads: pool.current_num_threads(),
            load_seconds: (clock.loaded - clock.start).as_secs_f64(),
            build_seconds: clock.build_seconds(),
            render_seconds: clock.built.elapsed().as_secs_f64(),
            intersector_bytes: intersector.memory(),
            reference_bytes: maker.reference_memory(),
            checkpoint_seconds: saved.seconds,
            checkpoint_bytes: saved.bytes,
            work: outcome.own,
            peak_memory_bytes: None,
        };
        Ok((outcome, rank))
    }

    /// The maker of frames for the job's policy.
    fn maker<'m>(
        &'m self,
        watch: &'m Watch,
        checkpoints: &'m Checkpoints,
    ) -> Result<Box<dyn RankMaker + 'm>> {
        let Request { scene, shot, uploads, references, .. } = self.request;
        let Setup { settings, terms, .. } = &self.setup;
        let Site { comm, intersector, pool, interrupt, .. } = self.site;
        let (stop, progress) = (&interrupt.stop, watch);
        let renderer = Renderer::new(scene, settings, &**intersector);
        let with_gbuffer = settings.aovs.as_ref().is_some_and(Aovs::have_first_hits);
        let context = FrameContext { renderer, shot, pool, with_gbuffer, stop, progress };
        Ok(match settings.reuse.policy {
            Policy::Surface => {
                let pyramid = Pyramid { segment: settings.reuse.segment, frames: shot.frames };
                let mut maker = SurfaceReuse::new(context, pyramid)?;
                maker.supplied = references.cache.as_ref();
                maker.checkpoints = Some(checkpoints);
                maker.exchange = (comm.size() > 1).then(|| terms.clone());
                maker.terms = settings.holds(Aov::Reference).then(|| terms.clone());
                Box::new(maker)
            }
            Policy::Colour => {
                let rule = AgreementRule::of(&settings.reuse);
                let mut maker = ColourMaker::new(context, rule, uploads)?;
                maker.checkpoints = Some(checkpoints);
                Box::new(maker)
            }
            Policy::Off => Box::new(Tracer::new(context)),
        })
    }

    fn checkpoints(&self) -> Checkpoints<'_> {
        let Request { scene, options, .. } = self.request;
        let Setup { settings, terms, .. } = &self.setup;
        // The file of a cropped frame holds a part of its reference.
        let whole = settings.crop.is_none() && settings.holds(Aov::Reference);
        Checkpoints::new(&self.target, options.checkpoint, terms, scene.recentring, whole)
    }

    /// How to resume a job that has begun its frames: without `--overwrite`, since it has replaced older frames
    /// already.
    pub fn goes_on(&self) -> String {
        let again = if self.request.options.overwrite { " without --overwrite" } else { "" };
        format!("; the same command{again} goes on from here")
    }
}
