//! Embree behind a safe face: `Device` → [`SceneBuilder`] → `commit()` → [`CommittedScene`].
//!
//! With `ffi/` and the edge to MPI in `cluster` the only code that is `unsafe`. Takes f32 triangles and f64 spheres, gives packet
//! queries; knows nothing of materials, rules or retries. Only a committed scene can be traced,
//! and it borrows the buffers that Embree shares.

mod holes;
mod options;
mod packet;
mod yardstick;

pub use holes::Holes;
use holes::Registered;
pub use options::{BuildOptions, Quality};
use packet::Query;
pub use packet::{CastRays, Packet, PacketHit, QueryFlags};
pub use yardstick::{BareCamera, BareTally};

use crate::error::{Error, Result};
use crate::math::Vec3;
use embree4_sys as sys;
use std::ffi::{CStr, CString, c_void};
use std::marker::PhantomData;
use std::sync::atomic::{AtomicI64, Ordering};

/// An analytic sphere as `ffi/shim.h` lays it out: scene space, f64.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereData {
    /// Centre.
    pub centre: [f64; 3],
    /// Radius; a sphere of negative radius is never hit.
    pub radius: f64,
}

unsafe extern "C" {
    fn tr_set_holes(geometry: sys::RTCGeometry);
    fn tr_set_spheres(geometry: sys::RTCGeometry, spheres: *const SphereData, count: u32);
    fn tr_intersect(
        scene: sys::RTCScene,
        width: u32,
        valid: *const i32,
        rayhits: *mut c_void,
        query: *const Query,
    );
    fn tr_occluded(
        scene: sys::RTCScene,
        width: u32,
        valid: *const i32,
        rays: *mut c_void,
        query: *const Query,
    );
    fn tr_mxcsr() -> u32;
}

/// The floating-point control bits of the calling thread (x86; 0 elsewhere): tests assert that
/// tracing leaves them as they were. The lowest six, which only remember exceptions, are left out.
pub fn floating_point_mode() -> u32 {
    // SAFETY: reads a register of the calling thread; no precondition.
    unsafe { tr_mxcsr() & !0x3f }
}

/// An Embree device: its threads and its count of the memory it holds.
struct Device {
    raw: sys::RTCDevice,
    /// Bytes that Embree holds; its address is given to Embree, hence the box.
    memory: Box<AtomicI64>,
}

// SAFETY: Embree 4 API manual, "Device Object": devices and their functions may be used from any
// thread; the counter is atomic.
unsafe impl Send for Device {}
// SAFETY: as above.
unsafe impl Sync for Device {}

impl Device {
    fn new(threads: usize, isa: Option<&str>) -> Result<Self> {
        let isa = isa.map(|isa| format!(",isa={isa}")).unwrap_or_default();
        let config = CString::new(format!("threads={threads},set_affinity=0{isa}"))
            .map_err(|_| Error::Usage("the instruction set's name holds a NUL".into()))?;
        // SAFETY: `config` is a NUL-terminated string that outlives the call.
        let raw = unsafe { sys::rtcNewDevice(config.as_ptr()) };
        if raw.is_null() {
            return Err(Error::Embree(format!(
                "cannot open a device ({})",
                config.to_string_lossy()
            )));
        }
        let device = Self { raw, memory: Box::new(AtomicI64::new(0)) };
        let counter: *const AtomicI64 = &*device.memory;
        // SAFETY: the counter lives as long as the device (dropped after rtcReleaseDevice), and
        // `count_memory` takes it as the shared reference it is.
        unsafe {
            sys::rtcSetDeviceMemoryMonitorFunction(raw, Some(count_memory), counter as *mut c_void);
        }
        device.check("open a device")?;
        Ok(device)
    }

