//! Writing films to files, each whole or absent: png, exr, ppm, the manifest, the preview video; and
//! reading pictures from files, for comparison.
//!
//! * [`write_image`] writes a film in the [`Format`] that the file's ending names and returns the
//!   bytes' hash; [`WriteOptions`] holds exposure, tone curve and what the file says about itself.
//! * [`FramePattern`] turns `out/frame_####.png` and a frame number into a path.
//! * [`atomic`] writes every file under a temporary name, syncs it and renames it.
//! * [`SequenceLock`] keeps jobs of other settings out of a sequence while one renders it.
//! * [`PathKind`] distinguishes a regular file from pipes, devices and folders, which must not be read.
//! * [`read_image`] reads png, ppm, jpeg, hdr and exr within a memory limit; [`exr`] reads and
//!   writes any channels.
//! * [`manifest`] lists the finished frames of a sequence.
//! * [`maps`] paints where a frame's light comes from.
//! * [`video`] lets ffmpeg make an mp4 of a sequence.
//!
//! png and ppm hold display values: exposure, tone curve, then 8 or 16 bits. exr holds linear
//! radiance as rendered, without exposure, in f32 throughout: half floats have 11 bits, and
//! comparisons here go down to 1e-5.
//!
//! Not done: cropped files' data windows; exr compressions other than ZIP when writing.

pub mod atomic;
pub(crate) mod child;
mod display;
pub mod exr;
mod format;
mod lock;
pub mod manifest;
pub mod maps;
mod path_kind;
mod pattern;
mod png;
mod quantise;
mod read;
pub mod video;
mod write;

pub use atomic::Written;
pub use display::Display;
pub use format::{Format, VERSION, WriteOptions};
pub use lock::SequenceLock;
pub use path_kind::{PathKind, Regular};
pub use pattern::FramePattern;
pub use read::{DEFAULT_MEMORY_LIMIT, read_image, read_image_within};
pub use write::write_image;
