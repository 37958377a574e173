//! Packets of rays in Embree's own layout.

use super::holes::Registered;
use crate::math::Vec3;
use crate::ray::{PrimRef, Ray};
use std::ffi::c_void;

/// `RTCRayHitW`: W rays and their hits, structure of arrays. W is 1, 4, 8 or 16.
#[repr(C, align(64))]
#[derive(Debug, Clone)]
pub struct Packet<const W: usize> {
    org_x: [f32; W],
    org_y: [f32; W],
    org_z: [f32; W],
    tnear: [f32; W],
    dir_x: [f32; W],
    dir_y: [f32; W],
    dir_z: [f32; W],
    time: [f32; W],
    tfar: [f32; W],
    mask: [u32; W],
    id: [u32; W],
    flags: [u32; W],
    ng_x: [f32; W],
    ng_y: [f32; W],
    ng_z: [f32; W],
    u: [f32; W],
    v: [f32; W],
    prim_id: [u32; W],
    geom_id: [u32; W],
    inst_id: [u32; W],
    inst_prim_id: [u32; W],
}

const NO_GEOMETRY: u32 = u32::MAX;

// RTCRayHit is 96 bytes for one ray: 21 words and padding to 16 bytes; RTCRay itself is 48.
const _: () = {
    assert!(size_of::<Packet<16>>() == size_of::<embree4_sys::RTCRayHit16>());
    assert!(size_of::<Packet<8>>() >= size_of::<embree4_sys::RTCRayHit8>());
    assert!(size_of::<Packet<4>>() >= size_of::<embree4_sys::RTCRayHit4>());
    assert!(size_of::<Packet<1>>() >= size_of::<embree4_sys::RTCRayHit>());
    assert!(size_of::<Ray>() == 72);
    assert!(size_of::<Query>() == 40);
};

/// A hit as Embree returns it, f32.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PacketHit {
    /// Ray parameter.
    pub t: f32,
    /// Weight of vertex 1.
    pub u: f32,
    /// Weight of vertex 2.
    pub v: f32,
    /// Unnormalised geometric normal; zero on spheres.
    pub ng: Vec3,
    /// The primitive that was hit.
    pub prim: PrimRef,
}

/// Flags of a query.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct QueryFlags<'p> {
    /// Neighbouring rays go similar ways.
    pub coherent: bool,
    /// Some ray excludes a primitive.
    pub exclude: bool,
    /// Primitives that no ray of the packet may hit.
    pub passed: &'p [PrimRef],
}

/// The rays of a packet, as Embree sees them and as they were asked for, by which [`Holes`](super::Holes) decide.
#[derive(Debug, Clone, Copy)]
pub struct CastRays<'r> {
    rays: &'r [Ray],
    /// As many.
    asked: &'r [Ray],
}

impl<'r> CastRays<'r> {
    /// Rays that Embree sees as they were asked for.
    pub fn as_asked(rays: &'r [Ray]) -> Self {
        Self { rays, asked: rays }
    }

    /// `rays` that were moved or turned, and `asked`, the same before. Where one slice is shorter, there are as many rays.
    pub fn moved(rays: &'r [Ray], asked: &'r [Ray]) -> Self {
        let count = rays.len().min(asked.len());
        Self { rays: &rays[..count], asked: &asked[..count] }
    }

    /// The rays as Embree sees them.
    pub fn rays(self) -> &'r [Ray] {
        self.rays
    }

    /// The rays as they were asked for.
    pub fn asked(self) -> &'r [Ray] {
        self.asked
    }

    /// The rays in packets of `width`.
    pub fn chunks(self, width: usize) -> impl Iterator<Item = Self> {
        let chunks = self.rays.chunks(width).zip(self.asked.chunks(width));
        chunks.map(|(rays, asked)| Self { rays, asked })
    }
}

/// A query as `ffi/shim.h` lays it out. Its pointers are those of the slices and of the box it was made of.
#[repr(C)]
pub(super) struct Query {
    rays: *const Ray,
    asked: *const Ray,
    passed: *const PrimRef,
    holes: *const c_void,
    passed_count: u32,
    flags: u32,
}

impl Query {
    pub(super) fn new(cast: CastRays, flags: QueryFlags, holes: Option<&Registered>) -> Self {
        let filter = flags.exclude || !flags.passed.is_empty();
        let in_spheres = holes.is_some_and(|holes| holes.in_spheres);
        Self {
            rays: cast.rays.as_ptr(),
            asked: cast.asked.as_ptr(),
            passed: flags.passed.as_ptr(),
            holes: holes.map_or(std::ptr::null(), |holes| std::ptr::from_ref(holes).cast()),
            passed_count: flags.passed.len() as u32,
            flags: u32::from(flags.coherent) | u32::from(filter) << 1 | u32::from(in_spheres) << 2,
        }
    }
}

impl<const W: usize> Packet<W> {
    /// A packet without rays.
    pub fn new() -> Self {
        Self {
            org_x: [0.0; W],
            org_y: [0.0; W],
            org_z: [0.0; W],
            tnear: [0.0; W],
            dir_x: [0.0; W],
            dir_y: [0.0; W],
            dir_z: [0.0; W],
            time: [0.0; W],
            tfar: [0.0; W],
            mask: [u32::MAX; W],
            id: std::array::from_fn(|i| i as u32),
            flags: [0; W],
            ng_x: [0.0; W],
            ng_y: [0.0; W],
            ng_z: [0.0; W],
            u: [0.0; W],
            v: [0.0; W],
            prim_id: [NO_GEOMETRY; W],
            geom_id: [NO_GEOMETRY; W],
            inst_id: [NO_GEOMETRY; W],
            inst_prim_id: [NO_GEOMETRY; W],
        }
    }

    /// Puts `ray`, rounded to f32, into `lane` and forgets the lane's hit.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        self.org_x[lane] = ray.org.x as f32;
        self.org_y[lane] = ray.org.y as f32;
        self.org_z[lane] = ray.org.z as f32;
        self.dir_x[lane] = ray.dir.x as f32;
        self.dir_y[lane] = ray.dir.y as f32;
        self.dir_z[lane] = ray.dir.z as f32;
        self.tnear[lane] = ray.tnear as f32;
        self.tfar[lane] = ray.tfar as f32;
        self.geom_id[lane] = NO_GEOMETRY;
    }

    /// The hit of `lane`, or `None`.
    #[inline(always)]
    pub fn hit(&self, lane: usize) -> Option<PacketHit> {
        (self.geom_id[lane] != NO_GEOMETRY).then(|| PacketHit {
            t: self.tfar[lane],
            u: self.u[lane],
            v: self.v[lane],
            ng: Vec3::new(self.ng_x[lane], self.ng_y[lane], self.ng_z[lane]),
            prim: PrimRef { geom_id: self.geom_id[lane], prim_id: self.prim_id[lane] },
        })
    }

    /// Whether an occlusion query found something in `lane`.
    #[inline(always)]
    pub fn is_occluded(&self, lane: usize) -> bool {
        self.tfar[lane] == f32::NEG_INFINITY
    }

    /// Panics where a valid lane has no f64 ray: callbacks would read past the slice.
    pub(super) fn check_lanes(&self, valid: &[i32; W], rays: &[Ray]) {
        assert!(rays.len() >= W || valid[rays.len()..].iter().all(|v| *v == 0));
    }
}

impl<const W: usize> Default for Packet<W> {
    fn default() -> Self {
        Self::new()
    }
}
