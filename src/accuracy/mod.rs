//! What accuracy costs in time, on the user's own scene.
//!
//! [`Sweep`] renders some frames at a converged reference and at every [`Candidate`], in turns, and
//! gives [`Measured`]: errors against times, from which the program can also be asked for the fastest
//! setting that reaches an error, or the best one within a time.
//!
//! Errors are those of display values: what is seen on a screen, in steps of 1/255. Times are seconds
//! per frame of the whole move: key frames cost more than the frames between, so each kind is timed
//! and weighed by how many of it the move has.
//!
//! [`Probe`] takes a quick look instead, from which the error and the time of any setting are predicted
//! ([`Predictor`]), and the program chooses one; [`Check`] says afterwards what came out.
//!
//! Only that choice is decided by measured times; the sweep only tells them.
//!
//! A [`Ledger`] keeps what was measured on disk, trial by trial, so that a sweep that was stopped or
//! killed goes on.
//!
//! Not done: knobs that the program does not have (adaptive sampling, texture filters).

mod candidates;
mod check;
mod choice;
mod context;
mod draw;
mod effort;
mod error_model;
mod errors;
mod figures;
mod fit;
mod frames;
mod front;
mod knobs;
mod ledger;
mod modes;
mod oracle;
mod patches;
mod predictor;
mod probe;
mod reference;
mod search;
mod sentences;
mod sweep;
mod table;
mod timing;
mod trial;
mod worst;
mod writing;

pub use candidates::candidates;
pub use check::{Check, CheckedFrame, Verdict};
pub use choice::{Goal, best_within, fastest_reaching, perhaps_faster};
pub use context::TrialContext;
pub use effort::Effort;
pub use error_model::Samples;
pub use errors::{Errors, displayed_rgb};
pub use frames::chosen_frames;
pub use knobs::{Candidate, Group, Knob};
pub use ledger::{Ledger, TrialRecord};
pub use oracle::{OracleCrop, on_a_crop};
pub use predictor::{Prediction, Predictor, SampleRange};
pub use probe::{GivenOptions, Probe};
pub use reference::{Convergence, Doubling, Step, Truth, truth_settings};
pub use sentences::{about_knob, about_oracle, about_writing};
pub use sweep::{Picture, Sweep, SweepProgress};
pub use table::{Measured, Row, Spread};
pub use timing::{Timer, Timing};
pub use writing::{Writing, on_disk};
