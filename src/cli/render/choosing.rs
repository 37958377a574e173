//! Settings that the program chooses: by rank 0, for all.

use super::RenderArgs;
use super::round::{Frames, Round, Site};
use crate::accuracy::{Timer, Timing, TrialContext};
use crate::cli::choose::{Choice, Chooser, Judged};
use crate::cli::request::Request;
use crate::cli::stats;
use crate::error::{Error, Result};
use crate::output::manifest::{Header, Manifest, manifest_path};
use crate::scene::Settings;
use crate::sequence::Target;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::cell::Cell;

/// What rank 0 says to the others.
#[derive(Serialize, Deserialize)]
enum Word<T> {
    /// That all are to time this setting, at once.
    Time(Timing),
    /// What it was asked for.
    Answer(T),
}

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
        self.answer(request, |chooser, timer| chooser.choose(tracer, timer)).map(Some)
    }

    /// What came of `choice`, and a tighter one where it was not enough; `None` where nothing was chosen.
    /// All ranks call it.
    pub fn next(
        &self,
        job: &Frames,
        round: &Round,
        choice: Option<Choice>,
    ) -> Result<Option<Judged>> {
        let Some(choice) = choice else { return Ok(None) };
        let (shot, frames) = (&job.target.header.shot_hash, job.request.frames);
        let judge = |chooser: &Chooser, timer: Timer| {
            let choice = choice.clone();
            // A job that was stopped while it was held against what came out is not done with that.
            if round.plan.render.is_empty() && choice.is_checked(shot, frames) {
                return Ok(Judged::Done(choice));
            }
            let audit = stats::audit_of(&round.plan, &round.outcome);
            let seconds = round.plan.kept.is_empty().then_some(round.seconds);
            Ok(match chooser.judge(choice, audit.as_ref(), seconds, timer)? {
                Judged::Done(choice) => {
                    let choice = choice.checked(shot, frames);
                    keep(job.target, &choice)?;
                    Judged::Done(choice)
                }
                again => again,
            })
        };
        self.answer(job.request, judge).map(Some)
    }

    /// Rank 0's answer to `question`, for all ranks, which meanwhile time what it wants timed. All ranks
    /// call it.
    fn answer<T: Serialize + DeserializeOwned>(
        &self,
        request: &Request,
        question: impl Fn(&Chooser, Timer) -> Result<T>,
    ) -> Result<T> {
        let Site { comm, interrupt, .. } = self.site;
        match comm.is_root() {
            true => interrupt.watched(|| self.lead(request, question)),
            // Who waits for the answer cannot tell rank 0, which looks at nothing but its trials: where it
            // alone is asked to stop, it ends the job, of which nothing is in hand.
            false => self.follow(request),
        }
    }

    fn lead<T: Serialize + DeserializeOwned>(
        &self,
        request: &Request,
        question: impl Fn(&Chooser, Timer) -> Result<T>,
    ) -> Result<T> {
        let comm = self.site.comm;
        // Of a trial that failed all ranks have heard.
        let is_over = Cell::new(false);
        let timer = |timing: &Timing| {
            let told = comm.from_root(|| Ok(Word::<T>::Time(timing.clone())));
            let seconds = told.and_then(|_| self.time(request, timing));
            is_over.set(seconds.is_err());
            seconds
        };
        let answer = self.ask(request, |chooser| question(chooser, &timer));
        if is_over.get() {
            return answer;
        }
        match comm.from_root(|| answer.map(Word::Answer))? {
            Word::Answer(answer) => Ok(answer),
            Word::Time(_) => Err(Error::Failed("rank 0 gave no answer".into())),
        }
    }

    fn follow<T: Serialize + DeserializeOwned>(&self, request: &Request) -> Result<T> {
        let nothing = || Err(Error::Failed("only rank 0 answers".into()));
        loop {
            match self.site.comm.from_root(nothing)? {
                Word::Answer(answer) => return Ok(answer),
                Word::Time(timing) => _ = self.time(request, &timing)?,
            }
        }
    }

    /// Seconds a frame of a rank, when all try at once; the mean of how many they make in a second.
    fn time(&self, request: &Request, timing: &Timing) -> Result<f64> {
        let comm = self.site.comm;
        let own = self.ask(request, |chooser| chooser.probe().timed(timing));
        let all = comm.all_gather(comm.agree(own)?)?;
        let made: f64 = all.iter().map(|seconds| 1.0 / seconds.max(1e-12)).sum();
        Ok(all.len() as f64 / made)
    }

    fn ask<T>(&self, request: &Request, question: impl Fn(&Chooser) -> Result<T>) -> Result<T> {
        let context = TrialContext {
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
            context: &context,
            request,
            started: self.site.clock.start,
            ranks: self.site.comm.size(),
            quiet: self.site.quiet,
        })
    }
}

/// Writes into the manifest what is known of the choice now.
fn keep(target: &Target, choice: &Choice) -> Result<()> {
    let path = manifest_path(&target.pattern);
    Manifest::merge_parts(&path, &target.header)?;
    Manifest::rewrite(&path, |found| {
        let header = Header { chosen: Some(choice.value()), ..found.header };
        (header, found.rows.into_values().collect())
    })
}