    /// The device's pending error, with what was being done.
    fn check(&self, doing: &str) -> Result<()> {
        // SAFETY: `raw` is a live device.
        let code = unsafe { sys::rtcGetDeviceError(self.raw) };
        if code == sys::RTC_ERROR_NONE {
            return Ok(());
        }
        // SAFETY: `raw` is a live device; the message is a NUL-terminated string of Embree's.
        let message = unsafe {
            let text = sys::rtcGetDeviceLastErrorMessage(self.raw);
            if text.is_null() { "".into() } else { CStr::from_ptr(text).to_string_lossy() }
        };
        Err(Error::Embree(format!("cannot {doing}: {message} (code {code})")))
    }

    fn property(&self, property: sys::RTCDeviceProperty) -> isize {
        // SAFETY: `raw` is a live device.
        unsafe { sys::rtcGetDeviceProperty(self.raw, property) }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: `raw` came from rtcNewDevice and is released once. Scenes hold their own
        // reference, and every scene of ours is dropped before its device.
        unsafe { sys::rtcReleaseDevice(self.raw) }
    }
}

unsafe extern "C" fn count_memory(counter: *mut c_void, bytes: isize, _post: bool) -> bool {
    // SAFETY: `Device::new` registered a pointer to an AtomicI64 that outlives the device.
    let counter = unsafe { &*(counter as *const AtomicI64) };
    counter.fetch_add(bytes as i64, Ordering::Relaxed);
    true
}

/// A scene that takes geometry; `commit` makes it traceable. Borrows the geometry for `'g`.
pub struct SceneBuilder<'g> {
    // Declared before the device, so dropped before it.
    scene: SceneHandle,
    device: Device,
    spheres: Vec<Box<[SphereData]>>,
    indices: Vec<Box<[[u32; 3]]>>,
    holes: Option<Box<Registered<'g>>>,
    next_id: u32,
    geometry: PhantomData<&'g ()>,
}

/// Owns one reference to an Embree scene.
struct SceneHandle(sys::RTCScene);

// SAFETY: Embree 4 API manual, "Scene Object": a committed scene may be traced from any thread;
// before that only `SceneBuilder`, which is not shared, touches it.
unsafe impl Send for SceneHandle {}
// SAFETY: as above.
unsafe impl Sync for SceneHandle {}

impl Drop for SceneHandle {
    fn drop(&mut self) {
        // SAFETY: the handle came from rtcNewScene and is released once.
        unsafe { sys::rtcReleaseScene(self.0) }
    }
}

impl<'g> SceneBuilder<'g> {
    /// An empty scene on a device of its own.
    ///
    /// Errors: `Error::Embree` for an unknown instruction set or a failing device.
    pub fn new(options: &BuildOptions) -> Result<Self> {
        let device = Device::new(options.threads, options.isa)?;
        // SAFETY: the device is live; the scene is owned by the handle.
        let scene = SceneHandle(unsafe { sys::rtcNewScene(device.raw) });
        device.check("make a scene")?;
        // SAFETY: the scene is live and not committed yet.
        unsafe {
            sys::rtcSetSceneFlags(scene.0, options.flags());
            sys::rtcSetSceneBuildQuality(scene.0, options.build_quality());
        }
        device.check("set how the scene is built")?;
        Ok(Self {
            scene,
            device,
            spheres: Vec::new(),
            indices: Vec::new(),
            holes: None,
            next_id: 0,
            geometry: PhantomData,
        })
    }

    /// Takes holes out of the surfaces that are added from now on.
    ///
    /// Candidates are asked about where [`Holes::are_in`] says so: those of a mesh in Embree's filter, those of
    /// spheres, whose test is our own, by a flag of each query, as soon as one geometry of spheres has holes.
    pub fn set_holes(&mut self, holes: Box<dyn Holes + 'g>) {
        self.holes = Some(Box::new(Registered::new(holes)));
    }

