//! Cases that break ray tracers, one file per letter: each in its small size, as a test.
//! `./x stress` runs them in full.

#![allow(clippy::unwrap_used)]

mod a_intersection;
mod b_spawned_rays;
mod c_shading;
#[path = "../common/mod.rs"]
mod common;
mod f_statistics;
mod shapes;
mod suite;
