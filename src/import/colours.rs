//! Vertex colours as mesh files have them.
//!
//! Whole numbers and fractions alike are sRGB: programs that write fractions divide the same codes by 255, and Blender, three.js
//! and MeshLab read them so.

/// The note on colours that are no shares.
pub(super) const STRAYED: &str = "vertex colours outside of 0 to 1 (whole numbers: 0 to 255, `ushort` to 65535) were cut to that";

/// Whether a colour lies outside of what can be reflected. What is no number does not.
pub(super) fn strays(colour: &[f32; 3]) -> bool {
    colour.iter().any(|c| *c < 0.0 || *c > 1.0)
}
