//! Errors of a shot that do not depend on the frame.

use super::level::unit;
use super::{CameraPath, KeyPose, ProjectionKey, Shot};
use crate::error::{Error, Result};
use crate::math::DVec3;
use crate::scene::{Pose, Projection};

/// More frames than this are taken for a slip: nine hours of video.
const MOST_FRAMES: u32 = 1_000_000;

/// An eye closer to its axis than this share of its distance to the target orbits nothing.
const LEAST_ORBIT: f64 = 1e-9;

fn fault<T>(what: impl Into<String>) -> Result<T> {
    Err(Error::Usage(what.into()))
}

/// Frames, lens and path; costs a few comparisons per control point.
pub fn shot(shot: &Shot) -> Result<()> {
    if !(1..=MOST_FRAMES).contains(&shot.frames) {
        return fault(format!("the shot has {} frames; 1 to {MOST_FRAMES} can be", shot.frames));
    }
    Projection::check_vfov(shot.vfov_degrees)?;
    projections(&shot.projections)?;
    shot.lens.check()?;
    match &shot.path {
        CameraPath::Still(p) => pose(p, "the camera"),
        CameraPath::Pan { from, to, target, up, roll_degrees } => {
            finite(*to, "the pan's end")?;
            fixed(*from, *target, *up, *roll_degrees, "the pan")
        }
        CameraPath::Orbit { target, eye, axis, degrees, roll_degrees } => {
            fixed(*eye, *target, *axis, *roll_degrees, "the orbit")?;
            orbit(*eye - *target, *axis, *degrees)
        }
        CameraPath::Keys(all) => keys(all),
        // Each pose is checked where it is asked for: there may be as many as frames.
        CameraPath::Frames(all) if all.len() == shot.frames as usize => Ok(()),
        CameraPath::Frames(all) => {
            fault(format!("the path has {} poses for {} frames", all.len(), shot.frames))
        }
        CameraPath::BSpline { points, target, up, roll_degrees } => {
            if points.len() < 4 {
                return fault(format!(
                    "the B-spline has {} control points; it needs at least 4",
                    points.len()
                ));
            }
            points.iter().try_for_each(|p| finite(*p, "a control point of the B-spline"))?;
            fixed(points[0], *target, *up, *roll_degrees, "the B-spline")
        }
    }
}

fn projections(keys: &[ProjectionKey]) -> Result<()> {
    if !keys.windows(2).all(|pair| pair[0].at < pair[1].at) {
        return fault("the projection needs keys whose times increase");
    }
    keys.iter().try_for_each(|key| key.projection.check())
}

/// The pose of one frame of a path that has one for each.
pub fn frame_pose(of: &Pose, frame: u32) -> Result<()> {
    pose(of, &format!("frame {frame}"))
}

fn finite(p: DVec3, name: &str) -> Result<()> {
    if p.is_finite() { Ok(()) } else { fault(format!("{name} is {p}: not finite numbers")) }
}

fn pose(pose: &Pose, name: &str) -> Result<()> {
    fixed(pose.eye, pose.target, pose.up, pose.roll_degrees, name)
}

fn fixed(eye: DVec3, target: DVec3, up: DVec3, roll_degrees: f64, name: &str) -> Result<()> {
    finite(eye, &format!("the eye of {name}"))?;
    finite(target, &format!("the target of {name}"))?;
    finite(up, &format!("the up direction of {name}"))?;
    if up == DVec3::ZERO {
        return fault(format!("the up direction of {name} is zero; give it a length"));
    }
    if !roll_degrees.is_finite() {
        return fault(format!("the roll of {name} is {roll_degrees} degrees: not a finite number"));
    }
    Ok(())
}

fn orbit(arm: DVec3, axis: DVec3, degrees: f64) -> Result<()> {
    if !degrees.is_finite() {
        return fault(format!("the orbit turns by {degrees} degrees: not a finite number"));
    }
    // Scaled, so that no length over- or underflows.
    let size = arm.abs().max_element();
    if size == 0.0 || (arm / size).cross(unit(axis)).length() <= LEAST_ORBIT {
        return fault(
            "the orbit's eye lies on its axis: it would only spin; move the eye off the line \
             through the target along the axis",
        );
    }
    Ok(())
}

fn keys(keys: &[KeyPose]) -> Result<()> {
    if keys.is_empty() {
        return fault("the path has no key pose; it needs at least one");
    }
    for (i, key) in keys.iter().enumerate() {
        pose(&key.pose, &format!("key {}", i + 1))?;
        if !(0.0..=1.0).contains(&key.at) {
            return fault(format!("key {} is at {}; times run from 0 to 1", i + 1, key.at));
        }
    }
    for (i, pair) in keys.windows(2).enumerate() {
        if pair[1].at <= pair[0].at {
            return fault(format!(
                "key {} is at {}, not after key {} at {}; times must increase",
                i + 2,
                pair[1].at,
                i + 1,
                pair[0].at
            ));
        }
    }
    Ok(())
}
