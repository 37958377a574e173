//! Light of frames inferred from what was traced in others. Never traces.
//!
//! A [`Reference`] holds a frame's camera and the surface points that were traced for it, with their
//! ratios. A [`Lookup`] answers from several of them, with evidence: what it cannot vouch for it
//! leaves unknown, and that is traced. Only traced points are sources, so nothing blurs or drifts
//! however many frames are inferred. [`store`] keeps a reference in a file.
//! [`audit`] judges inferred pixels by traces of a few of them.
//! All in scene space.

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

pub use cost::{LookupReason, channels, is_worth_lookups, lookup_reasons, of_frame, rays_of};
pub use lookup::{Judged, Lookup};
pub use probe::{PARTS, Probe, ProbeDraw};
pub use reference::Reference;
