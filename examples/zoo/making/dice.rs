//! Random numbers of a scene.

use glam::DVec3;
use tweenray::sampling::mix;

/// A stream of random numbers that is a function of its key.
pub struct Dice {
    key: u64,
    thrown: u64,
}

impl Dice {
    /// The stream of scene `index` of `seed`.
    pub fn new(seed: u64, index: u64) -> Self {
        Self { key: mix(mix(seed) ^ index), thrown: 0 }
    }

    fn next(&mut self) -> u64 {
        self.thrown += 1;
        mix(self.key ^ mix(self.thrown))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// In [low, high), its logarithm uniform: for sizes that span several orders.
    pub fn scale(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    /// A whole number in low..=high.
    pub fn count(&mut self, low: usize, high: usize) -> usize {
        low + (self.next() % (high - low + 1) as u64) as usize
    }

    /// Whether something of this probability happens.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// One of `choices`, which are not empty.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.count(0, choices.len() - 1)]
    }

    /// A point of the level disc of this radius about `centre`.
    pub fn on_disc(&mut self, centre: DVec3, radius: f64) -> DVec3 {
        let (r, a) = (radius * self.unit().sqrt(), self.angle());
        centre + DVec3::new(r * a.cos(), 0.0, r * a.sin())
    }

    /// An angle in [0, 2π).
    pub fn angle(&mut self) -> f64 {
        self.within(0.0, std::f64::consts::TAU)
    }

    /// A unit vector, all directions alike.
    pub fn direction(&mut self) -> DVec3 {
        let (z, a) = (self.within(-1.0, 1.0), self.angle());
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * a.cos(), z, r * a.sin())
    }

    /// A reflectance around `level`, tinted by up to `tint` to either side.
    pub fn colour(&mut self, level: f64, tint: f64) -> DVec3 {
        let mut channel = || (level * (1.0 + self.within(-tint, tint))).clamp(0.02, 0.95);
        DVec3::new(channel(), channel(), channel())
    }
}
