//! Traced points gathered for a reference: one sample for each pixel and surface.

use super::contrast::contrasts;
use super::{Contrast, NONE, View};
use crate::inference::{SurfacePoint, TracedPoints};

/// A frame's points before they are put in the order of a reference.
pub(super) struct Gathered {
    pub points: Vec<SurfacePoint>,
    /// For each point the ratio in each channel; NaN where unknown.
    pub ratios: Vec<f32>,
    /// For each pixel, row by row, the number of the point that is seen there directly.
    pub slots: Vec<u32>,
    /// Numbers of all other points: seen in mirrors, through glass, or beside another surface in a pixel.
    pub others: Vec<u32>,
    channels: usize,
    view: View,
}

impl Gathered {
    pub fn of(traced: &TracedPoints, channels: usize, view: &View) -> Self {
        let [width, height] = view.size.map(|size| size as usize);
        let mut own = Self {
            points: Vec::with_capacity(traced.points.len()),
            ratios: Vec::with_capacity(traced.ratios.len()),
            slots: vec![NONE; width * height],
            others: Vec::new(),
            channels,
            view: *view,
        };
        for (i, t) in traced.points.iter().enumerate() {
            let ratios = &traced.ratios[i * channels..(i + 1) * channels];
            own.take(t.y as usize * width + t.x as usize, &t.point, ratios);
        }
        own
    }

    fn take(&mut self, pixel: usize, point: &SurfacePoint, ratios: &[f32]) {
        // As it comes back from a file.
        let own = SurfacePoint { p: point.p.as_vec3().as_dvec3(), ..*point };
        let slot = self.slots[pixel] as usize;
        let there = self.points.get(slot).copied().filter(|_| point.direct);
        if there.is_some_and(|there| there.is_one_surface(&own)) {
            let share = self.points[slot].join(&own);
            let known = &mut self.ratios[slot * self.channels..][..self.channels];
            known.iter_mut().zip(ratios).for_each(|(known, other)| join(known, *other, share));
            return;
        }
        let at = self.points.len() as u32;
        let is_own = point.direct && there.is_none_or(|there| there.samples < own.samples);
        if is_own {
            let displaced = std::mem::replace(&mut self.slots[pixel], at);
            self.others.extend((displaced != NONE).then_some(displaced));
        } else {
            self.others.push(at);
        }
        self.points.push(own);
        self.ratios.extend_from_slice(ratios);
    }

    /// The contrasts of the ratios around each pixel's point.
    pub fn contrasts(&self) -> Vec<Contrast> {
        let by = (self.view.size[0] as usize, self.channels);
        contrasts(&self.points, &self.ratios, &self.slots, by)
    }
}

/// Averages `known` with another ratio that has this `share` of the samples; NaN where either is unknown.
fn join(known: &mut f32, other: f32, share: f32) {
    match (known.is_nan(), other.is_nan()) {
        (true, _) => *known = other,
        (false, false) => *known += (other - *known) * share,
        (false, true) => {}
    }
}
