//! Both intersectors against each other on a scene of the user's own.
//!
//! [`Check`] shoots rays of six kinds at the scene's own geometry through the product's intersector and
//! through the oracle, and classifies every difference: [`Class`]. Ray `i` of a kind depends on
//! the scene, the settings, the seed, the kind and `i` alone, so that one ray can be replayed.
//!
//! Not done: two analytic spheres are compared by the same formula in both intersectors.

mod class;
mod differ;
mod edge_on;
mod judge;
mod rays;
mod tally;

pub use class::{BAND_ULPS, Class, Difference};
pub use rays::{Kind, RayId};
pub use tally::{
    ClassRow, EDGE_ON_LIMIT, NARROW_LIMIT, OPEN_VERTEX_LIMIT, PAST_VERTEX_LIMIT, Tally, Worst,
};

use crate::intersect::{CourtHit, Hit, Intersector, Oracle, PrimRef, Ray};
use crate::math::DVec3;
use crate::scene::{Mesh, Scene, Settings, Shot, borders, closed_volume};
use crate::stats::RayCounts;
use rayon::prelude::*;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Rays that are made and traced together. Always whole groups, since packets of rays may differ
/// from single rays in the last bits.
const GROUP: u64 = 64;
/// Ray-triangle pairs of the oracle between two checks of the stop flag: about 0.1 s.
const PAIRS_A_LOOK: usize = 100_000_000;
/// Least number of rays that share one of the oracle's passes over the triangles; with fewer, each costs too much.
const LEAST_A_PASS: usize = 8;
/// Default number of ray-triangle pairs, of all kinds of rays together.
const BUDGET: u64 = 100_000_000_000;
/// Least and most rays of a kind by default.
const RAYS: (u64, u64) = (512, 1 << 19);
/// Time of a pair on one thread with AVX2, seconds (`benches/oracle.rs`).
const PAIR_SECONDS: f64 = 1.3e-9;
/// Time of a ray besides its pairs, seconds.
const RAY_SECONDS: f64 = 3e-6;

/// A comparison of an intersector with the oracle.
pub struct Check<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Seed, image size and hit rules.
    pub settings: &'a Settings,
    /// The camera move.
    pub shot: &'a Shot,
    /// The intersector under test.
    pub product: &'a dyn Intersector,
    /// The trusted intersector.
    pub oracle: &'a Oracle<'a>,
    /// For each mesh, computed on first use, the sign of its volume if it is closed.
    volumes: Vec<OnceLock<Option<f64>>>,
    /// For each mesh, computed on first use, which edges of its triangles are borders.
    borders: Vec<OnceLock<Vec<u8>>>,
}

/// One ray, traced by both.
#[derive(Debug, Clone, Copy)]
pub struct TracedRay {
    /// The ray, scene space.
    pub ray: Ray,
    /// The answers of both.
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
    pub trial: TracedRay,
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

impl<'a> Check<'a> {
    /// A check of `product`, which traces `scene` by the rules of `settings`.
    pub fn new(
        scene: &'a Scene,
        settings: &'a Settings,
        shot: &'a Shot,
        product: &'a dyn Intersector,
        oracle: &'a Oracle<'a>,
    ) -> Self {
        let volumes = scene.meshes.iter().map(|_| OnceLock::new()).collect();
        let borders = scene.meshes.iter().map(|_| OnceLock::new()).collect();
        Self { scene, settings, shot, product, oracle, volumes, borders }
    }

    /// Whether the mesh is closed and its faces wind clockwise seen from outside, so that their
    /// backs are its outside.
    fn is_inwards(&self, geom_id: u32) -> bool {
        self.volume(geom_id).is_some_and(|volume| volume < 0.0)
    }

    /// Whether every edge of the mesh has a partner that runs the other way, and no holes are cut out of it.
    fn is_closed(&self, geom_id: u32) -> bool {
        let has_holes = self.scene.mesh_mask(&self.scene.meshes[geom_id as usize]).is_some();
        !has_holes && self.volume(geom_id).is_some()
    }

    fn volume(&self, geom_id: u32) -> Option<f64> {
        let mesh = &self.scene.meshes[geom_id as usize];
        *self.volumes[geom_id as usize]
            .get_or_init(|| closed_volume(&positions_of(mesh), &mesh.triangles))
    }

    /// Which edges of a triangle no other triangle has, a bit each.
    fn borders_of(&self, prim: PrimRef) -> u8 {
        let mesh = &self.scene.meshes[prim.geom_id as usize];
        let borders = self.borders[prim.geom_id as usize]
            .get_or_init(|| borders(&positions_of(mesh), &mesh.triangles));
        borders[prim.prim_id as usize]
    }

