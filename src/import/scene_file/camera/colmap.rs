//! COLMAP's `images.txt` and the `cameras.txt` beside it (Schönberger and Frahm, 2016).
//!
//! An image's quaternion (w, x, y, z) and translation lead from the world to the camera, which looks along its z with y
//! down, as in OpenCV. Models without distortion are read: SIMPLE_PINHOLE and PINHOLE, and radial ones whose coefficients are
//! all 0. A camera of another model is refused by name where an image has it.

use super::posed::{Intrinsics, Posed, read};
use crate::error::{Diagnostic, Result};
use crate::math::{DMat3, DQuat, DVec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Whether `path` is named as COLMAP's files of images are.
pub(super) fn is_images(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"))
}

/// The file of cameras that goes with a file of images.
pub(super) fn cameras_of(images: &Path) -> PathBuf {
    images.with_file_name("cameras.txt")
}

/// The poses of `images` in its order.
///
/// Errors: `Error::Io`; `Error::Input` with the line of what is wrong.
pub(super) fn poses(images: &Path) -> Result<Vec<Posed>> {
    let cameras_file = cameras_of(images);
    let cameras = cameras(&cameras_file)?;
    let text = read(images)?;
    let mut found = Vec::new();
    let mut lines = (1..).zip(text.lines());
    while let Some((number, line)) = lines.next() {
        if is_remark(line) {
            continue;
        }
        let pose = image(line, &cameras).map_err(|what| match what {
            Wrong::Line(what) => Diagnostic::new(images, what).at(number, 1),
            Wrong::Model(line, what) => Diagnostic::new(&cameras_file, what).at(line, 1),
            Wrong::Camera(id) => Diagnostic::new(
                images,
                format!("the camera {id} is not in {}", cameras_file.display()),
            )
            .at(number, 1)
            .help("cameras.txt must lie beside images.txt, of the same model"),
        })?;
        found.push(pose);
        if let Some((number, line)) = lines.next().filter(|(_, line)| !are_points(line)) {
            let shown: String = line.chars().take(40).collect();
            let message = format!("`{shown}` are no points X Y POINT3D_ID of the image above");
            let help = "an image takes two lines, of which the second may be empty";
            return Err(Diagnostic::new(images, message).at(number, 1).help(help).into());
        }
    }
    Ok(found)
}

/// Whether a line holds the points of an image, of which there may be none.
fn are_points(line: &str) -> bool {
    let mut count = 0;
    let are_numbers =
        line.split_whitespace().inspect(|_| count += 1).all(|word| word.parse::<f64>().is_ok());
    are_numbers && count % 3 == 0
}

/// What is wrong with an image's line.
enum Wrong {
    Line(String),
    /// That of its camera, with the line of that.
    Model(usize, String),
    Camera(u64),
}

impl From<String> for Wrong {
    fn from(what: String) -> Self {
        Self::Line(what)
    }
}

/// A line that says nothing.
fn is_remark(line: &str) -> bool {
    let line = line.trim();
    line.is_empty() || line.starts_with('#')
}

/// The next number of a line.
fn number<'a, T: std::str::FromStr>(
    words: &mut impl Iterator<Item = &'a str>,
    what: &str,
) -> std::result::Result<T, String> {
    let word = words.next().ok_or_else(|| format!("{what} is missing"))?;
    let shown: String = word.chars().take(40).collect();
    word.parse().map_err(|_| format!("{what} is `{shown}`; a number is wanted"))
}

/// The next finite number of a line, of which none is larger than 1e30.
fn finite<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    what: &str,
) -> std::result::Result<f64, String> {
    let x: f64 = number(words, what)?;
    if x.abs() <= 1e30 {
        Ok(x)
    } else {
        Err(format!("{what} is {x}; numbers lie between -1e30 and 1e30"))
    }
}

fn image(line: &str, cameras: &Cameras) -> std::result::Result<Posed, Wrong> {
    let mut words = line.split_whitespace();
    let _: u64 = number(&mut words, "IMAGE_ID")?;
    let mut next = |what: &str| finite(&mut words, what);
    let [w, x, y, z] = [next("QW")?, next("QX")?, next("QY")?, next("QZ")?];
    let translation = DVec3::new(next("TX")?, next("TY")?, next("TZ")?);
    let camera: u64 = number(&mut words, "CAMERA_ID")?;
    let length = (w * w + x * x + y * y + z * z).sqrt();
    if !(1e-6..=1e6).contains(&length) {
        return Err(Wrong::Line(format!(
            "the quaternion {w} {x} {y} {z} has the length {length}; 1 is wanted"
        )));
    }
    let to_camera = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
    let (line, intrinsics) = cameras.get(&camera).ok_or(Wrong::Camera(camera))?;
    let intrinsics = intrinsics.clone().map_err(|what| Wrong::Model(*line, what))?;
    let from_camera = to_camera.transpose();
    let axes = DMat3::from_cols(from_camera.x_axis, -from_camera.y_axis, from_camera.z_axis);
    Ok(Posed { eye: -(from_camera * translation), axes, intrinsics })
}

/// Each camera by its number: its line, and its intrinsics or what is wrong with them.
type Cameras = HashMap<u64, (usize, std::result::Result<Intrinsics, String>)>;

fn cameras(path: &Path) -> Result<Cameras> {
    let text = read(path)?;
    let mut found = HashMap::new();
    for (line_number, line) in (1..).zip(text.lines()).filter(|(_, line)| !is_remark(line)) {
        let mut words = line.split_whitespace();
        let id = number(&mut words, "CAMERA_ID")
            .map_err(|what| Diagnostic::new(path, what).at(line_number, 1))?;
        if found.insert(id, (line_number, intrinsics(words))).is_some() {
            let message = format!("the camera {id} stands here a second time");
            return Err(Diagnostic::new(path, message).at(line_number, 1).into());
        }
    }
    Ok(found)
}

/// What stands behind a camera's number.
fn intrinsics<'a>(
    mut words: impl Iterator<Item = &'a str>,
) -> std::result::Result<Intrinsics, String> {
    let model = words.next().ok_or("MODEL is missing")?;
    let size = [finite(&mut words, "WIDTH")?, finite(&mut words, "HEIGHT")?];
    // Whether it has one focal length, and how many coefficients of distortion.
    let (has_one, coefficients) = match model {
        "SIMPLE_PINHOLE" => (true, 0),
        "PINHOLE" => (false, 0),
        "SIMPLE_RADIAL" => (true, 1),
        "RADIAL" => (true, 2),
        "OPENCV" => (false, 4),
        "FULL_OPENCV" => (false, 8),
        _ => return Err(distorted(model)),
    };
    let mut next = |what: &str| finite(&mut words, what);
    let focal = if has_one { [next("f")?; 2] } else { [next("fx")?, next("fy")?] };
    let principal = [next("cx")?, next("cy")?];
    for _ in 0..coefficients {
        if next("a coefficient of distortion")? != 0.0 {
            return Err(distorted(model));
        }
    }
    let intrinsics = Intrinsics { focal, principal, size };
    intrinsics.check()?;
    match words.next() {
        Some(_) => Err(format!("{model} has fewer parameters than stand here")),
        None => Ok(intrinsics),
    }
}

fn distorted(model: &str) -> String {
    let shown: String = model.chars().take(40).collect();
    format!(
        "the camera model {shown} is distorted or unknown; SIMPLE_PINHOLE and PINHOLE are read: undistort the \
         pictures (COLMAP's image_undistorter) and take the model of that"
    )
}
