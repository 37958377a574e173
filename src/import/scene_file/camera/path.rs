//! From the camera's table to a [`Shot`].

use super::{BSpline, Camera, Key, Orbit, Pan};
use crate::error::{Error, Result};
use crate::import::framing::{self, Lens};
use crate::import::scene_file::at::{At, Span};
use crate::import::scene_file::number::{Degrees, Int};
use crate::import::scene_file::report::Source;
use crate::import::scene_file::vector::Point;
use crate::math::DVec3;
use crate::scene::{CameraPath, KeyPose, Pose, Projection, ProjectionKey, Shot, World};

/// The pose that all keys of a camera table agree on.
struct Common {
    up: DVec3,
    roll_degrees: f64,
}

impl Camera {
    /// The shot; `world` and `aspect` (width / height) decide where an orbit without `eye` runs.
    ///
    /// Errors: more than one path, or one that some frame cannot be rendered on; at the path.
    pub(in crate::import::scene_file) fn build(
        &self,
        source: &Source,
        world: &World,
        aspect: f64,
    ) -> Result<Shot> {
        let span = self.only_path(source)?;
        let (path, projections) = match &self.poses {
            Some(poses) => self.posed(poses, source, aspect)?,
            None => {
                let path = self.path(source, world, aspect)?;
                let projections = self.projections(&path);
                (path, projections)
            }
        };
        let lens = self.lens(&path, source)?;
        let usual_frames = match (&path, &self.poses) {
            (CameraPath::Keys(poses), Some(_)) => poses.len() as u32,
            (CameraPath::Still(_), _) => 1,
            _ => 48,
        };
        let shot = Shot {
            frames: self.frames.map_or(usual_frames, Int::u32),
            path,
            projections,
            easing: self.easing,
            vfov_degrees: self.vfov().0,
            lens,
        };
        shot.validate().map_err(|error| match error {
            Error::Usage(what) => source.fault(&span, what).into(),
            other => other,
        })?;
        Ok(shot)
    }

    /// Where the path stands.
    fn only_path(&self, source: &Source) -> Result<Span> {
        let mut given: Vec<(Span, &str)> = [
            self.still.as_ref().map(|p| (p.span.clone(), "still")),
            self.pan.as_ref().map(|p| (p.span.clone(), "pan")),
            self.orbit.as_ref().map(|p| (p.span.clone(), "orbit")),
            self.keys.as_ref().map(|p| (p.span.clone(), "keys")),
            self.bspline.as_ref().map(|p| (p.span.clone(), "bspline")),
            self.poses.as_ref().map(|p| (p.span.clone(), "poses")),
        ]
        .into_iter()
        .flatten()
        .collect();
        given.sort_by_key(|(span, _)| span.start);
        match given.as_slice() {
            [] => Ok(0..0),
            [(span, _)] => Ok(span.clone()),
            [(_, first), (span, second), ..] => Err(source
                .fault(span, format!("the camera has a path already: `{first}`"))
                .help(format!("a camera has one path; remove `{first}` or `{second}`"))
                .into()),
        }
    }

    fn path(&self, source: &Source, world: &World, aspect: f64) -> Result<CameraPath> {
        let common = Common { up: self.up.unit(), roll_degrees: self.roll.0 };
        if let Some(still) = &self.still {
            return Ok(CameraPath::Still(common.pose(&still.eye, &still.target)));
        }
        if let Some(pan) = &self.pan {
            return Ok(pan.path(&common));
        }
        if let Some(keys) = &self.keys {
            return key_poses(keys, &common, source).map(CameraPath::Keys);
        }
        if let Some(spline) = &self.bspline {
            return Ok(spline.path(&common));
        }
        let around = self.orbit.as_ref().map_or(&Orbit::WHOLE, |o| &o.value);
        let lens = Lens { vfov_degrees: self.vfov().0, aspect: aspect * self.pixel_aspect.0 };
        Ok(around.path(&common, world, &lens))
    }
}

