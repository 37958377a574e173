//! Traced points on their way into a reference: one sample for each pixel and surface.

use super::{Change, NONE, View};
use crate::inference::{SurfacePoint, TracedPoints};
use rayon::prelude::*;

/// How far away samples lie beside one another at most, pixels.
const BESIDE: isize = 3;

/// A frame's points before they are laid out.
pub(super) struct Gathered {
    pub points: Vec<SurfacePoint>,
    /// For each of them the ratio in each channel; NaN where unknown.
    pub ratios: Vec<f32>,
    /// For each pixel, row by row, the point that is seen there directly.
    pub slots: Vec<u32>,
    /// Points that are no pixel's own: seen in mirrors, through glass, beside another surface.
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

    /// How the ratios change around each point: towards the nearest of its surface to the left,
    /// the right, above and below, if that is no further than a few pixels.
    pub fn changes(&self) -> Vec<Change> {
        let (channels, width) = (self.channels, self.view.size[0] as usize);
        let rows = self.slots.par_chunks(width).enumerate().map(|(y, row)| {
            let mut changes = Vec::new();
            for (x, own) in row.iter().enumerate().filter(|(_, own)| **own != NONE) {
                let axes = [(1, 0), (0, 1)]
                    .map(|(dx, dy)| [self.beside(x, y, (dx, dy)), self.beside(x, y, (-dx, -dy))]);
                let own = *own as usize;
                changes.extend((0..channels).map(|channel| self.change_along(&axes, own, channel)));
            }
            changes
        });
        let rows: Vec<Vec<Change>> = rows.collect();
        let mut changes = vec![Change::UNKNOWN; self.ratios.len()];
        for (row, found) in self.slots.chunks(width).zip(rows) {
            let own = row.iter().filter(|own| **own != NONE);
            for (own, found) in own.zip(found.chunks(channels.max(1))) {
                changes[*own as usize * channels..][..channels].copy_from_slice(found);
            }
        }
        changes
    }

    /// The nearest point of the surface seen at (`x`, `y`) in a direction.
    fn beside(&self, x: usize, y: usize, (dx, dy): (isize, isize)) -> Option<usize> {
        let [width, height] = self.view.size.map(|size| size as usize);
        let own = &self.points[self.slots[y * width + x] as usize];
        (1..=BESIDE).find_map(|k| {
            let x = x.checked_add_signed(dx * k).filter(|x| *x < width)?;
            let y = y.checked_add_signed(dy * k).filter(|y| *y < height)?;
            let other = self.slots[y * width + x];
            let is_one = other != NONE && self.points[other as usize].faces_as(own);
            is_one.then_some(other as usize)
        })
    }

    /// How a ratio changes from point `own` to those on both sides of it along two
    /// axes.
    fn change_along(&self, axes: &[[Option<usize>; 2]; 2], own: usize, channel: usize) -> Change {
        let mut change = Change::UNKNOWN;
        for axis in axes {
            let [there, back] =
                axis.map(|other| other.map_or(f32::NAN, |other| self.rise(own, other, channel)));
            let slope = there.abs().max(back.abs());
            change = change.max(Change { slope, bend: (there + back).abs() });
        }
        change
    }

    /// By how much a ratio rises from one point to another, per footprint.
    fn rise(&self, from: usize, to: usize, channel: usize) -> f32 {
        let (a, b) = (&self.points[from], &self.points[to]);
        let depth = (a.p - self.view.eye).dot(self.view.forward);
        let footprint = (depth * self.view.pixel_size) as f32;
        let per_footprint = footprint / (a.p.distance(b.p) as f32).max(footprint);
        let [a, b] = [from, to].map(|i| self.ratios[i * self.channels + channel]);
        (b - a) * per_footprint
    }
}

/// Takes in a ratio with its share of the samples; NaN where one is unknown.
fn join(known: &mut f32, other: f32, share: f32) {
    match (known.is_nan(), other.is_nan()) {
        (true, _) => *known = other,
        (false, false) => *known += (other - *known) * share,
        (false, true) => {}
    }
}
