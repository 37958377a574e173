//! Both intersectors against each other on a scene of the user's own.
//!
//! [`Check`] shoots rays of six kinds at the scene's own geometry through the product's intersector and
//! through the oracle, and classifies every difference: [`Class`]. Ray `i` of a kind depends on
//! the scene, the settings, the seed, the kind and `i` alone, so that one ray can be replayed.
//!
//! Not done: two analytic spheres are compared by the same formula in both intersectors.

mod differ;
mod judge;
mod rays;
mod tally;

pub use judge::{BAND_ULPS, Class, Difference};
pub use rays::{Kind, RayId};
pub use tally::{Row, Tally, Worst};

use crate::intersect::{CourtHit, Hit, Intersector, Oracle, Ray};
use crate::scene::{Scene, Settings, Shot};
use crate::stats::RayCounts;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rays that are made and traced together. Always whole groups, since packets of rays may differ
/// from single rays in the last bits.
const GROUP: u64 = 64;
/// Groups between two looks at the stop flag.
const TURN: u64 = 64;
/// Ray-triangle pairs of all kinds together when nobody says how many rays.
const BUDGET: u64 = 100_000_000_000;
/// Rays of a kind at least and at most when nobody says how many.
const RAYS: (u64, u64) = (512, 1 << 19);
/// What a pair costs the oracle on one thread with AVX2, seconds (`benches/oracle.rs`).
const PAIR_SECONDS: f64 = 1.3e-9;
/// What a ray costs beside its pairs, seconds.
const RAY_SECONDS: f64 = 3e-6;

/// What is checked against what.
pub struct Check<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Seed, image size and hit rules.
    pub settings: &'a Settings,
    /// The camera move.
    pub shot: &'a Shot,
    /// The intersector on trial.
    pub product: &'a dyn Intersector,
    /// The one that is right.
    pub oracle: &'a Oracle<'a>,
}

/// One ray, traced by both.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    /// The ray, scene space.
    pub ray: Ray,
    /// What each said.
    pub answers: Answers,
}

/// Two answers to one question.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Answers {
    /// Closest hits.
    Hits {
        /// The product's.
        product: Option<Hit>,
        /// The oracle's.
        oracle: Option<Hit>,
    },
    /// Occlusion, of shadow rays.
    Occlusion {
        /// The product's.
        product: bool,
        /// The oracle's.
        oracle: bool,
    },
}

/// One ray with everything that can be said of it.
pub struct Replay {
    /// Ray and answers.
    pub trial: Trial,
    /// All that the ray hits between its ends, by the court.
    pub all_hits: Vec<CourtHit>,
    /// The difference, if there is one.
    pub difference: Option<Difference>,
}

/// Rays of each kind for a scene of `triangles` when nobody says how many: from a budget of
/// ray-triangle pairs.
pub fn default_rays(triangles: usize) -> u64 {
    let kinds = Kind::ALL.len() as u64;
    (BUDGET / kinds / (triangles as u64).max(1)).clamp(RAYS.0, RAYS.1)
}

/// About how long `rays` of each kind take with `threads`, seconds.
pub fn estimate(rays: u64, triangles: usize, threads: usize) -> f64 {
    let all = rays as f64 * Kind::ALL.len() as f64;
    all * (RAY_SECONDS + PAIR_SECONDS * triangles as f64) / threads as f64
}

impl Check<'_> {
    /// Shoots `rays` of each kind on the current pool's threads. `progress` hears how many more
    /// were shot; once `stop` is set the tally is of what was shot until then.
    pub fn run(&self, rays: u64, stop: &AtomicBool, progress: &(dyn Fn(u64) + Sync)) -> Tally {
        let mut tally = Tally::default();
        for kind in Kind::ALL {
            let groups = rays.div_ceil(GROUP);
            let mut first = 0;
            while first < groups && !stop.load(Ordering::Relaxed) {
                let turn = first..groups.min(first + TURN);
                let group = |group| {
                    let tally = self.group(kind, group, rays);
                    progress(GROUP.min(rays - group * GROUP));
                    tally
                };
                let done =
                    turn.clone().into_par_iter().map(group).reduce(Tally::default, Tally::with);
                tally = tally.with(done);
                first = turn.end;
            }
        }
        tally
    }

    /// One ray again; `None` where the scene has no such ray (no triangle to aim at, say).
    pub fn replay(&self, id: RayId) -> Option<Replay> {
        let group = self.trace(id.kind, id.index / GROUP);
        let trial = group.into_iter().find(|(index, _)| *index == id.index)?.1;
        let difference = self.judge(&trial);
        Some(Replay { trial, all_hits: self.oracle.all_hits(&trial.ray), difference })
    }

    fn group(&self, kind: Kind, group: u64, rays: u64) -> Tally {
        let mut tally = Tally::default();
        for (index, trial) in self.trace(kind, group) {
            if index < rays {
                tally.add(RayId { kind, index }, self.judge(&trial));
            }
        }
        tally
    }

    /// Makes and traces the rays of one group: each with its index.
    fn trace(&self, kind: Kind, group: u64) -> Vec<(u64, Trial)> {
        let indices = group * GROUP..(group + 1) * GROUP;
        let made = indices.filter_map(|index| Some((index, self.ray(RayId { kind, index })?)));
        let (indices, rays): (Vec<u64>, Vec<Ray>) = made.unzip();
        let answers = match kind {
            Kind::Shadow => self.occlusion(&rays),
            _ => self.hits(kind, &rays),
        };
        let trials = rays.into_iter().zip(answers).map(|(ray, answers)| Trial { ray, answers });
        indices.into_iter().zip(trials).collect()
    }

    fn occlusion(&self, rays: &[Ray]) -> Vec<Answers> {
        let (mut product, mut oracle) = (vec![false; rays.len()], vec![false; rays.len()]);
        let counts = &mut RayCounts::default();
        self.product.occluded_batch(rays, &mut product, counts);
        self.oracle.occluded_batch(rays, &mut oracle, counts);
        let answers = product.into_iter().zip(oracle);
        answers.map(|(product, oracle)| Answers::Occlusion { product, oracle }).collect()
    }

    /// In packets or one by one, as the renderer traces rays of this kind; both for what it has not.
    fn hits(&self, kind: Kind, rays: &[Ray]) -> Vec<Answers> {
        let (mut product, mut oracle) = (vec![None; rays.len()], vec![None; rays.len()]);
        let counts = &mut RayCounts::default();
        if matches!(kind, Kind::Mirror | Kind::Edge) {
            for (ray, hit) in rays.iter().zip(&mut product) {
                *hit = self.product.intersect(ray, counts);
            }
        } else {
            self.product.intersect_batch(rays, &mut product, counts);
        }
        self.oracle.intersect_batch(rays, &mut oracle, counts);
        let answers = product.into_iter().zip(oracle);
        answers.map(|(product, oracle)| Answers::Hits { product, oracle }).collect()
    }
}
