//! Settings that the program chooses: by rank 0, for all.

use super::RenderArgs;
use super::round::{Frames, Round, Site};
use crate::accuracy::Stage;
use crate::cli::choose::{Choice, Chooser};
use crate::cli::request::Request;
use crate::cli::stats;
use crate::error::Result;
use crate::scene::Settings;

/// Settings that the program chooses, and chooses again where they were not enough.
pub(super) struct Choosing<'a> {
    /// As given.
    pub args: &'a RenderArgs,
    /// The settings before.
    pub base: &'a Settings,
    /// Where it looks and renders.
    pub site: &'a Site<'a>,
}

impl Choosing<'_> {
    /// The choice to begin with, rank 0's; `None` where nothing is to be chosen. All ranks call it.
    pub fn first(&self, request: &Request, tracer: &str) -> Result<Option<Choice>> {
        if !self.args.choice.is_any() {
            return Ok(None);
        }
        let start = self.site.clock.start;
        let choose = || self.ask(request, |chooser| chooser.choose(start, tracer));
        // Ranks that wait for the choice hear from rank 0 that the job is to stop.
        self.site.interrupt.watched(|| self.site.world.from_root(choose)).map(Some)
    }

    /// A tighter choice where `choice` was not enough. All ranks call it.
    pub fn next(
        &self,
        job: &Frames,
        round: &Round,
        choice: Option<Choice>,
    ) -> Result<Option<Choice>> {
        let Some(choice) = choice else { return Ok(None) };
        // A list of one or none: to other ranks, nothing would look like no answer.
        let judge = || -> Result<Vec<Choice>> {
            if round.plan.render.is_empty() {
                return Ok(Vec::new());
            }
            let audit = stats::audit_of(&round.plan, &round.outcome);
            let seconds = round.plan.kept.is_empty().then_some(round.seconds);
            let judge = |chooser: &Chooser| chooser.judge(&choice, audit.as_ref(), seconds);
            Ok(self.ask(job.request, judge)?.into_iter().collect())
        };
        let tighter = self.site.interrupt.watched(|| self.site.world.from_root(judge))?;
        Ok(tighter.into_iter().next())
    }

    fn ask<T>(&self, request: &Request, question: impl Fn(&Chooser) -> Result<T>) -> Result<T> {
        let stage = Stage {
            scene: &request.scene,
            otherwise: None,
            shot: &request.shot,
            base: self.base,
            intersector: self.site.intersector,
            build_seconds: self.site.clock.build_seconds(),
            pool: self.site.pool,
            stop: &self.site.interrupt.stop,
        };
        question(&Chooser {
            args: &self.args.choice,
            options: &self.args.settings,
            stage: &stage,
            request,
            ranks: self.site.world.size(),
            quiet: self.site.quiet,
        })
    }
}