    /// Adds a triangle mesh and returns its `geom_id` (0, 1, 2, … in order).
    ///
    /// The triangles numbered in `omit` keep their numbers but are never hit.
    ///
    /// `positions` has one spare element after `vertex_count`, since Embree reads 16 bytes a
    /// vertex. Errors: an index out of range, a missing spare element, Embree's own.
    pub fn add_triangles(
        &mut self,
        positions: &'g [Vec3],
        vertex_count: usize,
        triangles: &'g [[u32; 3]],
        omit: impl ExactSizeIterator<Item = u32>,
    ) -> Result<u32> {
        if positions.len() <= vertex_count {
            return Err(Error::Embree("a vertex buffer lacks its spare element".into()));
        }
        if triangles.iter().flatten().any(|i| *i as usize >= vertex_count) {
            return Err(Error::Embree("a triangle names a vertex that does not exist".into()));
        }
        let mut triangles = triangles;
        let mut own: Box<[[u32; 3]]> = Box::default();
        if omit.len() > 0 {
            own = Box::from(triangles);
            // A triangle of one point has no inside.
            omit.for_each(|prim| own[prim as usize] = [own[prim as usize][0]; 3]);
            triangles = &own;
        }
        let id = self.next_id;
        let has_holes = self.holes.as_ref().is_some_and(|holes| holes.are_in(id));
        let id = self.add(sys::RTC_GEOMETRY_TYPE_TRIANGLE, |geometry| {
            if has_holes {
                // SAFETY: the geometry is live and not committed yet. The filter reads what every query of
                // `CommittedScene` brings with it where there are holes.
                unsafe { tr_set_holes(geometry) };
            }
            // SAFETY: both slices live for 'g, which the committed scene borrows, or are boxes that
            // do not move and are dropped after the scene (as with spheres); sizes, strides
            // and the 16-byte read of the last vertex were checked above ("rtcSetSharedGeometry-
            // Buffer": the buffer must be padded to 16 bytes and stay alive).
            unsafe {
                sys::rtcSetSharedGeometryBuffer(
                    geometry,
                    sys::RTC_BUFFER_TYPE_VERTEX,
                    0,
                    sys::RTC_FORMAT_FLOAT3,
                    positions.as_ptr().cast(),
                    0,
                    size_of::<Vec3>(),
                    vertex_count,
                );
                sys::rtcSetSharedGeometryBuffer(
                    geometry,
                    sys::RTC_BUFFER_TYPE_INDEX,
                    0,
                    sys::RTC_FORMAT_UINT3,
                    triangles.as_ptr().cast(),
                    0,
                    size_of::<[u32; 3]>(),
                    triangles.len(),
                );
            }
        });
        self.indices.push(own);
        id
    }

    /// Adds analytic spheres as one geometry and returns its `geom_id`. Those numbered in `omit`
    /// keep their numbers but are never hit.
    pub fn add_spheres(
        &mut self,
        spheres: Vec<SphereData>,
        omit: impl Iterator<Item = u32>,
    ) -> Result<u32> {
        let mut spheres = spheres.into_boxed_slice();
        // The shim gives a negative radius no bounds, and Embree leaves it out.
        omit.for_each(|prim| spheres[prim as usize].radius = -1.0);
        if let Some(holes) = &mut self.holes {
            holes.in_spheres |= holes.are_in(self.next_id);
        }
        let id = self.add(sys::RTC_GEOMETRY_TYPE_USER, |geometry| {
            // SAFETY: the boxed slice does not move, and the scene that the geometry is attached
            // to is dropped before the box (field order here and in `CommittedScene`).
            unsafe { tr_set_spheres(geometry, spheres.as_ptr(), spheres.len() as u32) };
        });
        self.spheres.push(spheres);
        id
    }

    fn add(
        &mut self,
        kind: sys::RTCGeometryType,
        fill: impl FnOnce(sys::RTCGeometry),
    ) -> Result<u32> {
        let id = self.next_id;
        // SAFETY: the device is live; the geometry is committed, attached (the scene takes its
        // own reference) and then released once, in the order the manual asks for.
        unsafe {
            let geometry = sys::rtcNewGeometry(self.device.raw, kind);
            self.device.check("make a geometry")?;
            fill(geometry);
            sys::rtcCommitGeometry(geometry);
            sys::rtcAttachGeometryByID(self.scene.0, geometry, id);
            sys::rtcReleaseGeometry(geometry);
        }
        self.device.check("add a geometry")?;
        self.next_id += 1;
        Ok(id)
    }

