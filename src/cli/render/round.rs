//! One round of a job: every frame that is not there yet, by all ranks.

use super::tell;
use crate::cli::progress::Watch;
use crate::cli::request::Request;
use crate::cli::say;
use crate::cli::signals::Interrupt;
use crate::cli::stats::RankStats;
use crate::cluster::{self, Communicator, Outcome};
use crate::error::Result;
use crate::intersect::Intersector;
use crate::output::{Format, SequenceLock, atomic};
use crate::reuse::colour::AgreementRule;
use crate::scene::Policy;
use crate::sequence::checkpoint::{self, Checkpoints};
use crate::sequence::{
    ColourMaker, FrameContext, Plan, Pyramid, RankMaker, SaveCost, SurfaceReuse, Target, Tracer,
};
use crate::shade::Renderer;
use rayon::ThreadPool;
use std::time::Instant;

/// Where frames are rendered.
pub(super) struct Site<'a> {
    pub comm: &'a Communicator,
    pub intersector: &'a dyn Intersector,
    pub pool: &'a ThreadPool,
    /// The ranks, node by node.
    pub order: &'a [u32],
    pub interrupt: &'a Interrupt,
    pub clock: Clock,
    /// Whether nothing is said.
    pub quiet: bool,
}

/// When the program started, and when it had loaded and built the scene.
pub(super) struct Clock {
    pub start: Instant,
    pub loaded: Instant,
    pub built: Instant,
}

impl Clock {
    /// What building the intersector took.
    pub fn build_seconds(&self) -> f64 {
        (self.built - self.loaded).as_secs_f64()
    }
}

/// What came of rendering all frames once.
pub(super) struct Round {
    pub plan: Plan,
    pub outcome: Outcome,
    /// Frames that no rank got to; every rank knows it.
    pub unfinished: usize,
    pub seconds: f64,
    /// What each rank took, and why it was asked to stop; known on rank 0.
    pub ranks: Vec<RankStats>,
    pub reasons: Vec<String>,
    /// Keeps jobs of other settings out until all that is made of the frames is made.
    _lock: SequenceLock,
}

impl Site<'_> {
    /// Renders the frames of `request` that are not there yet. All ranks call it.
    pub fn render(&self, request: &Request, target: &Target) -> Result<Round> {
        self.comm.from_root(|| request.stats.as_ref().map_or(Ok(()), atomic::make_room))?;
        let lock = cluster::lock(self.comm, target)?;
        if !lock.is_kept() {
            let folder = target.pattern.folder().display();
            let what =
                "is on a file system without locks: nothing keeps a job of other settings out";
            tell(self.quiet, &[format!("{folder} {what}")], |n| say::note(n));
        }
        let plan = cluster::prepare(self.comm, self.pool, target, request.frames)?;
        tell(self.quiet, &plan.notes, |n| say::note(n));
        let job = Frames { request, target, plan: &plan, site: self };
        self.interrupt.goes_on(job.goes_on());
        let begun = Instant::now();
        let (outcome, reference_bytes, saved) = job.render()?;
        let seconds = begun.elapsed().as_secs_f64();
        let Clock { start, loaded, built } = self.clock;
        let rank = RankStats {
            threads: self.pool.current_num_threads(),
            load_seconds: (loaded - start).as_secs_f64(),
            build_seconds: self.clock.build_seconds(),
            render_seconds: built.elapsed().as_secs_f64(),
            intersector_bytes: self.intersector.memory(),
            reference_bytes,
            checkpoint_seconds: saved.seconds,
            checkpoint_bytes: saved.bytes,
            work: outcome.own,
            peak_memory_bytes: None,
        };
        let ranks = self.comm.gather(&rank.with_peak())?;
        // Whichever rank was asked to stop knows why.
        let reasons = self.comm.gather(&self.interrupt.reason())?;
        // A rank that was asked to stop when all its frames were finished has stopped no more than the video.
        let unfinished = self.comm.from_root(|| Ok(outcome.unfinished))?;
        if unfinished == 0 && self.comm.is_root() {
            checkpoint::clear(target);
        }
        Ok(Round { plan, outcome, unfinished, seconds, ranks, reasons, _lock: lock })
    }
}

/// What rendering the planned frames takes.
pub(super) struct Frames<'a> {
    pub request: &'a Request,
    pub target: &'a Target,
    pub plan: &'a Plan,
    pub site: &'a Site<'a>,
}

impl Frames<'_> {
    /// What became of the frames, the most memory that references took, bytes, and what it took to
    /// put them on disk.
    pub fn render(&self) -> Result<(Outcome, u64, SaveCost)> {
        let Request { scene, settings, shot, pattern, uploads, .. } = self.request;
        let Site { comm, intersector, pool, order, interrupt, quiet, .. } = *self.site;
        let watch = Watch::new(self.plan.kept.len(), self.total(), quiet);
        let renderer = Renderer::new(scene, settings, intersector);
        let with_gbuffer = pattern.format() == Format::Exr;
        let checkpoints = self.checkpoints();
        let (target, plan, stop) = (self.target, self.plan, &interrupt.stop);
        let progress = &watch;
        let context = FrameContext { renderer, shot, pool, with_gbuffer, stop, progress };
        let maker: Box<dyn RankMaker> = match settings.reuse.policy {
            Policy::Surface => {
                let pyramid = Pyramid { segment: settings.reuse.segment, frames: shot.frames };
                let mut maker = SurfaceReuse::new(context, pyramid)?;
                maker.supplied = self.request.references.cache.as_ref();
                maker.checkpoints = Some(&checkpoints);
                maker.exchange = (comm.size() > 1).then(|| self.request.terms.clone());
                maker.terms = with_gbuffer.then(|| self.request.terms.clone());
                Box::new(maker)
            }
            Policy::Colour => {
                let rule = AgreementRule::of(&settings.reuse);
                let mut maker = ColourMaker::new(context, rule, uploads)?;
                maker.checkpoints = Some(&checkpoints);
                Box::new(maker)
            }
            Policy::Off => Box::new(Tracer::new(context)),
        };
        let done = |report: &_| watch.frame_done(report);
        let work = || cluster::render(comm, order, target, plan, &*maker, stop, &done);
        let outcome = interrupt.watched(work);
        watch.finish();
        let notes = outcome.as_ref().map_or_else(|_| maker.notes(), |o| o.notes.clone());
        tell(quiet, &notes, |n| say::note(n));
        if let (Err(error), true) = (&outcome, comm.size() > 1) {
            // The other ranks are in the middle of their frames and would wait for this one.
            comm.abort(error);
        }
        Ok((outcome?, maker.reference_memory(), maker.save_cost()))
    }

    fn checkpoints(&self) -> Checkpoints<'_> {
        let Request { scene, settings, terms, checkpoint, .. } = self.request;
        // Frame files hold references of policy `surface` only.
        let whole = settings.crop.is_none() && settings.reuse.policy == Policy::Surface;
        Checkpoints::new(self.target, *checkpoint, terms, scene.recentring, whole)
    }

    /// How a job goes on that was stopped once its frames were begun: what it was to replace is its own
    /// by then.
    pub fn goes_on(&self) -> String {
        let again = if self.request.overwrite { " without --overwrite" } else { "" };
        format!("; the same command{again} goes on from here")
    }

    pub fn total(&self) -> usize {
        self.plan.kept.len() + self.plan.render.len()
    }
}
