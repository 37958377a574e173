//! Films to files, each whole or absent: png, exr, ppm, the manifest, the preview video.

mod manifest;