    /// Shoots `rays` of each kind on the current pool's threads. `progress` hears how many more
    /// were shot; once `stop` is set, which is looked at some times a second, the tally is of what
    /// was shot until then.
    pub fn run(&self, rays: u64, stop: &AtomicBool, progress: &(dyn Fn(u64) + Sync)) -> Tally {
        let mut tally = Tally::default();
        for kind in Kind::ALL {
            let group = |group| {
                let tally = self.group(kind, group, rays, stop)?;
                progress(GROUP.min(rays - group * GROUP));
                Some(tally)
            };
            let groups = (0..rays.div_ceil(GROUP)).into_par_iter();
            tally = tally.with(groups.filter_map(group).reduce(Tally::default, Tally::with));
        }
        tally
    }

    /// One ray again; `None` where the scene has no such ray (no triangle to aim at, say).
    pub fn replay(&self, id: RayId) -> Option<Replay> {
        let group = self.trace(id.kind, id.index / GROUP, &AtomicBool::new(false))?;
        let trial = group.into_iter().find(|(index, _)| *index == id.index)?.1;
        let difference = self.judge(&trial);
        Some(Replay { trial, all_hits: self.oracle.all_hits(&trial.ray), difference })
    }

    /// Makes, traces and judges the rays of one group; `None` when told to stop.
    fn group(&self, kind: Kind, group: u64, rays: u64, stop: &AtomicBool) -> Option<Tally> {
        let mut tally = Tally::default();
        for (index, trial) in self.trace(kind, group, stop)? {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            if index < rays {
                tally.add(RayId { kind, index }, self.judge(&trial));
                if kind == Kind::Edge && self.sees_edge_on(index) {
                    tally.note_edge_on();
                }
            }
        }
        Some(tally)
    }

    /// Makes and traces the rays of one group: each with its index. `None` when told to stop.
    fn trace(&self, kind: Kind, group: u64, stop: &AtomicBool) -> Option<Vec<(u64, TracedRay)>> {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let indices = group * GROUP..(group + 1) * GROUP;
        let made = indices.filter_map(|index| Some((index, self.ray(RayId { kind, index })?)));
        let (indices, rays): (Vec<u64>, Vec<Ray>) = made.unzip();
        let answers = match kind {
            Kind::Shadow => self.occlusion(&rays, stop),
            _ => self.hits(kind, &rays, stop),
        }?;
        let trials = rays.into_iter().zip(answers).map(|(ray, answers)| TracedRay { ray, answers });
        Some(indices.into_iter().zip(trials).collect())
    }

    /// `answer`, the oracle's, for so few of the rays at a time that `stop` is looked at often
    /// enough; `None` when told to stop.
    fn in_passes<T>(
        &self,
        rays: &[Ray],
        out: &mut [T],
        stop: &AtomicBool,
        mut answer: impl FnMut(&[Ray], &mut [T]),
    ) -> Option<()> {
        let fit = PAIRS_A_LOOK / self.scene.triangle_count().max(1);
        let pass = fit.clamp(LEAST_A_PASS, GROUP as usize);
        for (rays, out) in rays.chunks(pass).zip(out.chunks_mut(pass)) {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            answer(rays, out);
        }
        Some(())
    }

    fn occlusion(&self, rays: &[Ray], stop: &AtomicBool) -> Option<Vec<Answers>> {
        let (mut product, mut oracle) = (vec![false; rays.len()], vec![false; rays.len()]);
        let counts = &mut RayCounts::default();
        self.product.occluded_batch(rays, &mut product, counts);
        let answer = |r: &[Ray], o: &mut [bool]| self.oracle.occluded_batch(r, o, counts);
        self.in_passes(rays, &mut oracle, stop, answer)?;
        let answers = product.into_iter().zip(oracle);
        Some(answers.map(|(product, oracle)| Answers::Occlusion { product, oracle }).collect())
    }

    /// Camera rays in packets, the others one by one, as the renderer does: what a block has rules
    /// for is rays that start together.
    fn hits(&self, kind: Kind, rays: &[Ray], stop: &AtomicBool) -> Option<Vec<Answers>> {
        let (mut product, mut oracle) = (vec![None; rays.len()], vec![None; rays.len()]);
        let counts = &mut RayCounts::default();
        if kind == Kind::Camera {
            self.product.intersect_batch(rays, &mut product, counts);
        } else {
            for (ray, hit) in rays.iter().zip(&mut product) {
                *hit = self.product.intersect(ray, counts);
            }
        }
        let answer = |r: &[Ray], o: &mut [Option<Hit>]| self.oracle.intersect_batch(r, o, counts);
        self.in_passes(rays, &mut oracle, stop, answer)?;
        let answers = product.into_iter().zip(oracle);
        Some(answers.map(|(product, oracle)| Answers::Hits { product, oracle }).collect())
    }
}

fn positions_of(mesh: &Mesh) -> Vec<DVec3> {
    mesh.positions[..mesh.vertex_count].iter().map(|p| p.as_dvec3()).collect()
}
