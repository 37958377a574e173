//! Inference of light from points that were traced in other frames. Never traces.
//!
//! A [`Reference`] holds a frame's camera and the surface points that were traced for it, with their
//! ratios. A [`Lookup`] estimates ratios from several references. [`Judged`] answers with those
//! estimates that the [`evidence`] allows, and leaves the others unknown, so that they are traced. Only
//! traced points are sources, so errors do not add up however many frames are inferred. [`store`] keeps
//! a reference in a file. [`audit`] estimates the error of inferred pixels from traces of a few of
//! them. Coordinates are in scene space.

pub mod audit;
mod check;
pub mod colour;
mod columns;
mod cost;
pub mod evidence;
mod index;
mod lookup;
mod probe;
mod reference;
mod risk;
pub mod store;
mod taps;

pub use cost::{
    Gains, LookedUp, LookupReason, channels, could_be_worth_lookups, lookup_reasons, of_frame,
};
pub use lookup::{Judged, Lookup, LookupChannel};
pub use probe::{PARTS, Probe, ProbeDraw};
pub use reference::Reference;
