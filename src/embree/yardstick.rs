//! The yardstick of the benchmarks: a bare C loop on Embree (`ffi/bare_loop.c`).
//!
//! The renderer never uses it.

use super::{CommittedScene, sys};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// A camera in scene space, f32, as `ffi/shim.h` lays it out; the vectors are those of
/// `scene::Camera`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BareCamera {
    /// Eye point.
    pub eye: Vec3,
    /// Unit view direction.
    pub forward: Vec3,
    /// Half the image's width at distance 1, to the right.
    pub half_right: Vec3,
    /// Half the image's height at distance 1, upwards.
    pub half_up: Vec3,
    /// Image columns, a multiple of 8.
    pub width: u32,
    /// Image rows, a multiple of 8.
    pub height: u32,
}

/// The results of the loop, so that the compiler cannot drop its work.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BareTally {
    /// Rays that hit.
    pub hits: u64,
    /// Sum of the hits' ray parameters.
    pub sum_of_t: f64,
}

const _: () = assert!(size_of::<BareCamera>() == 56);

unsafe extern "C" {
    fn tr_bare_camera_loop(scene: sys::RTCScene, camera: *const BareCamera) -> BareTally;
}

impl CommittedScene<'_> {
    /// Traces one ray through the middle of each pixel of `camera` in packets of 8: no checks, no
    /// f64, no rules. The rays go in the order in which the renderer's blocks send them.
    ///
    /// Errors: image edges that are not multiples of 8, an instruction set without packets of 8,
    /// a scene with analytic spheres or with holes (they need the f64 rays that this loop does not have).
    pub fn bare_camera_loop(&self, camera: &BareCamera) -> Result<BareTally> {
        let wrong = if camera.width % 8 != 0 || camera.height % 8 != 0 {
            "image edges that are multiples of 8"
        } else if self.width != 8 {
            "packets of 8"
        } else if self.spheres.iter().any(|s| !s.is_empty()) {
            "a scene of triangles only"
        } else if self.holes.is_some() {
            "a scene without holes"
        } else {
            // SAFETY: the scene is committed; `camera` is laid out as TrCamera and outlives the
            // call; without spheres and holes no callback looks for f64 rays in the context.
            return Ok(unsafe { tr_bare_camera_loop(self.scene.0, camera) });
        };
        Err(Error::Usage(format!("the bare loop needs {wrong}")))
    }
}
