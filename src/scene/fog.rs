//! Fog: a homogeneous medium that fills the space between surfaces.

use super::Recentring;
use crate::error::{Error, Result};
use crate::math::{Bounds3, DAffine3, DMat3, Rgb};
use serde::{Deserialize, Serialize};

/// A medium that absorbs and scatters light, everywhere outside of glass or in a box. Light in it is scattered once.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fog {
    /// Extinction coefficient, per unit of length: light that goes straight on falls to 1/e over its inverse. The same for
    /// all colours.
    pub extinction: f64,
    /// Single-scattering albedo: the part of what is extinguished that is scattered, the rest being absorbed.
    pub albedo: Rgb,
    /// Mean cosine of the scattering angle, -1 (exclusive) to 1: 0 scatters alike in all directions, more than that
    /// forwards (Henyey and Greenstein, 1941).
    pub anisotropy: f64,
    /// The box that the fog fills; everywhere where there is none. Light from outside the scene then never arrives.
    pub bounds: Option<Bounds3>,
}

impl Fog {
    /// Errors: numbers out of range.
    pub(super) fn check(&self) -> Result<()> {
        let Self { extinction, albedo, anisotropy, bounds } = self;
        let refuse = |what: String| Err(Error::Usage(format!("the fog has {what}")));
        if !(extinction.is_finite() && *extinction >= 0.0) {
            return refuse(format!("the extinction {extinction}"));
        }
        if !albedo.to_array().iter().all(|share| (0.0..=1.0).contains(share)) {
            return refuse(format!("the albedo {albedo}; from 0 to 1 it may be"));
        }
        if anisotropy.is_nan() || anisotropy.abs() >= 1.0 {
            return refuse(format!("the anisotropy {anisotropy}; it lies between -1 and 1"));
        }
        let is_box =
            |b: &Bounds3| b.min.is_finite() && b.max.is_finite() && b.min.cmplt(b.max).all();
        if bounds.as_ref().is_some_and(|bounds| !is_box(bounds)) {
            return refuse("a box without an inside".into());
        }
        Ok(())
    }

    /// The same in scene space.
    pub(super) fn into_scene(self, recentring: &Recentring) -> Self {
        let to_scene = |b: Bounds3| Bounds3 {
            min: recentring.point_to_scene(b.min),
            max: recentring.point_to_scene(b.max),
        };
        let extinction = self.extinction / recentring.scale();
        Self { extinction, bounds: self.bounds.map(to_scene), ..self }
    }

    /// Moves the box by `transform`. The extinction stays as it is given, as that of glass.
    ///
    /// Errors: a box that would be turned.
    pub(super) fn transform(&mut self, transform: &DAffine3) -> Result<()> {
        let Some(bounds) = &mut self.bounds else { return Ok(()) };
        let scale = transform.matrix3;
        let diagonal =
            DMat3::from_diagonal(scale.x_axis.with_y(scale.y_axis.y).with_z(scale.z_axis.z));
        if scale != diagonal {
            return Err(Error::Usage("a turned box of fog is none that can be rendered".into()));
        }
        *bounds = bounds.transformed(transform);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DVec3;

    fn fog() -> Fog {
        let bounds = Bounds3 { min: DVec3::splat(-1.0), max: DVec3::ONE };
        Fog { extinction: 0.5, albedo: Rgb::splat(0.9), anisotropy: 0.3, bounds: Some(bounds) }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        assert!(fog().check().is_ok());
        let flat = Bounds3 { min: DVec3::ZERO, max: DVec3::X };
        let bad = [
            Fog { extinction: -1.0, ..fog() },
            Fog { extinction: f64::INFINITY, ..fog() },
            Fog { albedo: Rgb::new(0.0, 1.5, 0.0), ..fog() },
            Fog { anisotropy: 1.0, ..fog() },
            Fog { anisotropy: f64::NAN, ..fog() },
            Fog { bounds: Some(flat), ..fog() },
        ];
        bad.iter().for_each(|fog| assert!(fog.check().is_err(), "{fog:?}"));
    }

    #[test]
    fn a_box_is_moved_and_scaled_but_not_turned() {
        let mut moved = fog();
        let scaled = DAffine3::from_scale(DVec3::new(2.0, 1.0, 3.0));
        moved.transform(&(DAffine3::from_translation(DVec3::Y) * scaled)).unwrap();
        let expected = Bounds3 { min: DVec3::new(-2.0, 0.0, -3.0), max: DVec3::new(2.0, 2.0, 3.0) };
        assert_eq!(moved.bounds, Some(expected));
        assert!(fog().transform(&DAffine3::from_rotation_y(0.5)).is_err());
    }
}
