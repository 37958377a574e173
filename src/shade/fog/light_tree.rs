//! Which light is sampled along a stretch of fog, where a scene has many: a tree of balls.
//!
//! A ball that is far from the stretch for its size stands for all lights in it: they are chosen by their power alone. A closer one is
//! opened. So a stretch looks at few balls, however many lights there are (the idea of Walter et al., 2005, for one sample
//! of all lights in place of their sum).

use super::{Distances, FogSegment};
use crate::math::{Bounds3, DVec3};
use crate::scene::FarField;
use std::ops::Range;

/// A ball is opened where its centre is nearer than this times its radius.
const CLOSE: f64 = 2.0;

/// A light as it is seen from afar.
pub struct FarLight {
    field: FarField,
    /// Intensity, the mean of its colours without their signs.
    power: f64,
}

impl FarLight {
    /// A light of this mean emission.
    pub fn new(field: FarField, emission: f64) -> Self {
        Self { field, power: emission * field.intensity() }
    }

    /// Whether it has a place, which parallel light has not.
    pub fn is_near(&self) -> bool {
        self.field.place().is_some()
    }

    /// Where along `segment` samples of it lie.
    pub fn distances(&self, extinction: f64, segment: &FogSegment) -> Distances {
        distances(self.field.place(), extinction, segment)
    }
}

fn distances(place: Option<(DVec3, f64)>, extinction: f64, segment: &FogSegment) -> Distances {
    let distances = Distances::new(extinction, segment.length);
    match place {
        Some((centre, reach)) => distances.near(segment.dir, centre - segment.start, reach),
        None => distances,
    }
}

/// Lights, in balls.
pub struct LightTree {
    /// Each before those within it.
    balls: Vec<Ball>,
    /// Numbers of lights, those of a ball next to one another.
    order: Vec<u32>,
    /// Sums of the powers up to each of these.
    sums: Vec<f64>,
}

struct Ball {
    /// Centre and radius; `None` of one light without a place.
    place: Option<(DVec3, f64)>,
    /// Its lights in `order`.
    lights: Range<usize>,
    /// The first ball that is not within it.
    next: usize,
}

/// A ball that was looked at, with the sum of what it and those before it may scatter.
pub type SeenBall = (usize, f64);

impl LightTree {
    /// Of `lights`.
    pub fn new(lights: &[FarLight]) -> Self {
        let (mut near, far): (Vec<u32>, Vec<u32>) =
            (0..lights.len() as u32).partition(|at| lights[*at as usize].is_near());
        let mut tree = Self { balls: Vec::new(), order: Vec::new(), sums: Vec::new() };
        for at in far {
            tree.push(lights, &[at], None);
        }
        tree.divide(lights, &mut near);
        let mut sum = 0.0;
        tree.sums.extend(tree.order.iter().map(|at| {
            sum += lights[*at as usize].power;
            sum
        }));
        tree
    }

    /// Adds a ball of these lights, as the last; returns its number.
    fn push(&mut self, lights: &[FarLight], own: &[u32], bounds: Option<Bounds3>) -> usize {
        let place = bounds.map(|bounds| {
            let centre = bounds.centre();
            let reach = |at: &u32| {
                let place = lights[*at as usize].field.place();
                place.map_or(0.0, |(own, reach)| own.distance(centre) + reach)
            };
            (centre, own.iter().map(reach).fold(0.0, f64::max))
        });
        let first = self.order.len();
        if own.len() == 1 {
            self.order.extend(own);
        }
        let next = self.balls.len() + 1;
        self.balls.push(Ball { place, lights: first..first + own.len(), next });
        next - 1
    }

    /// Adds the balls of lights that have places.
    fn divide(&mut self, lights: &[FarLight], own: &mut [u32]) {
        let centre = |at: &u32| lights[*at as usize].field.place().map_or(DVec3::ZERO, |(c, _)| c);
        let mut bounds = Bounds3::EMPTY;
        own.iter().for_each(|at| bounds.include(centre(at)));
        match own.len() {
            0 => {}
            1 => _ = self.push(lights, own, Some(bounds)),
            count => {
                let ball = self.push(lights, own, Some(bounds));
                let extent = bounds.extent();
                let axis =
                    (0..3).fold(0, |most, at| if extent[at] > extent[most] { at } else { most });
                let along = |at: &u32| centre(at)[axis];
                own.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
                let (lower, upper) = own.split_at_mut(count / 2);
                self.divide(lights, lower);
                self.divide(lights, upper);
                self.balls[ball].next = self.balls.len();
            }
        }
    }

    /// The balls to choose among along `segment`, by what they would scatter if nothing were in the way and fog took nothing from
    /// light on its way.
    pub fn look(&self, extinction: f64, segment: &FogSegment, found: &mut Vec<SeenBall>) {
        found.clear();
        let (mut at, mut sum) = (0, 0.0);
        while let Some(ball) = self.balls.get(at) {
            if ball.lights.len() > 1 && ball.place.is_some_and(|place| is_close(place, segment)) {
                at += 1;
                continue;
            }
            let distances = distances(ball.place, extinction, segment);
            let along = match ball.place {
                Some(_) => distances.angle_over_distance(),
                None => distances.mean_free_length(),
            };
            sum += self.power(&ball.lights) * along;
            found.push((at, sum));
            at = ball.next;
        }
    }

