//! An environment as a light: samples, and the irradiance without shadows.
//!
//! Its light has a colour of its own in every direction, so that it is no [`LightSampler`](super::LightSampler).
//! Diffuse points are lit by the means of the table's cells, of which the irradiance is known.

use crate::math::{DMat3, DVec3, Rgb, orthonormal_basis};
use crate::sampling::{cosine_hemisphere, to_world};
use crate::scene::{SceneEnvironment, brightness};
use std::f64::consts::FRAC_1_PI;

/// Most of the samples that go by importance: some must go everywhere.
const MOST_BY_IMPORTANCE: f64 = 0.9;

/// An environment that shines.
pub struct EnvironmentLight<'a> {
    tables: &'a SceneEnvironment,
    to_own: DMat3,
}

/// The hemisphere over one surface point.
pub struct EnvironmentView<'l> {
    light: &'l EnvironmentLight<'l>,
    n: DVec3,
    basis: (DVec3, DVec3),
    /// Part of the samples that go by importance.
    by_importance: f64,
}

/// A direction from which light comes.
#[derive(Debug, Clone, Copy)]
pub struct EnvironmentSample {
    /// Unit direction, scene space.
    pub wi: DVec3,
    /// What comes from there, the mean of its cell.
    pub radiance: Rgb,
    /// Density of the samples there, per steradian.
    pub density: f64,
}

impl<'a> EnvironmentLight<'a> {
    pub fn new(tables: &'a SceneEnvironment) -> Self {
        Self { tables, to_own: tables.environment.orientation.transpose() }
    }

    /// Irradiance without shadows on a surface with the unit normal `n`.
    pub fn unshadowed(&self, n: DVec3) -> Rgb {
        self.tables.irradiance.at(self.to_own * n).0
    }

    /// The light as seen from a surface with the unit normal `n`.
    pub fn seen_from(&self, n: DVec3) -> EnvironmentView<'_> {
        let (all, above_mean) = self.tables.irradiance.at(self.to_own * n);
        let part = f64::from(above_mean) / brightness(all);
        let has_contrast = self.tables.radiance.has_contrast() && part > 0.0;
        let by_importance = if has_contrast { part.min(MOST_BY_IMPORTANCE) } else { 0.0 };
        EnvironmentView { light: self, n, basis: orthonormal_basis(n), by_importance }
    }

    /// A direction by importance alone, for `u` in the unit square; `None` of a sky that is the same all round.
    pub fn sample_li(&self, u: [f64; 2]) -> Option<EnvironmentSample> {
        let table = &self.tables.radiance;
        let (own, cell) = table.sample(u)?;
        let wi = self.tables.environment.orientation * own;
        Some(EnvironmentSample { wi, radiance: table.radiance(cell), density: table.pdf(cell) })
    }

    /// What comes from the unit direction `wi`, the mean of its cell, and the density of [`sample_li`](Self::sample_li)
    /// there; `None` of a sky that is the same all round.
    pub fn towards(&self, wi: DVec3) -> (Rgb, Option<f64>) {
        let table = &self.tables.radiance;
        let cell = table.cell(self.to_own * wi);
        (table.radiance(cell), table.has_contrast().then(|| table.pdf(cell)))
    }

    /// Density of [`sample_li`](Self::sample_li) along the unit direction `wi`, per steradian.
    pub fn pdf_li(&self, wi: DVec3) -> f64 {
        self.tables.radiance.pdf(self.tables.radiance.cell(self.to_own * wi))
    }

    /// The colours that ratios are kept of.
    pub fn tints(&self) -> &'a [Rgb] {
        self.tables.radiance.tints()
    }
}

impl EnvironmentView<'_> {
    /// A direction for `u` in the unit square: by importance or by the cosine, at the density of both together (balance
    /// heuristic; Veach and Guibas, 1995). Some lie below the horizon.
    #[inline(always)] // Once for each shadow ray.
    pub fn sample_li(&self, [u, v]: [f64; 2]) -> EnvironmentSample {
        let part = self.by_importance;
        let sampled = match u < part {
            true => self.light.sample_li([u / part, v]),
            false => None,
        };
        match sampled {
            Some(sample) => {
                let cos = sample.wi.dot(self.n).max(0.0);
                EnvironmentSample { density: self.mixed(sample.density, cos), ..sample }
            }
            None => self.by_cosine([((u - part) / (1.0 - part)).max(0.0), v]),
        }
    }

    /// A direction by the cosine, never below the horizon.
    pub fn by_cosine(&self, u: [f64; 2]) -> EnvironmentSample {
        let local = cosine_hemisphere(u);
        let wi = to_world(local, self.basis, self.n);
        let table = &self.light.tables.radiance;
        let cell = table.cell(self.light.to_own * wi);
        let density = self.mixed(table.pdf(cell), local.z);
        EnvironmentSample { wi, radiance: table.radiance(cell), density }
    }

    fn mixed(&self, by_importance: f64, cos: f64) -> f64 {
        let part = self.by_importance;
        part * by_importance + (1.0 - part) * cos * FRAC_1_PI
    }
}
