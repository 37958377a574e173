//! How the view of a camera is projected to its picture: field of view, shift, and the shape of pixels.
//!
//! Takes nothing of the pose. The lens and its focus are [`ShotLens`](super::ShotLens).

use super::spline::{Timed, around, catmull_rom};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Projection to the picture plane of a pinhole or thin lens.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// Vertical field of view of the picture without shift, degrees.
    pub vfov_degrees: f64,
    /// By how much of its width to the right, and of its height upwards, the picture lies off the view axis.
    /// Parallels stay parallel, as with a lens that is shifted against the film.
    pub shift: [f64; 2],
    /// Width of a pixel over its height.
    pub pixel_aspect: f64,
}

/// A projection at a moment of the path.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProjectionKey {
    /// When, in `[0, 1]` of the path; strictly increasing from key to key.
    pub at: f64,
    /// The projection there.
    pub projection: Projection,
}

/// Narrowest field of view, degrees, and distance of the widest from 180: below it the directions
/// of neighbouring pixels would be the same numbers.
const LEAST_VFOV: f64 = 1e-6;
/// Most widths or heights of the picture by which it may lie off the view axis.
const FARTHEST: f64 = 1e3;
/// Longest pixel, and one over the widest.
const LONGEST: f64 = 1e3;

impl Projection {
    /// The view axis in the middle of a picture of square pixels, `vfov_degrees` high.
    pub fn centred(vfov_degrees: f64) -> Self {
        Self { vfov_degrees, shift: [0.0; 2], pixel_aspect: 1.0 }
    }

    /// Whether a vertical field of view, degrees, is one that [`Camera::new`](super::Camera::new) takes.
    pub(super) fn check_vfov(vfov_degrees: f64) -> Result<()> {
        if (LEAST_VFOV..=180.0 - LEAST_VFOV).contains(&vfov_degrees) {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "the vertical field of view is {vfov_degrees} degrees; it must lie between 0 and 180, \
             and at least {LEAST_VFOV} from either"
        )))
    }

    /// Whether it is one that [`Camera::with_projection`](super::Camera::with_projection) takes.
    ///
    /// Errors: [`Error::Usage`] with what is out of range.
    pub(super) fn check(&self) -> Result<()> {
        let Self { vfov_degrees, shift, pixel_aspect } = *self;
        Self::check_vfov(vfov_degrees)?;
        if !shift.iter().all(|x| x.abs() <= FARTHEST) {
            return Err(Error::Usage(format!(
                "the picture is shifted by {shift:?} of its size; at most {FARTHEST} can be"
            )));
        }
        if !(1.0 / LONGEST..=LONGEST).contains(&pixel_aspect) {
            return Err(Error::Usage(format!(
                "a pixel is {pixel_aspect} times as wide as high; {} to {LONGEST} can be",
                1.0 / LONGEST
            )));
        }
        Ok(())
    }

    /// The projection at `progress` in `[0, 1]` of a path, on splines through `keys` (one or more) that never leave
    /// the values of the two keys around a moment.
    pub(super) fn at(keys: &[ProjectionKey], progress: f64) -> Self {
        let value = |get: &dyn Fn(&Self) -> f64| {
            let [a, b] = around(keys, progress).map(|i| get(&keys[i].projection));
            let on_spline = catmull_rom(keys, progress, |key| get(&key.projection));
            on_spline.clamp(a.min(b), a.max(b))
        };
        Self {
            vfov_degrees: value(&|p| p.vfov_degrees),
            shift: [value(&|p| p.shift[0]), value(&|p| p.shift[1])],
            pixel_aspect: value(&|p| p.pixel_aspect),
        }
    }
}

impl Timed for ProjectionKey {
    fn at(&self) -> f64 {
        self.at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(at: f64, vfov_degrees: f64, shift: f64) -> ProjectionKey {
        let projection = Projection { shift: [shift, -shift], ..Projection::centred(vfov_degrees) };
        ProjectionKey { at, projection }
    }

    #[test]
    fn a_zoom_meets_its_keys_and_never_overshoots() {
        let keys = [key(0.0, 20.0, 0.0), key(0.5, 60.0, 0.25), key(1.0, 61.0, 0.25)];
        for key in &keys {
            assert_eq!(Projection::at(&keys, key.at), key.projection);
        }
        for i in 0..=100 {
            let found = Projection::at(&keys, f64::from(i) / 100.0);
            assert!((20.0..=61.0).contains(&found.vfov_degrees));
            assert!((0.0..=0.25).contains(&found.shift[0]) && found.shift[1] == -found.shift[0]);
        }
    }

    #[test]
    fn what_no_camera_has_is_refused() {
        let good = Projection::centred(40.0);
        good.check().expect("good");
        for wrong in [f64::NAN, f64::INFINITY, -2e3] {
            assert!(Projection { vfov_degrees: wrong, ..good }.check().is_err());
            assert!(Projection { shift: [0.0, wrong], ..good }.check().is_err());
            assert!(Projection { pixel_aspect: wrong, ..good }.check().is_err());
        }
        assert!(Projection { pixel_aspect: 0.0, ..good }.check().is_err());
    }
}
