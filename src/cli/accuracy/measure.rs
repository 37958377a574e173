//! Measuring a sweep, resuming it, and writing its page.

use super::line::ProgressLine;
use super::{AccuracyArgs, Outcome, files, page};
use crate::accuracy::{
    self, Convergence, Denoiser, Ledger, OracleCrop, Step, Sweep, SweepProgress, Truth, Writing,
};
use crate::cli::exit::Exit;
use crate::cli::progress::duration;
use crate::cli::signals::Interrupt;
use crate::cli::{machine, say};
use crate::effects::EffectPlan;
use crate::error::{Error, Result, counted};
use crate::output::atomic;
use crate::scene::Settings;
use std::cell::Cell;
use std::time::Instant;

/// Name of the oracle's figures in the ledger.
const ORACLE: &str = "oracle.json";
/// Name of the figures of writing.
const WRITING: &str = "writing.json";
/// Name of the machine's load during the last run that measured.
const LOAD: &str = "load.json";

/// A sweep to be measured and reported.
pub struct SweepJob<'a> {
    pub args: &'a AccuracyArgs,
    pub sweep: &'a Sweep<'a>,
    pub interrupt: &'a Interrupt,
    pub line: ProgressLine,
    pub oracle_was_wanted: bool,
    pub writing_is_wanted: bool,
    /// Whether denoised frames are left out since there is no denoiser.
    pub lacks_denoiser: bool,
    /// Load of the machine over the minute before the start.
    pub load: Option<f64>,
    /// When the program began.
    pub start: Instant,
}

