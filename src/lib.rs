//! tweenray renders every frame of a camera move through one static scene.
//!
//! Key frames are traced, by [Embree](https://www.embree.org) with every hit checked in f64; in the
//! frames between, shadowing is inferred from other frames where probes vouch for it. The same scene and
//! settings give the same bytes on any number of threads.
//!
//! # Where to begin
//!
//! `examples/` in the repository, in order, each under 60 lines; `cargo run --example` and the name runs one:
//!
//! 1. `1_one_frame`: a [`scene::World`] that is built in code, a [`scene::Camera`], one frame of a
//!    [`shade::Renderer`], a png by [`output::write_image`];
//! 2. `2_trace_and_compare`: rays through [`intersect::EmbreeIntersector`], held against the f64
//!    [`intersect::Oracle`];
//! 3. `3_sequence_with_reuse`: a [`scene::Shot`] by [`sequence::SurfaceReuse`], and what its audit
//!    ([`reuse::audit`]) says of it;
//! 4. `4_data_set`: depth, normals and mesh numbers for the poses of a NeRF or COLMAP data set.
//!
//! Scene files and meshes are read by [`import::load`]; pictures are compared by [`measure::compare`].
//!
//! # Rooms
//!
//! | room | what it holds |
//! |---|---|
//! | [`cli`] | the command line: one file a subcommand |
//! | [`accuracy`] | what accuracy costs in time |
//! | [`cluster`] | which process renders which frames |
//! | [`verify`] | Embree against the oracle on the user's own scene |
//! | [`sequence`] | one frame after another |
//! | [`shade`] | radiance along camera rays |
//! | [`reuse`] | what traced frames tell about others |
//! | [`inference`] | what shading asks about a surface point, and what reuse answers |
//! | [`intersect`] | the [`intersect::Intersector`] trait, Embree and the oracle behind it |
//! | [`effects`] | what a scene calls for |
//! | [`import`] | files to a world |
//! | [`output`] | films to files, and pictures back |
//! | [`measure`] | how far two pictures are apart, and how sure a figure is |
//! | [`page`] | self-contained HTML |
//! | [`scene`] | meshes, materials, lights, camera move, settings |
//! | [`film`] | images and what else a pixel records |
//! | [`embree`] | Embree behind a safe face |
//! | [`math`], [`ray`], [`sampling`], [`stats`], [`error`] | numbers and plain records |
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

// Floor 1: the room with most of the `unsafe` code; the rest is at the edge to MPI.
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
