//! Traced points gathered for a reference: one sample for each pixel and surface.

use super::contrast::contrasts;
use super::{Contrast, NONE, View};
use crate::inference::{NO_LIGHT, SurfacePoint, TracedPoints, channel_of};

/// A frame's points before they are put in the order of a reference.
pub(super) struct Gathered {
    pub points: Vec<SurfacePoint>,
    /// For each point the ratio in each channel; NaN where unknown.
    pub ratios: Vec<f32>,
    /// For each pixel, row by row, the number of the point that is seen there directly.
    pub slots: Vec<u32>,
    /// Numbers of all other points: seen in mirrors, through glass, or beside another surface in a pixel.
    pub others: Vec<u32>,
    /// For each point the light of each channel; empty where each channel has the same light everywhere.
    pub lights: Vec<u32>,
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
            lights: Vec::with_capacity(traced.lights.len()),
            channels,
            view: *view,
        };
        for (i, t) in traced.points.iter().enumerate() {
            let range = i * channels..(i + 1) * channels;
            let lights = traced.lights.get(range.clone()).unwrap_or_default();
            let pixel = t.y as usize * width + t.x as usize;
            own.take(pixel, &t.point, &traced.ratios[range], lights);
        }
        own
    }

    fn take(&mut self, pixel: usize, point: &SurfacePoint, ratios: &[f32], lights: &[u32]) {
        // As it comes back from a file.
        let own = SurfacePoint { p: point.p.as_vec3().as_dvec3(), ..*point };
        let slot = self.slots[pixel] as usize;
        let there = self.points.get(slot).copied().filter(|_| point.direct);
        if there.is_some_and(|there| there.is_one_surface(&own)) {
            let share = self.points[slot].join(&own);
            self.join_ratios(slot, share, ratios, lights);
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
        self.lights.extend_from_slice(lights);
    }

    /// Averages the ratios of a point with others of the same surface that have this `share` of the samples. Lights
    /// that the point has no channel for are left out.
    fn join_ratios(&mut self, point: usize, share: f32, ratios: &[f32], lights: &[u32]) {
        let own = point * self.channels..(point + 1) * self.channels;
        let known = &mut self.ratios[own.clone()];
        let own_lights = self.lights.get_mut(own).unwrap_or_default();
        for (k, other) in ratios.iter().enumerate() {
            let at = channel_of(own_lights, lights, k).or_else(|| {
                let free = own_lights.iter().position(|light| *light == NO_LIGHT)?;
                own_lights[free] = lights[k];
                Some(free)
            });
            if let Some(at) = at {
                join(&mut known[at], *other, share);
            }
        }
    }

    /// The contrasts of the ratios around each pixel's point.
    pub fn contrasts(&self) -> Vec<Contrast> {
        let by = (self.view.size[0] as usize, self.channels);
        contrasts(&self.points, (&self.ratios, &self.lights), &self.slots, by)
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
