//! Traced points on their way into a reference: one sample for each pixel and surface.

use super::{Contrast, NONE, View};
use crate::inference::{SurfacePoint, TracedPoints};
use rayon::prelude::*;

/// Pixels around one in the ring of the 3 x 3, and in that of the 5 x 5.
const NEAR: usize = 8;
const WIDE: usize = 16;

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

    /// How the ratios change around each pixel's own point.
    pub fn contrasts(&self) -> Vec<Contrast> {
        let mut contrasts = vec![Contrast::UNKNOWN; self.ratios.len()];
        self.fill(&mut contrasts, |own, near, wide, channel| {
            let ratio = |at: &u32| match *at {
                NONE => f32::NAN,
                at => self.ratios[at as usize * self.channels + channel],
            };
            contrast(ratio(&own), near.map(|at| ratio(&at)), wide.map(|at| ratio(&at)))
        });
        let before = contrasts.clone();
        self.fill(&mut contrasts, |own, near, wide, channel| {
            let of = |at: u32| before[at as usize * self.channels + channel];
            let others = near.iter().chain(wide).filter(|at| **at != NONE);
            // What is not known there is not larger.
            let far = others.map(|at| of(*at).wide).fold(of(own).wide, f32::max);
            Contrast { far, ..of(own) }
        });
        contrasts
    }

    /// Fills `out` for each pixel's own point and channel with what `of` makes of its number and those of
    /// the points around it.
    fn fill(
        &self,
        out: &mut [Contrast],
        of: impl Fn(u32, &[u32; NEAR], &[u32; WIDE], usize) -> Contrast + Sync,
    ) {
        let (channels, width) = (self.channels, self.view.size[0] as usize);
        let rows = self.slots.par_chunks(width).enumerate().map(|(y, row)| {
            let mut found = Vec::new();
            for (x, own) in row.iter().enumerate().filter(|(_, own)| **own != NONE) {
                let (near, wide) = self.around(x, y);
                found.extend((0..channels).map(|channel| of(*own, &near, &wide, channel)));
            }
            found
        });
        let rows: Vec<Vec<Contrast>> = rows.collect();
        for (row, found) in self.slots.chunks(width).zip(rows) {
            let own = row.iter().filter(|own| **own != NONE);
            for (own, found) in own.zip(found.chunks(channels.max(1))) {
                out[*own as usize * channels..][..channels].copy_from_slice(found);
            }
        }
    }

    /// The points of the same surface around the one seen at (`x`, `y`): those of the 3 x 3 pixels first,
    /// then the other ones of the 5 x 5.
    fn around(&self, x: usize, y: usize) -> ([u32; NEAR], [u32; WIDE]) {
        let [width, height] = self.view.size.map(|size| size as isize);
        let own = &self.points[self.slots[y * width as usize + x] as usize];
        let mut rings = ([NONE; NEAR], [NONE; WIDE]);
        let (mut near, mut wide) = (rings.0.iter_mut(), rings.1.iter_mut());
        for (dx, dy) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx: isize| (dx, dy))) {
            let (x, y) = (x as isize + dx, y as isize + dy);
            let is_inside = (0..width).contains(&x) && (0..height).contains(&y);
            let place = match dx.abs().max(dy.abs()) {
                0 => continue,
                1 => near.next(),
                _ => wide.next(),
            };
            let other = if is_inside { self.slots[(y * width + x) as usize] } else { NONE };
            let is_one = other != NONE && self.points[other as usize].faces_as(own);
            if let (Some(place), true) = (place, is_one) {
                *place = other;
            }
        }
        rings
    }
}

/// How a ratio changes from those in the rings around it, which lie row by row.
fn contrast(own: f32, near: [f32; NEAR], wide: [f32; WIDE]) -> Contrast {
    let bend = (0..NEAR / 2).map(|k| 0.5 * (near[k] + near[NEAR - 1 - k] - 2.0 * own).abs());
    let apart = near.iter().chain(&wide).map(|other| (other - own).abs());
    let known = apart.clone().filter(|apart| !apart.is_nan()).count();
    let wide = apart.fold(0.0, f32::max);
    let wide = if 2 * known >= NEAR + WIDE { wide } else { f32::NAN };
    Contrast { bend: bend.fold(f32::NAN, f32::max), wide, far: wide }
}

/// Takes in a ratio with its share of the samples; NaN where one is unknown.
fn join(known: &mut f32, other: f32, share: f32) {
    match (known.is_nan(), other.is_nan()) {
        (true, _) => *known = other,
        (false, false) => *known += (other - *known) * share,
        (false, true) => {}
    }
}
