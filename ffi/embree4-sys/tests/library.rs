//! The library that is linked is the Embree that the bindings were made from, or newer.
#![allow(unsafe_code)]

use embree4_sys as rtc;

#[test]
fn library_is_as_new_as_the_header() {
    // SAFETY: a null configuration is allowed; the device is released once and not used after.
    let version = unsafe {
        let device = rtc::rtcNewDevice(std::ptr::null());
        assert!(!device.is_null());
        let version = rtc::rtcGetDeviceProperty(device, rtc::RTC_DEVICE_PROPERTY_VERSION);
        rtc::rtcReleaseDevice(device);
        version
    };
    let header =
        rtc::RTC_VERSION_MAJOR * 10_000 + rtc::RTC_VERSION_MINOR * 100 + rtc::RTC_VERSION_PATCH;
    assert!(version >= header as isize, "library {version}, header {header}");
    assert!(header >= 40_300);
}
