//! Settings that the program chooses: by rank 0, for all.

use super::{Frames, RenderArgs};
use crate::accuracy::Stage;
use crate::cli::choose::{Choice, Chooser};
use crate::cli::request::Request;
use crate::cli::signals::Interrupt;
use crate::cli::stats;
use crate::cluster::{Outcome, World};
use crate::error::Result;
use crate::intersect::Intersector;
use crate::scene::Settings;
use rayon::ThreadPool;
use std::time::Instant;

/// Settings that the program chooses, and chooses again where they were not enough.
pub(super) struct Choosing<'a> {
    /// As given.
    pub args: &'a RenderArgs,
    /// The settings before.
    pub base: &'a Settings,
    /// The threads that render.
    pub pool: &'a ThreadPool,
    /// What signals have asked for.
    pub interrupt: &'a Interrupt,
    /// Whether nothing is said.
    pub quiet: bool,
}

impl Choosing<'_> {
    /// The choice to begin with, rank 0's; `None` where nothing is to be chosen. All ranks call it.
    pub fn first(
        &self,
        world: &World,
        request: &Request,
        intersector: &dyn Intersector,
        start: Instant,
    ) -> Result<Option<Choice>> {
        if !self.args.choice.is_any() {
            return Ok(None);
        }
        world.from_root(|| {
            let choose = |chooser: &Chooser| chooser.choose(start);
            self.interrupt.watched(|| self.ask(world, request, intersector, choose)).map(Some)
        })
    }

    /// A tighter choice where `choice` was not enough. All ranks call it.
    pub fn next(
        &self,
        world: &World,
        job: &Frames,
        intersector: &dyn Intersector,
        choice: Option<Choice>,
        (outcome, seconds): (&Outcome, f64),
    ) -> Result<Option<Choice>> {
        let Some(choice) = choice else { return Ok(None) };
        world.from_root(|| {
            if outcome.unfinished > 0 || job.plan.render.is_empty() {
                return Ok(None);
            }
            let audit = stats::audit_of(job.plan, outcome);
            let seconds = job.plan.kept.is_empty().then_some(seconds);
            let judge = |chooser: &Chooser| chooser.judge(&choice, audit.as_ref(), seconds);
            self.interrupt.watched(|| self.ask(world, job.request, intersector, judge))
        })
    }

    fn ask<T>(
        &self,
        world: &World,
        request: &Request,
        intersector: &dyn Intersector,
        question: impl Fn(&Chooser) -> Result<T>,
    ) -> Result<T> {
        let stage = Stage {
            scene: &request.scene,
            otherwise: None,
            shot: &request.shot,
            base: self.base,
            intersector,
            pool: self.pool,
            stop: &self.interrupt.stop,
        };
        question(&Chooser {
            args: &self.args.choice,
            options: &self.args.settings,
            stage: &stage,
            request,
            ranks: world.size(),
            quiet: self.quiet,
        })
    }
}