impl SweepJob<'_> {
    /// Measures all trials that `ledger` lacks, and writes the page.
    pub fn run(&self, mut ledger: Ledger) -> Result<Exit> {
        self.greet(&ledger);
        let measured = self.interrupt.watched(|| self.measure(&mut ledger));
        self.line.finish();
        match measured {
            Ok(()) => {
                self.tell(&ledger)?;
                Ok(Exit::Done)
            }
            Err(Error::Stopped) => self.take_leave(&ledger),
            Err(other) => Err(other),
        }
    }

    fn greet(&self, ledger: &Ledger) {
        let sweep = self.sweep;
        let (done, of) = (sweep.done(ledger), sweep.trials());
        self.line.note(&format!(
            "{} on {}, {}",
            counted(sweep.candidates.len(), "setting"),
            counted(sweep.frames.len(), "frame"),
            counted(of, "trial")
        ));
        if done == of {
            self.line.note(
                "every trial is measured; --overwrite measures anew, more --turns extend the sweep",
            );
        } else if done > 0 {
            let text =
                format!("going on: {done} of {of} trials are measured; --overwrite measures anew");
            self.line.note(&text);
        }
    }

    fn measure(&self, ledger: &mut Ledger) -> Result<()> {
        // First: whoever is out of patience loses no sweep.
        if self.oracle_was_wanted && ledger.note::<Option<OracleCrop>>(ORACLE).is_none() {
            self.line.tell("the oracle, on a crop", 0.0, None);
            let crop = accuracy::on_a_crop(self.sweep.context, self.sweep.shown_frame())?;
            ledger.keep_note(ORACLE, &crop)?;
        }
        if self.writing_is_wanted && ledger.note::<Writing>(WRITING).is_none() {
            self.line.tell("writing frames and checkpoints", 0.0, None);
            let writing = accuracy::on_disk(self.sweep.context, &self.args.output.join("sweep"))?;
            ledger.keep_note(WRITING, &writing)?;
        }
        let truth = self.truth(ledger)?;
        let last_turn = Cell::new(None);
        let mut hear = |heard: SweepProgress| {
            self.heard(&heard);
            // After each turn: whoever kills the program has a page of what there was.
            if last_turn.replace(Some(heard.turn)).is_some_and(|turn| turn != heard.turn) {
                self.publish(&truth, heard.ledger)?;
            }
            Ok(())
        };
        self.sweep.run(&truth, ledger, &mut hear)
    }

    fn heard(&self, heard: &SweepProgress) {
        let SweepProgress { done, of, turn, candidate, left, .. } = heard;
        let turn = if *turn == 0 { "warm-up".into() } else { format!("turn {turn}") };
        let name = candidate.name();
        let text = format!("{} of {of}  {turn}  {name}", (done + 1).min(*of));
        let share = left.map_or(0.0, |left| self.line.seconds() / (self.line.seconds() + left));
        self.line.tell(&text, share, *left);
    }

    /// Renders the rest of the reference that is not on disk yet.
    fn truth(&self, ledger: &Ledger) -> Result<Truth> {
        let (last, wanted) = match ledger.reference() {
            Some((last, wanted)) => (Some(last), wanted),
            None => {
                self.line.tell("noise of the setting with the most samples", 0.0, None);
                (None, self.sweep.least_noise()? / 4.0)
            }
        };
        let settings: Vec<&Settings> = self.sweep.candidates.iter().map(|c| &c.settings).collect();
        let convergence = Convergence {
            context: self.sweep.context,
            settings: accuracy::truth_settings(self.sweep.context.base, &settings),
            frames: self.sweep.frames,
            wanted,
            most: self.args.reference_spp,
        };
        let start = Cell::new(Instant::now());
        let mut hear = |step: Step| match step {
            Step::Frame { settings, k, of } => {
                if k == 0 {
                    start.set(Instant::now());
                }
                if k == 0 || self.line.is_drawn() {
                    let samples = settings.camera_samples();
                    let text =
                        format!("reference: {samples} camera samples, frame {} of {of}", k + 1);
                    self.line.tell(&text, 0.0, None);
                }
                Ok(())
            }
            Step::Doubled(doubling) => {
                ledger.keep_reference(doubling, wanted)?;
                let seconds = start.get().elapsed().as_secs_f64();
                let change = doubling.change.map_or(String::new(), |change| {
                    format!(", {change:.3}/255 from the one before; goal {wanted:.3}")
                });
                // Each doubling takes at most twice the time of the one before.
                let more = self.args.reference_spp / doubling.spp.max(1);
                let most = (f64::from(more.max(1)).log2().floor().exp2() - 1.0) * 2.0 * seconds;
                let most = match convergence.is_done(doubling) {
                    true => String::new(),
                    false => format!("; at most {} more", duration(most)),
                };
                let samples = convergence.settings_of(doubling.number).camera_samples();
                self.line.note(&format!("reference: {samples} camera samples{change}{most}"));
                Ok(())
            }
        };
        convergence.run(last, &mut hear)
    }

    /// The results so far; `None` before the default was timed.
    fn outcome<'o>(&'o self, truth: &'o Truth, ledger: &Ledger) -> Option<Outcome<'o>> {
        let sweep = self.sweep;
        let (measured, pictures) = sweep.measured(ledger)?;
        Some(Outcome {
            truth,
            measured,
            pictures,
            oracle: ledger.note(ORACLE).flatten(),
            oracle_was_wanted: self.oracle_was_wanted,
            denoiser: sweep.denoiser.map(Denoiser::describe),
            lacks_denoiser: self.lacks_denoiser,
            writing: ledger.note(WRITING).filter(|_| self.writing_is_wanted),
            shown_frame: sweep.shown_frame(),
            frames: sweep.frames,
            shot_frames: sweep.context.shot.frames,
            threads: sweep.context.pool.current_num_threads(),
            tracer: sweep.context.intersector.describe(),
            load: self.load_of(ledger),
            seconds: ledger.is_running().then(|| self.start.elapsed().as_secs_f64()),
            runs: ledger.runs(),
            trials: [sweep.done(ledger), sweep.trials()],
            settings: sweep.candidates.len(),
            base: sweep.context.base,
            plan: EffectPlan::of(sweep.context.scene, sweep.context.base),
            turns: sweep.turns,
        })
    }

    /// Load of the machine before and after the last run that measured.
    fn load_of(&self, ledger: &Ledger) -> [Option<f64>; 2] {
        match ledger.is_running() {
            true => [self.load, machine::load()],
            false => ledger.note(LOAD).unwrap_or_default(),
        }
    }

    /// Writes the page and the figures of the results so far; returns the page's summary.
    fn publish(&self, truth: &Truth, ledger: &Ledger) -> Result<Option<Vec<String>>> {
        let Some(outcome) = self.outcome(truth, ledger) else { return Ok(None) };
        if ledger.is_running() {
            ledger.keep_note(LOAD, &outcome.load)?;
        }
        let command = crate::cli::words();
        files::write(self.args, &outcome, &command)?;
        let page = page::page(self.args, &outcome, &command)?;
        let html = page.to_html()?;
        atomic::write(self.report(), |w| w.write_all(html.as_bytes()))?;
        Ok(Some(page.summary.into_iter().chain(page.warnings).collect()))
    }

    fn report(&self) -> std::path::PathBuf {
        self.args.output.join("report.html")
    }

    /// Writes the page of the results so far and prints its summary; false if there are none.
    fn tell(&self, ledger: &Ledger) -> Result<bool> {
        // It converged, or was as near as it may come: nothing is rendered.
        let truth = self.truth(ledger)?;
        let Some(summary) = self.publish(&truth, ledger)? else { return Ok(false) };
        if !self.args.quiet {
            summary.iter().try_for_each(say::result)?;
            let seconds = self.start.elapsed().as_secs_f64();
            say::result(format!("{}, in {}", self.report().display(), duration(seconds)))?;
        }
        Ok(true)
    }

    /// Writes the page of the results so far when the sweep was asked to stop.
    fn take_leave(&self, ledger: &Ledger) -> Result<Exit> {
        let (done, of) = (self.sweep.done(ledger), self.sweep.trials());
        let is_told = done > 0 && self.tell(ledger)?;
        if !self.args.quiet {
            let page = if is_told { "" } else { " (too few for a page)" };
            say::aside(format!(
                "stopped{}: {done} of {of} trials are measured{page}; the same command goes on",
                self.interrupt.reason()
            ));
        }
        Ok(Exit::Stopped)
    }
}
