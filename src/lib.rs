//! tweenray renders every frame of a camera move through one static scene.
//!
//! The rooms stand on floors, and a room imports only from lower floors
//! (`docs/architecture.md`; `tests/layering.rs` enforces it). The library never prints and never
//! exits: it returns data and [`error::Error`]s, and `cli` alone talks to a person.

// Floor 0: numbers and plain records.
pub mod error;
pub mod math;
pub mod ray;
pub mod sampling;
pub mod stats;

// Floor 1: the only room with `unsafe`.
#[allow(unsafe_code)]
pub mod embree;

// Floor 2: plain data.
pub mod film;
pub mod scene;

// Floor 3: what makes scenes, hits, files and measurements.
pub mod effects;
pub mod import;
pub mod inference;
pub mod intersect;
pub mod measure;
pub mod output;
pub mod page;

// Floor 4: radiance along a ray; what earlier rays found.
pub mod reuse;
pub mod shade;

// Floor 5: one frame after another; one intersector against the other, by the renderer's rays.
pub mod sequence;
pub mod verify;

// Floor 6: who renders which frames; settings side by side.
pub mod accuracy;
pub mod cluster;

// Floor 7: the command line.
pub mod cli;