    /// Builds the BVH.
    ///
    /// Errors: `Error::Embree`, out of memory for instance.
    pub fn commit(self) -> Result<CommittedScene<'g>> {
        // SAFETY: the scene is live and has all its geometry.
        unsafe { sys::rtcCommitScene(self.scene.0) };
        self.device.check("build the scene")?;
        let eight = sys::RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED;
        // Also with AVX-512: packets of 16 are slower (docs/decisions/003-packets-of-8.md).
        let width = if self.device.property(eight) != 0 { 8 } else { 4 };
        Ok(CommittedScene {
            scene: self.scene,
            device: self.device,
            spheres: self.spheres,
            _indices: self.indices,
            holes: self.holes,
            width,
            geometry: PhantomData,
        })
    }
}

/// A built scene: immutable, traceable from any thread.
pub struct CommittedScene<'g> {
    scene: SceneHandle,
    device: Device,
    spheres: Vec<Box<[SphereData]>>,
    _indices: Vec<Box<[[u32; 3]]>>,
    holes: Option<Box<Registered<'g>>>,
    width: usize,
    geometry: PhantomData<&'g ()>,
}

impl CommittedScene<'_> {
    /// The packet width to use: 8 where the instruction set handles that natively, else 4.
    pub fn packet_width(&self) -> usize {
        self.width
    }

    /// Bytes that Embree holds for this scene.
    pub fn memory(&self) -> u64 {
        self.device.memory.load(Ordering::Relaxed).max(0) as u64
    }

    /// Version of the Embree library that is loaded, "4.3.3".
    pub fn library_version(&self) -> String {
        let v = self.device.property(sys::RTC_DEVICE_PROPERTY_VERSION);
        format!("{}.{}.{}", v / 10000, v / 100 % 100, v % 100)
    }

    /// Closest hits of the lanes of `packet` that `valid` marks with -1; lane i stands for ray i of `cast`, whose
    /// excluded primitive is honoured with `flags.exclude`.
    ///
    /// # Panics
    /// Where `cast` has no ray for a lane that `valid` marks.
    pub fn intersect<const W: usize>(
        &self,
        valid: &[i32; W],
        packet: &mut Packet<W>,
        cast: CastRays,
        flags: QueryFlags,
    ) {
        packet.check_lanes(valid, cast.rays());
        let (lanes, query) = (Aligned(*valid), Query::new(cast, flags, self.holes.as_deref()));
        let at = std::ptr::from_mut(packet).cast();
        // SAFETY: `Packet<W>` has the layout and alignment of RTCRayHitW (asserted in packet.rs),
        // `lanes` is aligned, every valid lane has its rays (checked above; `CastRays` has as many of both kinds), and the slices
        // and holes behind `query` outlive the call.
        unsafe { tr_intersect(self.scene.0, W as u32, lanes.0.as_ptr(), at, &raw const query) }
    }

    /// Marks the lanes that anything blocks: their `tfar` becomes minus infinity.
    ///
    /// # Panics
    /// As [`intersect`](Self::intersect).
    pub fn occluded<const W: usize>(
        &self,
        valid: &[i32; W],
        packet: &mut Packet<W>,
        cast: CastRays,
        flags: QueryFlags,
    ) {
        packet.check_lanes(valid, cast.rays());
        let (lanes, query) = (Aligned(*valid), Query::new(cast, flags, self.holes.as_deref()));
        let at = std::ptr::from_mut(packet).cast();
        // SAFETY: as for `intersect`; RTCRayW is the front part of RTCRayHitW.
        unsafe { tr_occluded(self.scene.0, W as u32, lanes.0.as_ptr(), at, &raw const query) }
    }
}

/// Embree wants lane masks aligned to the packet's width.
#[repr(align(64))]
struct Aligned<const W: usize>([i32; W]);
