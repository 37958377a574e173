//! Cases that break ray tracers, one file per letter: each in its small size, as a test.
//! `./x stress` runs them in full.

#![allow(clippy::unwrap_used)]

mod a_intersection;
mod b_spawned_rays;
mod c_shading;
#[path = "../common/mod.rs"]
mod common;
mod d_reuse;
mod f_statistics;
#[path = "../common/moves.rs"]
mod moves;
mod shapes;
#[path = "../common/sharpness.rs"]
mod sharpness;
#[allow(dead_code, missing_docs, reason = "the audit's tests use all of it")]
#[path = "../audit/shots.rs"]
mod shots;
mod suite;
