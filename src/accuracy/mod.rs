//! What accuracy costs in time, on the user's own scene.
//!
//! [`Sweep`] renders some frames at a converged reference and at every [`Candidate`], in turns, and
//! gives [`Measured`]: errors against times, from which the program can also be asked for the fastest
//! setting that reaches an error, or the best one within a time.
//!
//! Errors are those of display values, as a screen shows them, in display steps of 1/255. Times are
//! seconds per frame of the whole move: key frames cost more than in-between frames, so each kind is
//! timed and weighed by how many of it the move has.
//!
//! [`SettingsProbe`] traces a few pixels and small frames instead. A [`Predictor`] made from these predicts the
//! error and the time of any setting, and the program chooses one; [`CheckOutcome`] measures afterwards how good
//! the frames came out. That choice is the only thing in the program that depends on measured times.
//!
//! A [`Ledger`] keeps the measurements of a sweep on disk, trial by trial, so that a sweep that was
//! stopped or killed goes on.

mod candidates;
mod change;
mod check;
mod choice;
mod context;
mod denoiser;
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
mod row;
mod search;
mod sentences;
mod sweep;
mod table;
mod timing;
mod trial;
mod worst;
mod writing;

pub use candidates::candidates;
pub use check::{CheckOutcome, CheckedFrame, Verdict};
pub use choice::{Goal, best_within, fastest_reaching, perhaps_faster};
pub use context::TrialContext;
pub use denoiser::Denoiser;
pub use effort::Effort;
pub use error_model::SampleCounts;
pub use errors::{Errors, displayed_rgb};
pub use frames::chosen_frames;
pub use knobs::{Candidate, Group, Knob};
pub use ledger::{Ledger, TrialRecord};
pub use oracle::{OracleCrop, on_a_crop};
pub use predictor::{Prediction, Predictor};
pub use probe::{FixedSettings, SettingsProbe};
pub use reference::{Convergence, Doubling, Step, Truth, truth_settings};
pub use row::{CandidateRow, Spread};
pub use sentences::{about_knob, about_oracle, about_writing};
pub use sweep::{CandidatePicture, Sweep, SweepProgress};
pub use table::Measured;
pub use timing::{Timer, Timing};
pub use writing::{Writing, on_disk};