    fn before(&self, at: usize) -> f64 {
        at.checked_sub(1).map_or(0.0, |before| self.sums[before])
    }

    fn power(&self, lights: &Range<usize>) -> f64 {
        self.before(lights.end) - self.before(lights.start)
    }

    /// The light that two numbers in 0..1 choose among `found`, and its probability; `None` where none scatters.
    pub fn choose(&self, found: &[SeenBall], u: [f64; 2]) -> Option<(usize, f64)> {
        let all = found.last()?.1;
        if all.is_nan() || all <= 0.0 {
            return None;
        }
        let at = found.partition_point(|(_, to)| *to <= u[0] * all).min(found.len() - 1);
        let (ball, to) = found[at];
        let from = at.checked_sub(1).map_or(0.0, |before| found[before].1);
        let lights = self.balls[ball].lights.clone();
        let (start, power) = (self.before(lights.start), self.power(&lights));
        let own = &self.sums[lights.clone()];
        let at = lights.start + own.partition_point(|sum| sum - start <= u[1] * power);
        let at = at.min(lights.end - 1);
        let share = (self.sums[at] - self.before(at)) / power;
        let probability = share * (to - from) / all;
        (probability > 0.0).then(|| (self.order[at] as usize, probability))
    }
}

/// Whether a ball is too near for its size to choose its lights by power alone.
fn is_close((centre, reach): (DVec3, f64), segment: &FogSegment) -> bool {
    let to = centre - segment.start;
    let nearest = segment.dir * to.dot(segment.dir).clamp(0.0, segment.length);
    to.distance_squared(nearest) < CLOSE * CLOSE * reach * reach
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::scene::{DirectionalLight, Light, PointLight};
    use crate::shade::point::SamplePlace;

    /// Point lights in a cloud of radius 1, and one without a place.
    fn lights(count: u32) -> Vec<FarLight> {
        let point = |k: u32| {
            let at = |step: f64| (f64::from(k) * step).fract() * 2.0 - 1.0;
            let position = DVec3::new(at(0.618_034), at(0.754_878), at(0.569_840));
            let light = Light::Point(PointLight { position, intensity: Rgb::ONE });
            FarLight::new(light.far_field(), 0.5 + f64::from(k % 7))
        };
        let sun = DirectionalLight { to_light: DVec3::Y, irradiance: Rgb::ONE };
        let sun = FarLight::new(Light::Directional(sun).far_field(), 0.1);
        (0..count).map(point).chain([sun]).collect()
    }

    fn segment(start: DVec3, length: f64) -> FogSegment {
        let place = SamplePlace { pixel: 0, sample: 0, branch: 0 };
        FogSegment { start, dir: DVec3::Z, length, throughput: Rgb::ONE, place }
    }

    #[test]
    fn lights_are_chosen_as_often_as_is_said_and_none_is_left_out() {
        let lights = lights(300);
        let tree = LightTree::new(&lights);
        let through = DVec3::new(0.2, -0.1, -3.0);
        for (start, length) in [(through, 6.0), (through, f64::INFINITY), (DVec3::X * 9.0, 5.0)] {
            let mut found = Vec::new();
            tree.look(0.3, &segment(start, length), &mut found);
            let n = 1000;
            let at = |k: u32| (f64::from(k) + 0.5) / f64::from(n);
            let mut shares = vec![0.0; lights.len()];
            for k in 0..n * n {
                let (light, _) = tree.choose(&found, [at(k / n), at(k % n)]).unwrap();
                shares[light] += 1.0 / f64::from(n * n);
            }
            // However rarely a ball is chosen, all of its lights are.
            let mut said = vec![0.0; lights.len()];
            let mut from = 0.0;
            for (_, to) in &found {
                let middle = 0.5 * (from + to) / found.last().unwrap().1;
                for k in 0..10 * n {
                    let u = [middle, at(k) / 10.0];
                    let (light, probability) = tree.choose(&found, u).unwrap();
                    said[light] = probability;
                }
                from = *to;
            }
            assert!((said.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{said:?}");
            for (share, said) in shares.iter().zip(said) {
                assert!((share - said).abs() < 2e-3 && said > 0.0, "{share} {said}");
            }
        }
    }

    #[test]
    fn a_stretch_looks_at_few_balls() {
        let looked = |count: u32, start: DVec3| {
            let lights = lights(count);
            let mut found = Vec::new();
            LightTree::new(&lights).look(0.3, &segment(start, 4.0), &mut found);
            found.len()
        };
        assert_eq!(looked(10_000, DVec3::X * 9.0), 2);
        let (few, many) = (looked(1000, -DVec3::Z * 2.0), looked(10_000, -DVec3::Z * 2.0));
        assert!(few < 500 && many < 4 * few, "{few} {many}");
    }
}
