//! A sample of a light, in terms that are the same for every kind.

use crate::intersect::RayEnd;
use crate::math::DVec3;
use std::f64::consts::FRAC_1_PI;

/// A point of a light, or a direction to it, as seen from a surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightSample {
    /// Where the shadow ray goes.
    pub target: ShadowTarget,
    /// Unit direction from the surface to the target.
    pub wi: DVec3,
    /// Radiance that arrives along `wi` where nothing is in the way, per unit of emission; infinite from a delta
    /// light.
    pub radiance: f64,
    pub pdf: Pdf,
}

/// Where a shadow ray goes, scene space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShadowTarget {
    /// To a point of a light.
    Point(RayEnd),
    /// Along this direction without end, from the smooth surface that the facet stands for.
    Direction(DVec3),
    /// Along this direction without end, from the facet.
    Sky(DVec3),
}

/// The density of a light's samples at one of them, in the measure by which they are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pdf {
    /// A delta light: all samples are the same.
    Delta,
    /// Even over the solid angle of a light, with this density per steradian. The direction `drawn` and `wi`, which
    /// leads to the rounded point, differ in their last bits.
    SolidAngle { density: f64, drawn: DVec3 },
    /// Even over the area of a flat light.
    Area(AreaPdf),
    /// By the cosine to the surface's normal, which is this.
    Cosine(f64),
}

/// The density of points that are even over a flat area, as seen from a surface point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AreaPdf {
    /// From the surface to the sample.
    pub to_light: DVec3,
    /// The light's unit normal.
    pub normal: DVec3,
    /// The light's area.
    pub area: f64,
}

/// Whoever takes samples. A trait and no closure: its method is inlined for every kind of light, which saves
/// a twentieth of a traced frame.
pub trait SampleSink {
    /// Takes one more.
    fn push(&mut self, sample: LightSample);
}

impl Pdf {
    /// Density per steradian; `None` of a delta light.
    pub fn per_steradian(&self) -> Option<f64> {
        match self {
            Self::Delta => None,
            Self::SolidAngle { density, .. } => Some(*density),
            Self::Area(pdf) => Some(pdf.per_steradian()),
            Self::Cosine(cos) => Some(cos * FRAC_1_PI),
        }
    }

    /// The cosine to the unit normal `n` over the density, up to a factor that all samples of a light share; 0 below
    /// the horizon. Times the radiance, which they also share, this is the irradiance that a sample stands for.
    ///
    /// The shared factor is left out, not computed: ratios of weights are then the same to the last bit.
    #[inline(always)] // Once for each shadow ray.
    pub fn weight(&self, n: DVec3) -> f64 {
        match self {
            Self::Delta | Self::Cosine(_) => 1.0,
            Self::SolidAngle { drawn, .. } => drawn.dot(n).max(0.0),
            Self::Area(pdf) => pdf.weight(n),
        }
    }
}

impl AreaPdf {
    /// Density per steradian: the area seen under a unit of solid angle, over all of it.
    pub fn per_steradian(&self) -> f64 {
        let d2 = self.to_light.length_squared();
        d2 * d2.sqrt() / (self.to_light.dot(self.normal).abs() * self.area)
    }

    /// The cosine at the surface over [`per_steradian`](Self::per_steradian), without the area, by one division.
    fn weight(&self, n: DVec3) -> f64 {
        let d2 = self.to_light.length_squared();
        let cos_light = self.to_light.dot(self.normal).abs();
        (self.to_light.dot(n) * cos_light / (d2 * d2)).max(0.0)
    }
}
