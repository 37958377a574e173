//! `[fog]`.

use super::at::At;
use super::number::{Anisotropy, NotNegative};
use super::region::Region;
use super::report::Source;
use super::vector::Reflectance;
use crate::error::Result;
use crate::math::Rgb;
use crate::scene;
use schemars::JsonSchema;
use serde::Deserialize;

/// A homogeneous medium between the surfaces, which absorbs light and scatters it once.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Fog {
    /// Extinction coefficient, per world unit: over the distance 3 / extinction, a twentieth of the light goes straight on.
    extinction: NotNegative,
    /// Part of what is extinguished that is scattered; the rest is absorbed.
    #[serde(default = "Reflectance::white")]
    albedo: Reflectance,
    /// Mean cosine of the scattering angle: 0 alike in all directions, near 1 forwards, near -1 backwards.
    #[serde(default = "isotropic")]
    anisotropy: Anisotropy,
    /// The box that the fog fills. Absent: it is everywhere, and hides sky and suns.
    #[serde(rename = "box")]
    bounds: Option<At<Region>>,
}

fn isotropic() -> Anisotropy {
    Anisotropy(0.0)
}

impl Fog {
    /// As scene data, world space.
    ///
    /// Errors: a box without an inside.
    pub fn build(&self, source: &Source) -> Result<scene::Fog> {
        Ok(scene::Fog {
            extinction: self.extinction.0,
            albedo: Rgb::from_array(self.albedo.0.map(|share| share.0 as f32)),
            anisotropy: self.anisotropy.0,
            bounds: self.bounds.as_ref().map(|bounds| bounds.bounds(source)).transpose()?,
        })
    }
}