impl Camera {
    /// The projections along `path`; none where it is the centred one of square pixels throughout.
    fn projections(&self, path: &CameraPath) -> Vec<ProjectionKey> {
        let own = Projection {
            vfov_degrees: self.vfov().0,
            shift: self.shift.0.map(|shift| shift.0),
            pixel_aspect: self.pixel_aspect.0,
        };
        let at_key = |key: &At<Key>, at: f64| {
            let vfov_degrees = key.fov.map_or(own.vfov_degrees, |fov| fov.0);
            let shift = key.shift.map_or(own.shift, |shift| shift.0.map(|x| x.0));
            ProjectionKey { at, projection: Projection { vfov_degrees, shift, ..own } }
        };
        let keys: Vec<_> = match (&self.keys, path) {
            (Some(keys), CameraPath::Keys(poses)) => {
                keys.iter().zip(poses).map(|(key, pose)| at_key(key, pose.at)).collect()
            }
            _ => vec![ProjectionKey { at: 0.0, projection: own }],
        };
        let centred = Projection::centred(self.vfov().0);
        if keys.iter().all(|key| key.projection == centred) { Vec::new() } else { keys }
    }
}

impl Common {
    fn pose(&self, eye: &Point, target: &Point) -> Pose {
        Pose { eye: eye.vec(), target: target.vec(), up: self.up, roll_degrees: self.roll_degrees }
    }
}

impl Pan {
    fn path(&self, common: &Common) -> CameraPath {
        CameraPath::Pan {
            from: self.from.vec(),
            to: self.to.vec(),
            target: self.target.vec(),
            up: common.up,
            roll_degrees: common.roll_degrees,
        }
    }
}

impl Orbit {
    /// Once round the whole scene.
    const WHOLE: Self = Self { target: None, eye: None, degrees: Degrees(360.0) };

    fn path(&self, common: &Common, world: &World, lens: &Lens) -> CameraPath {
        let target = self.target.map(|t| t.vec());
        let (target, eye) = match self.eye {
            Some(eye) => (target.unwrap_or_else(|| framing::bounds(world).centre()), eye.vec()),
            None => framing::orbit(world, target, common.up, framing::ELEVATION_DEGREES, lens),
        };
        CameraPath::Orbit {
            target,
            eye,
            axis: common.up,
            degrees: self.degrees.0,
            roll_degrees: common.roll_degrees,
        }
    }
}

impl BSpline {
    fn path(&self, common: &Common) -> CameraPath {
        CameraPath::BSpline {
            points: self.points.iter().map(|p| p.vec()).collect(),
            target: self.target.vec(),
            up: common.up,
            roll_degrees: common.roll_degrees,
        }
    }
}

/// Key poses with their times.
fn key_poses(keys: &At<Vec<At<Key>>>, common: &Common, source: &Source) -> Result<Vec<KeyPose>> {
    let timed = keys.iter().filter(|k| k.at.is_some()).count();
    if timed != 0 && timed != keys.len() {
        let untimed = keys.iter().find(|k| k.at.is_none());
        let span = untimed.map_or(&keys.span, |k| &k.span);
        let message = "this key has no `at` although others have";
        let help = "give `at` for every key, or for none to spread them evenly";
        return Err(source.fault(span, message).help(help).into());
    }
    let steps = keys.len().saturating_sub(1).max(1) as f64;
    let mut before = None;
    let mut poses = Vec::with_capacity(keys.len());
    for (index, key) in keys.iter().enumerate() {
        let at = key.at.as_ref().map_or(index as f64 / steps, |at| at.0);
        if let (Some(at_key), Some(before)) = (&key.at, before) {
            if at <= before {
                let message = format!("`at` is {at}, not later than the key before it ({before})");
                return Err(source.fault(&at_key.span, message).into());
            }
        }
        before = Some(at);
        if key.eye == key.target {
            let message = "the camera of this key stands on its own target; it looks nowhere";
            return Err(source.fault(&key.span, message).into());
        }
        let mut pose = common.pose(&key.eye, &key.target);
        pose.up = key.up.map_or(pose.up, |up| up.unit());
        pose.roll_degrees = key.roll.map_or(pose.roll_degrees, |r| r.0);
        poses.push(KeyPose { at, pose });
    }
    Ok(poses)
}
