//! What the lights of a tail send to one point, shadows aside, as if each were far away: in closed form those that are
//! not, such as a long tube above the point.
//!
//! The sum is a stand-in for the closed forms of dozens of lights: the ratio of the shadowed light to it can be kept for
//! other frames as that of a main light. Samples choose a light by its share of the sum, so that light that nothing
//! blocks has hardly any noise.
//!
//! Lights beyond the first [`MOST`] of a tail count with their bounds.

use super::light::LightSampler;
use crate::math::{DVec3, Rgb};
use crate::scene::{FarField, Light, Tail};

/// Lights of a tail that are looked at, the brightest ones.
const MOST: usize = 64;

/// All lights of a scene as they are seen from afar, by number.
pub(super) struct FarLights(Vec<FarLight>);

struct FarLight {
    field: FarField,
    sampler: LightSampler,
    /// Mean of the emission's colours, each without its sign.
    mean: f64,
}

/// The tails of the points of a chunk, as they are seen from there.
#[derive(Default)]
pub(super) struct TailsSeen {
    /// For each point one after another what each light, and those before it, send: means of the colours.
    sums: Vec<f64>,
    points: Vec<Seen>,
}

struct Seen {
    /// Where the point's sums begin.
    first: usize,
    /// What the lights that were not looked at send at most.
    others: f64,
    /// Irradiance of all.
    sent: Rgb,
}

/// The tail of one point.
#[derive(Clone, Copy)]
pub(super) struct TailSeen<'s> {
    sums: &'s [f64],
    others: f64,
    sent: Rgb,
}

/// A light of a tail that a sample chose.
pub(super) struct Chosen {
    /// Its number in the scene.
    pub light: u32,
    /// The probability with which it is chosen.
    pub probability: f64,
    /// Whether it is known to send something to the point; else it may be chosen by a bound, and shine elsewhere.
    pub is_looked_at: bool,
}

impl FarLights {
    pub fn of(lights: &[Light]) -> Self {
        let far = |light: &Light| {
            let (field, sampler) = (light.far_field(), LightSampler::new(light));
            // Negative light is sampled too, and counted at its pixel.
            let mean = f64::from(sampler.emission.abs().element_sum()) / 3.0;
            FarLight { field, sampler, mean }
        };
        Self(lights.iter().map(far).collect())
    }
}

impl TailsSeen {
    pub fn clear(&mut self) {
        self.sums.clear();
        self.points.clear();
    }

    /// Looks at the lights of the `tail` of the next point, `at` a place with a unit normal.
    pub fn look<'f>(&mut self, tail: &Tail, far: &'f FarLights, at: (DVec3, DVec3)) {
        let first = self.sums.len();
        let (mut sent, mut sum) = (Rgb::ZERO, 0.0);
        let mut numbers = tail.numbers().take(MOST);
        let mut next = || numbers.next().map(|number| &far.0[number as usize]);
        loop {
            let four = [next(), next(), next(), next()];
            let field = |far: Option<&'f FarLight>| far.map(|far| &far.field);
            let irradiance = FarField::irradiance(four.map(field), at);
            for (far, irradiance) in four.into_iter().flatten().zip(irradiance) {
                let irradiance = match far.field.is_close(at.0) {
                    true => far.sampler.unshadowed(at.0, at.1),
                    false => irradiance,
                };
                sent += far.sampler.emission * irradiance as f32;
                sum += far.mean * irradiance;
                self.sums.push(sum);
            }
            if four[3].is_none() {
                break;
            }
        }
        let others = if tail.len() > MOST { tail.after(MOST).total() } else { 0.0 };
        sent += Rgb::splat(others as f32);
        self.points.push(Seen { first, others, sent });
    }

    /// The tail of the point of this number.
    pub fn of(&self, point: usize) -> TailSeen<'_> {
        let Seen { first, others, sent } = self.points[point];
        let end = self.points.get(point + 1).map_or(self.sums.len(), |next| next.first);
        TailSeen { sums: &self.sums[first..end], others, sent }
    }
}

impl TailSeen<'_> {
    /// Irradiance, shadows aside; NaN where the emission of a light is NaN.
    pub fn sent(&self) -> Rgb {
        self.sent
    }

    /// Whether no light of the tail shines here.
    pub fn is_dark(&self) -> bool {
        self.total() == 0.0
    }

    /// The light of `tail`, which was looked at, at `u` in [0, 1).
    pub fn choose(&self, tail: &Tail, u: f64) -> Chosen {
        let total = self.total();
        let by_bounds = |(light, probability)| Chosen { light, probability, is_looked_at: false };
        if !(total > 0.0 && total.is_finite()) {
            return by_bounds(tail.choose(u));
        }
        let (at, near) = (u * total, self.near());
        // Where u is rounded up to the end, the last light that sends anything.
        let before_end = |sum: &f64| *sum <= at && *sum < near;
        if at < near || self.others == 0.0 {
            let k = self.sums.partition_point(before_end);
            let before = if k == 0 { 0.0 } else { self.sums[k - 1] };
            let number = tail.numbers().nth(k).unwrap_or_default();
            let probability = (self.sums[k] - before) / total;
            return Chosen { light: number, probability, is_looked_at: true };
        }
        let (light, probability) = tail.after(MOST).choose((at - near) / self.others);
        by_bounds((light, self.others / total * probability))
    }

    /// What the lights that were looked at send.
    fn near(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    fn total(&self) -> f64 {
        self.near() + self.others
    }
}
