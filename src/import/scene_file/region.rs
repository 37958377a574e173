//! An upright box.

use super::at::At;
use super::report::Source;
use super::vector::Point;
use crate::error::Result;
use crate::math::Bounds3;
use schemars::JsonSchema;
use serde::Deserialize;

/// An upright box.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Region {
    /// Corner with the smallest coordinates, world units.
    min: Point,
    /// Corner with the largest coordinates, world units.
    max: Point,
}

impl At<Region> {
    /// The box, world space.
    ///
    /// Errors: `min` not below `max` on an axis.
    pub fn bounds(&self, source: &Source) -> Result<Bounds3> {
        let (min, max) = (self.min.vec(), self.max.vec());
        if min.cmplt(max).all() {
            return Ok(Bounds3 { min, max });
        }
        let message = "`min` must be smaller than `max` in x, y and z";
        Err(source.fault(&self.span, message).into())
    }
}
