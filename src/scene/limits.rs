//! Ranges of settings: the same in scene files and on the command line.

use std::ops::RangeInclusive;

/// Most image columns or rows.
pub const MAX_EDGE: u32 = 32_768;
/// Most samples of one kind.
pub const MAX_SAMPLES: u32 = 65_536;
/// Most specular bounces.
pub const MAX_BOUNCES: u32 = 1024;
/// Most discoveries that a message between ranks may carry.
pub const MAX_EXCHANGE: u32 = 1_000_000_000;
/// Most rendering threads.
pub const MAX_THREADS: u32 = 4096;
/// The largest seed: the largest whole number that TOML has.
pub const MAX_SEED: u64 = i64::MAX as u64;
/// Lengths and factors, exposure among them.
pub const FACTOR: RangeInclusive<f64> = 1e-30..=1e30;
/// Shares of a whole.
pub const SHARE: RangeInclusive<f64> = 0.0..=1.0;
/// Most frames of a segment.
pub const MAX_SEGMENT: u32 = 1_000_000;
/// Differences in display steps of 1/255.
pub const STEPS: RangeInclusive<f64> = 0.0..=255.0;
/// Differences in linear colour, and shares that may exceed the whole.
pub const AMOUNT: RangeInclusive<f64> = 0.0..=1e30;
/// Instruction sets that Embree has kernels for, narrow to wide.
pub const ISAS: [&str; 5] = ["sse2", "sse4.2", "avx", "avx2", "avx512"];
/// Moments of an animation, seconds.
pub const TIME: RangeInclusive<f64> = -1e9..=1e9;
/// Frames per second of a video.
pub const FPS: RangeInclusive<f64> = 1.0..=1000.0;
