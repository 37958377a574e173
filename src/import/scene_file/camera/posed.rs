//! A camera as computer vision has it, and the text of files of such cameras.

use crate::error::{Diagnostic, Error, Result};
use crate::math::{DMat3, DVec3};
use crate::scene::Projection;
use std::path::Path;

/// Larger files of poses are refused: a million poses take some 400 MB.
const MAX_BYTES: u64 = 512 << 20;
/// By how much the columns of a rotation may be off from unit and perpendicular ones: data sets have six digits.
const LEAST_EXACT: f64 = 1e-3;

/// A camera as computer vision has it: where it stands, its axes, and its intrinsics.
pub(super) struct Posed {
    /// Centre of projection, the file's world.
    pub eye: DVec3,
    /// Right, up and forward in the file's world, as columns; orthonormal.
    pub axes: DMat3,
    pub intrinsics: Intrinsics,
}

/// Intrinsics of a pinhole camera, pixels; (0, 0) is the upper left corner of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Intrinsics {
    /// Focal lengths across and down.
    pub focal: [f64; 2],
    /// Principal point: where the view axis meets the picture.
    pub principal: [f64; 2],
    /// Width and height of the picture.
    pub size: [f64; 2],
}

impl Intrinsics {
    /// Errors: what is not a finite number, or not above 0 where it must be.
    pub fn check(&self) -> std::result::Result<(), String> {
        let Self { focal, principal, size } = self;
        let positive = |what: &str, values: &[f64; 2]| match values
            .iter()
            .all(|x| (1e-9..=1e12).contains(x))
        {
            true => Ok(()),
            false => Err(format!("{what} is {values:?} pixels; it must lie between 1e-9 and 1e12")),
        };
        positive("the focal length", focal)?;
        positive("the size of the pictures", size)?;
        match principal.iter().all(|x| x.abs() <= 1e12) {
            true => Ok(()),
            false => {
                Err(format!("the principal point is {principal:?}; it must be two finite numbers"))
            }
        }
    }

    /// The same as a projection: (x - cx) / fx of an image point is `half_width (2 x / w - 1 + 2 shift)`.
    pub fn projection(&self) -> Projection {
        let Self { focal: [fx, fy], principal: [cx, cy], size: [width, height] } = *self;
        Projection {
            vfov_degrees: 2.0 * libm::atan(0.5 * height / fy).to_degrees(),
            shift: [0.5 - cx / width, cy / height - 0.5],
            pixel_aspect: fy / fx,
        }
    }
}

/// Columns of `m` at length 1, if they are a rotation up to rounding and, where `may_scale`, one common factor.
///
/// Errors: what `m` is instead.
pub(super) fn rotation(m: DMat3) -> std::result::Result<DMat3, &'static str> {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    if !columns.iter().all(|c| c.is_finite()) {
        return Err("has numbers that are not finite");
    }
    if columns.iter().any(|c| (c.length() - 1.0).abs() > LEAST_EXACT) {
        return Err("has axes that are not 1 long: a rotation without a scale is wanted");
    }
    let [x, y, z] = columns.map(DVec3::normalize);
    if [x.dot(y), y.dot(z), z.dot(x)].iter().any(|cos| cos.abs() > LEAST_EXACT) {
        return Err("has axes that are not perpendicular");
    }
    if x.cross(y).dot(z) < 0.0 {
        return Err("is mirrored: its axes are left-handed");
    }
    Ok(DMat3::from_cols(x, y, z))
}

/// The text of a file of poses.
///
/// Errors: `Error::Io`; `Error::Input` for what is no regular file, too large, or not UTF-8.
pub(super) fn read(path: &Path) -> Result<String> {
    let about = std::fs::metadata(path).map_err(|e| Error::io("read", path, e))?;
    if !about.is_file() {
        let help = "name a file: transforms.json, or COLMAP's images.txt";
        return Err(Diagnostic::new(path, "this is not a regular file").help(help).into());
    }
    if about.len() > MAX_BYTES {
        let message = format!("a file of poses has at most {} MB", MAX_BYTES >> 20);
        return Err(Error::input(path, message));
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e))?;
    // Some editors write a byte order mark.
    let start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    String::from_utf8(bytes[start..].to_vec()).map_err(|e| {
        let offset = e.utf8_error().valid_up_to();
        let message = format!("the file is not UTF-8 text from byte {offset} on");
        let help =
            "binary models of COLMAP become text by `colmap model_converter --output_type TXT`";
        Diagnostic::new(path, message).help(help).into()
    })
}
