//! glTF files: what is read of them, in numbers, and what is refused, with its place.

#![allow(clippy::expect_used)]

mod bad;
mod build;
mod camera;
mod geometry;
mod lights;
mod materials;
mod moving;
mod mutations;
mod samples;
mod uv_sets;
