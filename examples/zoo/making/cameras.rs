//! Camera moves.

use super::dice::Dice;
use glam::{DMat3, DVec3};
use std::fmt::Write;

/// Where a camera stands and what it looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    pub eye: DVec3,
    pub target: DVec3,
}

/// The camera's part of a scene file: what it says besides (`own`), and a key pose for frame `first` and each one after it.
/// Before these the camera rests at `lead`, which must be none of them: frames of one camera are one frame.
pub fn camera_table(own: &str, keys: &[String], lead: &str, first: usize) -> String {
    let frames = first + keys.len() - 1;
    let mut text = format!("[camera]\nframes = {frames}\n{own}");
    let before = (first > 1).then_some((first - 1, lead));
    for (frame, key) in before.into_iter().chain((first..).zip(keys.iter().map(String::as_str))) {
        let at = (frame - 1) as f64 / (frames - 1) as f64;
        let _ = writeln!(text, "[[camera.keys]]\nat = {at:?}\n{key}");
    }
    text
}

/// What a family offers to cameras.
pub struct Stage {
    /// A good place to look from.
    pub eye: DVec3,
    /// What is worth looking at.
    pub focus: DVec3,
    /// How far a camera may go from `eye` to any side without meeting anything.
    pub room: f64,
    /// Where a flight may end, whatever lies between; and what it then looks at.
    pub far: Option<Pose>,
}

/// The kinds of move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Move {
    Pan,
    DollyIn,
    DollyOut,
    Flight,
    Turn,
    NearStop,
    Orbit,
}

impl Move {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pan => "pan",
            Self::DollyIn => "dolly-in",
            Self::DollyOut => "dolly-out",
            Self::Flight => "flight",
            Self::Turn => "turn",
            Self::NearStop => "near-stop",
            Self::Orbit => "orbit",
        }
    }

    /// One that the stage has room for.
    pub fn draw(dice: &mut Dice, stage: &Stage) -> Self {
        let all = [
            Self::Pan,
            Self::DollyIn,
            Self::DollyOut,
            Self::Turn,
            Self::NearStop,
            Self::Orbit,
            Self::Flight,
        ];
        let count = if stage.far.is_some() { all.len() } else { all.len() - 1 };
        dice.pick(&all[..count])
    }

    /// The poses of `frames` frames. How far the move goes is random: from a step to a sweep.
    pub fn poses(self, dice: &mut Dice, stage: &Stage, frames: usize) -> Vec<Pose> {
        let share = dice.scale(0.15, 1.0);
        let side = if dice.chance(0.5) { 1.0 } else { -1.0 };
        let path = Path::new(self, stage, share * side);
        (0..frames).map(|i| path.at(i as f64 / (frames.max(2) - 1) as f64)).collect()
    }
}

/// A move with its amount.
struct Path<'a> {
    kind: Move,
    stage: &'a Stage,
    amount: f64,
}

impl<'a> Path<'a> {
    fn new(kind: Move, stage: &'a Stage, amount: f64) -> Self {
        Self { kind, stage, amount }
    }

    /// The pose at progress `t` in [0, 1].
    fn at(&self, t: f64) -> Pose {
        let Stage { eye, focus, room, far } = *self.stage;
        let view = focus - eye;
        let right = view.cross(DVec3::Y).normalize();
        let share = self.amount.abs();
        let slide = |eye: DVec3, by: DVec3| Pose { eye: eye + by, target: focus + 0.5 * by };
        match self.kind {
            Move::Pan => {
                // Sideways, and up a little: down there may be ground.
                let rise = DVec3::Y * (0.3 * share * room * t);
                slide(eye, right * (self.amount * room * (t - 0.5)) + rise)
            }
            Move::DollyIn => Pose { eye: eye + view * (0.6 * share * t), target: focus },
            Move::DollyOut => Pose { eye: eye + view * (0.6 * share * (1.0 - t)), target: focus },
            Move::NearStop => {
                slide(eye, (right + 0.3 * view.normalize()) * (0.01 * self.amount * room * t))
            }
            Move::Turn => {
                let turned = DMat3::from_rotation_y(0.6 * self.amount * (t - 0.5)) * view;
                Pose { eye, target: eye + turned }
            }
            Move::Orbit => {
                let angle = (room / view.length()).min(0.8) * self.amount * (t - 0.5);
                Pose { eye: focus - DMat3::from_rotation_y(angle) * view, target: focus }
            }
            Move::Flight => {
                let end = far.unwrap_or(Pose { eye, target: focus });
                let s = share * t;
                Pose { eye: eye.lerp(end.eye, s), target: focus.lerp(end.target, s) }
            }
        }
    }
}
