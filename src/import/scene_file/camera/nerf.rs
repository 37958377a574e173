//! `transforms.json` of NeRF data sets (Mildenhall et al., 2020) and of the programs that use their layout.
//!
//! Each frame's `transform_matrix` leads from the camera to the world; the camera looks along its -z with y up, as in OpenGL.
//! Intrinsics stand at the top or in a frame, which wins: `fl_x`, `fl_y`, `cx`, `cy`, `w`, `h`, `camera_angle_x`,
//! `camera_angle_y`. Other keys are not looked at, but for those of distortion, which are refused.

use super::posed::{Intrinsics, Posed, read, rotation};
use crate::error::{Diagnostic, Error, Result};
use crate::math::{DMat3, DVec3};
use serde::Deserialize;
use std::f64::consts::PI;
use std::path::Path;

/// Names of camera models without distortion, or whose distortion the keys say.
const MODELS: [&str; 4] = ["PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL"];

#[derive(Deserialize)]
struct File {
    #[serde(flatten)]
    own: Lens,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
struct Frame {
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    own: Lens,
}

/// Intrinsics as far as they are given. Angles are in radians, all else in pixels.
#[derive(Clone, Default, Deserialize)]
struct Lens {
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

/// The poses of the file in its order; `aspect` is the shape of pictures where the file has only an angle.
///
/// Errors: `Error::Io`; `Error::Input` with line and column where the text is no such file, and with the JSON path of a
/// number that is wrong.
pub(super) fn poses(path: &Path, aspect: f64) -> Result<Vec<Posed>> {
    let text = read(path)?;
    let file: File = serde_json::from_str(&text).map_err(|error| {
        let place = error.to_string();
        let message = place.rsplit_once(" at line ").map_or(place.as_str(), |(message, _)| message);
        let (line, column) = (error.line(), error.column());
        let fault = Diagnostic::new(path, format!("this is no transforms.json: {message}"));
        let fault =
            fault.help("wanted: frames, each with a transform_matrix of four rows of four numbers");
        if line > 0 { fault.at(line, column.max(1)) } else { fault }
    })?;
    let fault = |at: String, message: String| Error::input(path, format!("{at}: {message}"));
    let pose = |(index, frame): (usize, &Frame)| {
        let at = format!("frames[{index}]");
        let lens = frame.own.clone().or(&file.own);
        let intrinsics = lens.intrinsics(aspect).map_err(|what| fault(at.clone(), what))?;
        let (eye, axes) =
            frame.pose().map_err(|what| fault(format!("{at}.transform_matrix"), what))?;
        Ok(Posed { eye, axes, intrinsics })
    };
    file.frames.iter().enumerate().map(pose).collect()
}

impl Frame {
    /// Eye, and the axes right, up and forward.
    fn pose(&self) -> std::result::Result<(DVec3, DMat3), String> {
        let rows = &self.transform_matrix;
        if !(3..=4).contains(&rows.len()) || rows.iter().any(|row| row.len() != 4) {
            return Err("must have four rows (or three) of four numbers".into());
        }
        if rows.get(3).is_some_and(|row| row != &[0.0, 0.0, 0.0, 1.0]) {
            return Err(format!("its last row is {:?}; it must be [0, 0, 0, 1]", rows[3]));
        }
        let column = |k: usize| DVec3::new(rows[0][k], rows[1][k], rows[2][k]);
        let eye = column(3);
        if eye.abs().max_element() > 1e30 || !eye.is_finite() {
            return Err(format!(
                "the camera stands at {eye}; coordinates lie between -1e30 and 1e30"
            ));
        }
        let axes = rotation(DMat3::from_cols(column(0), column(1), column(2)))?;
        Ok((eye, DMat3::from_cols(axes.x_axis, axes.y_axis, -axes.z_axis)))
    }
}

impl Lens {
    /// With what it leaves out as in `other`.
    fn or(self, other: &Self) -> Self {
        // A frame's focal length stands against an angle of the file, not beside it.
        let own_x = self.fl_x.is_some() || self.camera_angle_x.is_some();
        let own_y = self.fl_y.is_some() || self.camera_angle_y.is_some();
        let unless = |is_own: bool, value: Option<f64>| value.filter(|_| !is_own);
        Self {
            fl_x: self.fl_x.or(unless(own_x, other.fl_x)),
            fl_y: self.fl_y.or(unless(own_x || own_y, other.fl_y)),
            camera_angle_x: self.camera_angle_x.or(unless(own_x, other.camera_angle_x)),
            camera_angle_y: self.camera_angle_y.or(unless(own_x || own_y, other.camera_angle_y)),
            cx: self.cx.or(other.cx),
            cy: self.cy.or(other.cy),
            w: self.w.or(other.w),
            h: self.h.or(other.h),
            camera_model: self.camera_model.or_else(|| other.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(other.is_fisheye),
            k1: self.k1.or(other.k1),
            k2: self.k2.or(other.k2),
            k3: self.k3.or(other.k3),
            k4: self.k4.or(other.k4),
            p1: self.p1.or(other.p1),
            p2: self.p2.or(other.p2),
        }
    }

    fn intrinsics(&self, aspect: f64) -> std::result::Result<Intrinsics, String> {
        self.refuse_distortion()?;
        let (width, height) = match (self.w, self.h) {
            (Some(w), Some(h)) => (w, h),
            // Without a size the numbers are shares of a picture that is as high as the unit.
            (None, None) if self.cx.or(self.cy).or(self.fl_x).or(self.fl_y).is_none() => {
                (aspect, 1.0)
            }
            _ => return Err("`w` and `h` are missing, the size of the pictures in pixels".into()),
        };
        let of_angle = |name: &str, angle: Option<f64>, edge: f64| match angle {
            Some(angle) if angle > 0.0 && angle < PI => {
                Ok(Some(0.5 * edge / libm::tan(0.5 * angle)))
            }
            Some(angle) => {
                Err(format!("`{name}` is {angle}; it must lie between 0 and pi, radians"))
            }
            None => Ok(None),
        };
        let x = self.fl_x.or(of_angle("camera_angle_x", self.camera_angle_x, width)?);
        let y = self.fl_y.or(of_angle("camera_angle_y", self.camera_angle_y, height)?);
        let Some((fx, fy)) = x.or(y).zip(y.or(x)) else {
            return Err("no field of view: `fl_x` or `camera_angle_x` is missing".into());
        };
        let principal = [self.cx.unwrap_or(0.5 * width), self.cy.unwrap_or(0.5 * height)];
        let found = Intrinsics { focal: [fx, fy], principal, size: [width, height] };
        found.check()?;
        Ok(found)
    }

    fn refuse_distortion(&self) -> std::result::Result<(), String> {
        let help =
            "undistort the pictures first (COLMAP's image_undistorter), and take the poses of that";
        if let Some(model) = self.camera_model.as_deref().filter(|model| !MODELS.contains(model)) {
            return Err(format!("the camera model {model} is no pinhole; {help}"));
        }
        if self.is_fisheye == Some(true) {
            return Err(format!("the lens is a fisheye; {help}"));
        }
        let keys = [
            ("k1", self.k1),
            ("k2", self.k2),
            ("k3", self.k3),
            ("k4", self.k4),
            ("p1", self.p1),
            ("p2", self.p2),
        ];
        match keys.iter().find(|(_, value)| value.is_some_and(|x| x != 0.0)) {
            Some((key, value)) => {
                let value = value.unwrap_or_default();
                Err(format!("the lens is distorted ({key} is {value}); {help}"))
            }
            None => Ok(()),
        }
    }
}
