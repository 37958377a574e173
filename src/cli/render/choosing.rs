//! Settings that the program chooses: rank 0 chooses for all ranks.

use super::RenderArgs;
use super::round::{RenderJob, Round};
use super::site::Site;
use crate::accuracy::{Timer, Timing, TrialContext};
use crate::cli::choose::{Choice, Chooser, Judgement};
use crate::cli::request::Request;
use crate::cli::stats;
use crate::error::{Error, Result};
use crate::output::manifest::{Header, Manifest, manifest_path};
use crate::sequence::Target;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::cell::Cell;

/// Messages of rank 0 to the other ranks.
#[derive(Serialize, Deserialize)]
enum Word<T> {
    /// All ranks time this setting at the same time.
    Time(Timing),
    /// The answer.
    Answer(T),
}

/// The choice of settings, and a tighter choice after a missed target.
pub(super) struct Choosing<'a> {
    /// The command's arguments.
    pub args: &'a RenderArgs,
    /// The job, with its settings before the choice.
    pub request: &'a Request,
    /// Ranks, threads and intersector.
    pub site: &'a Site<'a>,
}

impl Choosing<'_> {
    /// Rank 0's first choice; `None` if there is nothing to choose. All ranks call it.
    pub fn first(&self) -> Result<Option<Choice>> {
        if !self.args.choice.is_any() {
            return Ok(None);
        }
        self.answer(|chooser, timer| chooser.choose(timer)).map(Some)
    }

    /// The judgement of `choice` after rendering, with a tighter choice if the target was missed; `None` if
    /// nothing was chosen or frames are missing. All ranks call it.
    pub fn next(
        &self,
        job: &RenderJob,
        round: &Round,
        choice: Option<Choice>,
    ) -> Result<Option<Judgement>> {
        let Some(choice) = choice.filter(|_| round.unfinished == 0) else { return Ok(None) };
        let (shot, frames) = (&job.target.header.shot_hash, self.request.frames);
        let judge = |chooser: &Chooser, timer: Timer| {
            let choice = choice.clone();
            // A job that was stopped while it was held against what came out is not done with that.
            if round.plan.render.is_empty() && choice.is_checked(shot, frames) {
                return Ok(Judgement::Done(choice));
            }
            let audit = stats::audit_of(&round.plan, &round.outcome);
            let seconds = round.plan.kept.is_empty().then_some(round.seconds);
            Ok(match chooser.judge(choice, audit.as_ref(), seconds, timer)? {
                Judgement::Done(choice) => {
                    let choice = choice.checked(shot, frames);
                    keep(&job.target, &choice)?;
                    Judgement::Done(choice)
                }
                again => again,
            })
        };
        self.answer(judge).map(Some)
    }

    /// Rank 0's answer to `question`, on all ranks. Meanwhile the other ranks time settings when rank 0 asks
    /// for it. All ranks call it.
    fn answer<T: Serialize + DeserializeOwned>(
        &self,
        question: impl Fn(&Chooser, Timer) -> Result<T>,
    ) -> Result<T> {
        let Site { comm, interrupt, .. } = self.site;
        match comm.is_root() {
            true => interrupt.watched(|| self.lead(question)),
            // Who waits for the answer cannot tell rank 0, which looks at nothing but its trials: where it
            // alone is asked to stop, it ends the job, of which nothing is in hand.
            false => self.follow(),
        }
    }

    fn lead<T: Serialize + DeserializeOwned>(
        &self,
        question: impl Fn(&Chooser, Timer) -> Result<T>,
    ) -> Result<T> {
        let comm = self.site.comm;
        // Of a trial that failed all ranks have heard.
        let is_over = Cell::new(false);
        let timer = |timing: &Timing| {
            let told = comm.from_root(|| Ok(Word::<T>::Time(timing.clone())));
            let seconds = told.and_then(|_| self.time(timing));
            is_over.set(seconds.is_err());
            seconds
        };
        let answer = self.ask(|chooser| question(chooser, &timer));
        if is_over.get() {
            return answer;
        }
        match comm.from_root(|| answer.map(Word::Answer))? {
            Word::Answer(answer) => Ok(answer),
            Word::Time(_) => Err(Error::Failed("rank 0 gave no answer".into())),
        }
    }

    fn follow<T: Serialize + DeserializeOwned>(&self) -> Result<T> {
        let nothing = || Err(Error::Failed("only rank 0 answers".into()));
        loop {
            match self.site.comm.from_root(nothing)? {
                Word::Answer(answer) => return Ok(answer),
                Word::Time(timing) => _ = self.time(&timing)?,
            }
        }
    }

    /// Seconds per frame of a rank when all ranks render at once: the inverse of their mean frames per second.
    fn time(&self, timing: &Timing) -> Result<f64> {
        let comm = self.site.comm;
        let own = self.ask(|chooser| chooser.probe().timed(timing));
        let all = comm.all_gather(comm.agree(own)?)?;
        let made: f64 = all.iter().map(|seconds| 1.0 / seconds.max(1e-12)).sum();
        Ok(all.len() as f64 / made)
    }

    fn ask<T>(&self, question: impl Fn(&Chooser) -> Result<T>) -> Result<T> {
        let (request, site) = (self.request, self.site);
        let context = TrialContext {
            scene: &request.scene,
            otherwise: None,
            shot: &request.shot,
            base: &request.settings,
            intersector: &*site.intersector,
            build_seconds: site.clock.build_seconds(),
            pool: &site.pool,
            stop: &site.interrupt.stop,
        };
        question(&Chooser {
            args: &self.args.choice,
            options: &self.args.settings,
            context: &context,
            request,
            tracer: &site.tracer,
            started: site.clock.start,
            ranks: site.comm.size(),
            quiet: site.quiet,
        })
    }
}

/// Writes the present state of the choice into the manifest.
fn keep(target: &Target, choice: &Choice) -> Result<()> {
    let path = manifest_path(&target.pattern);
    Manifest::merge_parts(&path, &target.header)?;
    Manifest::rewrite(&path, |found| {
        let header = Header { chosen: Some(choice.value()), ..found.header };
        (header, found.rows.into_values().collect())
    })
}
