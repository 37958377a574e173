//! Raw bindings to the installed Embree 4 (4.3 or newer), made by bindgen from its own header.
//!
//! Nothing here is safe or documented beyond Embree's manual; `tweenray::embree` is the wrapper.
//! Embree's inline functions (`rtcInitIntersectArguments` and its kin) have no symbol to bind: the
//! project's C shim holds them.

#![allow(non_camel_case_types, non_snake_case, non_upper_case_globals)]
#![allow(missing_docs, unsafe_code, clippy::all)]

include!(concat!(env!("OUT_DIR"), "/bindings.rs"));

/// Marks a ray that hit nothing (a cast in the header, which bindgen does not bind).
pub const RTC_INVALID_GEOMETRY_ID: std::ffi::c_uint = std::ffi::c_uint::MAX;

// The sizes that Embree 4.3 and newer read and write. Bindings with smaller hit structs (those of
// 4.2, say) let Embree write past the end of a ray.
const _: () = {
    assert!(size_of::<RTCRay>() == 48);
    assert!(size_of::<RTCHit>() == 48);
    assert!(size_of::<RTCRayHit>() == 96);
    assert!(size_of::<RTCRayHit4>() == 336);
    assert!(size_of::<RTCRayHit8>() == 672);
    assert!(size_of::<RTCRayHit16>() == 1344);
    assert!(size_of::<RTCRayQueryContext>() == 8);
    assert!(align_of::<RTCRayHit>() == 16);
    assert!(align_of::<RTCRayHit16>() == 64);
};
