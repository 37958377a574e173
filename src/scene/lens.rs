//! Lenses: where a camera ray starts and which way it leaves, and what of the scene a lens shows sharp.
//!
//! All that differs from lens to lens stands here. [`ShotLens`] is the lens of a move, [`Lens`] that of one
//! frame's camera. Lengths are world units until [`Lens::to_scene`].

mod thin;

pub use thin::{Focus, LensKey, ThinLens, ThinLensPath};

use super::Recentring;
use crate::error::Result;
use crate::math::DVec3;
use serde::{Deserialize, Serialize};

/// The lens of a shot, frame by frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub enum ShotLens {
    /// Everything is sharp.
    #[default]
    Pinhole,
    /// What lies at one distance is sharp.
    Thin(ThinLensPath),
}

/// The lens of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Lens {
    /// Everything is sharp.
    #[default]
    Pinhole,
    /// What lies at one distance is sharp.
    Thin(ThinLens),
}

impl ShotLens {
    /// Checks the lens of all frames.
    ///
    /// Errors: [`Error::Usage`](crate::error::Error::Usage) with what is wrong.
    pub(super) fn check(&self) -> Result<()> {
        match self {
            Self::Pinhole => Ok(()),
            Self::Thin(path) => path.check(),
        }
    }

    /// The lens at `progress` in `[0, 1]` of the path, where the camera's target is `target` world units away.
    pub(super) fn at(&self, progress: f64, target: f64) -> Lens {
        match self {
            Self::Pinhole => Lens::Pinhole,
            Self::Thin(path) => path.at(progress, target),
        }
    }

    /// Whether anything is out of focus, and why, in a few words.
    pub fn reason(&self) -> (bool, String) {
        match self {
            Self::Pinhole => (false, "the camera is a pinhole".into()),
            Self::Thin(path) => path.reason(),
        }
    }
}

impl Lens {
    /// Numbers of its encoding.
    pub(super) const NUMBERS: usize = 5;

    /// Whether a ray depends on the point of the lens that it passes.
    pub fn is_sampled(&self) -> bool {
        match self {
            Self::Pinhole => false,
            Self::Thin(_) => true,
        }
    }

    /// Whether rays through it have numbers that can be traced.
    pub(super) fn is_in_range(&self) -> bool {
        match self {
            Self::Pinhole => true,
            Self::Thin(lens) => lens.is_in_range(),
        }
    }

    /// Distance along the view axis at which all is sharp; `None` where all is sharp anywhere.
    pub fn focus(&self) -> Option<f64> {
        match self {
            Self::Pinhole => None,
            Self::Thin(lens) => Some(lens.focus),
        }
    }

    /// Where the ray that passes the lens at `u` in the unit square starts, seen from the eye, and its
    /// direction (not unit), if through the lens's middle it would leave along `toward`, which is 1 long
    /// along the view axis. `right` and `up` are the image's unit directions.
    pub(super) fn bend(&self, toward: DVec3, axes: [DVec3; 2], u: [f64; 2]) -> (DVec3, DVec3) {
        match self {
            Self::Pinhole => (DVec3::ZERO, toward),
            Self::Thin(lens) => lens.bend(toward, axes, u),
        }
    }

    /// Diameter of the circle, at `depth` along the view axis, from which a ray through one point of the image
    /// may come: the circle of confusion in object space.
    pub fn blur(&self, depth: f64) -> f64 {
        match self {
            Self::Pinhole => 0.0,
            Self::Thin(lens) => lens.blur(depth),
        }
    }

    /// The same lens in scene space.
    pub(super) fn to_scene(self, recentring: &Recentring) -> Self {
        match self {
            Self::Pinhole => Self::Pinhole,
            Self::Thin(lens) => Self::Thin(lens.to_scene(recentring)),
        }
    }

    /// All that tells it from other lenses: the number of its kind, and its own.
    pub(super) fn numbers(&self) -> [f64; Self::NUMBERS] {
        match self {
            Self::Pinhole => [0.0; Self::NUMBERS],
            Self::Thin(lens) => {
                let [a, b, c, d] = lens.numbers();
                [1.0, a, b, c, d]
            }
        }
    }

    /// The lens with these [`numbers`](Self::numbers); `None` where no lens has them.
    pub(super) fn from_numbers(numbers: [f64; Self::NUMBERS]) -> Option<Self> {
        let [kind, own @ ..] = numbers;
        match kind {
            0.0 => (own == [0.0; 4]).then_some(Self::Pinhole),
            1.0 => ThinLens::from_numbers(own).map(Self::Thin),
            _ => None,
        }
    }
}
