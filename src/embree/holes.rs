//! Holes in surfaces: what Embree asks before it takes a hit.

use crate::ray::{PrimRef, Ray};
use std::ffi::c_void;

/// Decides which surfaces have holes, and where.
pub trait Holes: Send + Sync {
    /// Whether any primitive of the geometry may have holes, or be hidden in places. Rays pass through those of other
    /// geometries nowhere.
    fn are_in(&self, geom_id: u32) -> bool;

    /// Whether `prim` is there where `ray` meets it: on a sphere at the first (0) or second (1) root.
    fn is_there(&self, ray: &Ray, prim: PrimRef, root: usize) -> bool;
}

/// The holes of one scene behind the function that C calls: `TrHoles` in `ffi/shim.h`, and what it knows nothing of.
#[repr(C)]
pub(super) struct Registered<'g> {
    // Takes itself, untyped: a function of `Self` would not let the lifetime shrink.
    is_there: unsafe extern "C" fn(*const c_void, *const Ray, PrimRef, u32) -> bool,
    holes: Box<dyn Holes + 'g>,
    /// Whether any of the spheres that were added have holes.
    pub(super) in_spheres: bool,
}

impl<'g> Registered<'g> {
    pub(super) fn new(holes: Box<dyn Holes + 'g>) -> Self {
        Self { is_there, holes, in_spheres: false }
    }

    pub(super) fn are_in(&self, geom_id: u32) -> bool {
        self.holes.are_in(geom_id)
    }
}

unsafe extern "C" fn is_there(
    registered: *const c_void,
    ray: *const Ray,
    prim: PrimRef,
    root: u32,
) -> bool {
    // SAFETY: the shim passes on what `Query::new` was given, which outlives the query: the holes, and a ray
    // among those that were asked for.
    let (registered, ray) = unsafe { (&*registered.cast::<Registered>(), &*ray) };
    registered.holes.is_there(ray, prim, root as usize)
}
