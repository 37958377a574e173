//! Which light is sampled along a stretch of fog, where a scene has many: a tree of balls.
//!
//! A ball that is far from the stretch for its size stands for all lights in it: they are chosen by their power alone. A closer one is
//! opened. So a stretch looks at few balls, however many lights there are (the idea of Walter et al., 2005, for one sample
//! of all lights in place of their sum).

use super::{Distances, FogSegment};
use crate::math::{Bounds3, DVec3};
use crate::scene::FarField;

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

/// Lights, in balls: each before the two halves of its lights.
pub struct LightTree {
    balls: Vec<Ball>,
}

struct Ball {
    /// Centre and radius; `None` of one light without a place.
    place: Option<(DVec3, f64)>,
    /// Sum of its lights'.
    power: f64,
    /// The light, of a ball of one.
    light: Option<u32>,
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
        let mut tree = Self { balls: Vec::new() };
        for at in far {
            tree.push(lights, &[at]);
        }
        if !near.is_empty() {
            tree.divide(lights, &mut near);
        }
        tree
    }

    /// Adds a ball of these lights, as the last; returns its number, and the bounds of their centres.
    fn push(&mut self, lights: &[FarLight], own: &[u32]) -> (usize, Bounds3) {
        let places = own.iter().filter_map(|at| lights[*at as usize].field.place());
        let mut bounds = Bounds3::EMPTY;
        places.clone().for_each(|(centre, _)| bounds.include(centre));
        let centre = bounds.centre();
        let place = places.map(|(own, reach)| own.distance(centre) + reach).reduce(f64::max);
        let power = own.iter().map(|at| lights[*at as usize].power).sum();
        let light = own.first().copied().filter(|_| own.len() == 1);
        let at = self.balls.len();
        self.balls.push(Ball {
            place: place.map(|reach| (centre, reach)),
            power,
            light,
            next: at + 1,
        });
        (at, bounds)
    }

    /// Adds the balls of lights that have places.
    fn divide(&mut self, lights: &[FarLight], own: &mut [u32]) {
        let (ball, bounds) = self.push(lights, own);
        if own.len() == 1 {
            return;
        }
        let centre = |at: &u32| lights[*at as usize].field.place().map_or(DVec3::ZERO, |(c, _)| c);
        let extent = bounds.extent();
        let axis = (0..3).fold(0, |most, at| if extent[at] > extent[most] { at } else { most });
        let along = |at: &u32| centre(at)[axis];
        own.sort_unstable_by(|a, b| along(a).total_cmp(&along(b)).then(a.cmp(b)));
        let (lower, upper) = own.split_at_mut(own.len() / 2);
        self.divide(lights, lower);
        self.divide(lights, upper);
        self.balls[ball].next = self.balls.len();
    }

    /// The balls to choose among along `segment`, by what they would scatter if nothing were in the way and fog took nothing from
    /// light on its way.
    pub fn look(&self, extinction: f64, segment: &FogSegment, found: &mut Vec<SeenBall>) {
        found.clear();
        let (mut at, mut sum) = (0, 0.0);
        while let Some(ball) = self.balls.get(at) {
            if ball.light.is_none() && ball.place.is_some_and(|place| is_close(place, segment)) {
                at += 1;
                continue;
            }
            let distances = distances(ball.place, extinction, segment);
            let along = match ball.place {
                Some(_) => distances.angle_over_distance(),
                None => distances.mean_free_length(),
            };
            sum += ball.power * along;
            found.push((at, sum));
            at = ball.next;
        }
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
        let (mut at, mut u, mut probability) = (ball, u[1], (to - from) / all);
        loop {
            if let Some(light) = self.balls[at].light {
                return (probability > 0.0).then_some((light as usize, probability));
            }
            let halves = [at + 1, self.balls[at + 1].next];
            let powers = halves.map(|half| self.balls[half].power);
            let [lower, upper] = powers.map(|power| power / (powers[0] + powers[1]));
            let (half, share, rest) =
                if u < lower { (halves[0], lower, u) } else { (halves[1], upper, u - lower) };
            (at, u, probability) = (half, rest / share, probability * share);
        }
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
