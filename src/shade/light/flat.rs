//! What flat lights have in common.

use super::{AreaPdf, LightSample, Pdf, ShadowTarget};
use crate::intersect::{PlaneError, RayEnd};
use crate::math::DVec3;

/// The plane of a flat light.
pub(super) struct Flat {
    /// Unit normal of the emitting side.
    pub normal: DVec3,
    /// What f32 may make of the triangles that show it.
    pub plane_error: PlaneError,
    /// The light's area.
    pub area: f64,
}

impl Flat {
    /// `point` of the light, one of many that are uniform over its area, as seen from `p`.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, p: DVec3, point: DVec3) -> LightSample {
        let pdf = self.pdf(p, point);
        LightSample {
            target: self.target(point),
            wi: pdf.to_light.normalize(),
            radiance: 1.0,
            pdf: Pdf::Area(pdf),
        }
    }

    /// Density at `point`, seen from `p`, of points that are uniform over the area.
    #[inline(always)]
    pub fn pdf(&self, p: DVec3, point: DVec3) -> AreaPdf {
        AreaPdf { to_light: point - p, normal: self.normal, area: self.area }
    }

    /// `point` of the light, for a shadow ray.
    #[inline(always)]
    pub fn target(&self, point: DVec3) -> ShadowTarget {
        let Self { normal, plane_error, .. } = *self;
        ShadowTarget::Point(RayEnd { point, normal, plane_error })
    }
}
