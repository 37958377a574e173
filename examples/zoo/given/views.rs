//! The cameras of a move, frame by frame.

use crate::judging::Failure;
use crate::making::camera_table;
use glam::DVec3;
use tweenray::scene::{Camera, Lens, Shot, ShotLens};

/// What the camera sees in each frame of a move.
pub struct Views {
    views: Vec<View>,
    /// What all frames have in common, as the scene file's camera says it.
    own: String,
}

#[derive(Clone, Copy)]
struct View {
    camera: Camera,
    target: DVec3,
}

impl Views {
    /// Those of `shot` in pictures of this size.
    ///
    /// # Errors
    /// Where the move is none, or key poses cannot say it.
    pub fn new(shot: &Shot, [width, height]: [u32; 2]) -> Result<Self, Failure> {
        let view = |frame| -> Result<View, Failure> {
            let camera = shot.camera(frame, width, height)?;
            Ok(View { camera, target: shot.pose(frame)?.target })
        };
        let views: Vec<View> = (1..=shot.frames).map(view).collect::<Result<_, _>>()?;
        if views.iter().all(|view| view.camera == views[0].camera) {
            return Err(
                "the camera stands still, so its frames are copies of one and nothing is inferred"
                    .into(),
            );
        }
        let mut aspects = shot.projections.iter().map(|key| key.projection.pixel_aspect);
        let aspect = aspects.next().unwrap_or(1.0);
        if aspects.any(|other| (other / aspect - 1.0).abs() > 1e-9) {
            return Err(
                "the shape of pixels differs from pose to pose, which key poses cannot say".into(),
            );
        }
        let mut own = format!("pixel_aspect = {aspect:?}\n");
        if let ShotLens::Thin(lens) = &shot.lens {
            if lens.blades > 0 {
                let (blades, turn) = (lens.blades, lens.blade_rotation_degrees);
                own += &format!(
                    "lens = {{ radius = 0, blades = {blades}, blade_rotation = {turn:?} }}\n"
                );
            }
        }
        Ok(Self { views, own })
    }

    /// Frames of the move.
    pub fn count(&self) -> usize {
        self.views.len()
    }

    /// The camera's part of a scene file that has these frames from frame `first` on.
    pub fn camera(&self, frames: &[usize], first: usize) -> String {
        let views = frames.iter().map(|frame| self.views[frame - 1]);
        let keys: Vec<String> = views.map(|view| view.key()).collect();
        camera_table(&self.own, &keys, &self.views[frames[0] - 1].farther().key(), first)
    }
}

impl View {
    /// The same target from twice as far.
    fn farther(self) -> Self {
        let eye = 2.0 * self.camera.eye - self.target;
        Self { camera: Camera { eye, ..self.camera }, ..self }
    }

    /// As a key pose. Its up is that of the picture: roll and passages over poles are in it.
    fn key(&self) -> String {
        let Camera { eye, half_up, middle, lens, .. } = self.camera;
        let lens = match lens {
            Lens::Pinhole => "radius = 0".into(),
            Lens::Thin(thin) => format!("radius = {:?}, focus = {:?}", thin.radius, thin.focus),
        };
        let [eye, target, up] = [eye, self.target, half_up.normalize()].map(|v| v.to_array());
        let fov = 2.0 * half_up.length().atan().to_degrees();
        let shift = middle.map(|halves| 0.5 * halves);
        format!(
            "eye = {eye:?}\ntarget = {target:?}\nup = {up:?}\nfov = {fov:?}\nshift = {shift:?}\nlens = {{ {lens} }}"
        )
    }
}
