//! Coincident primitives: which of several at the same place is hit.
//!
//! The rule is that the lowest `(geom_id, prim_id)` wins. Embree would return any of them, so the
//! others are taken out before it builds: no ray pays for the rule, and a thousand copies of a
//! mesh trace as fast as one.
//!
//! Glass with a priority is left alone: where two such bodies touch, a ray crosses both boundaries. What
//! lies behind a surface with cut-outs stays as well, since it is seen through the holes.

use super::{PrimRef, Ray};
use crate::math::Vec3;
use crate::scene::{Scene, Sphere, Surface};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// Triangles that one task looks at.
const TASK: usize = 1 << 16;
/// Bits of the filter a triangle: 3 % of those without a copy pass it.
const BITS_EACH: usize = 32;

/// Primitives that have the very corners (in any order) or the very sphere of a lower one, ascending.
#[derive(Default)]
pub(super) struct Copies {
    /// Those that are never hit.
    pub hidden: Vec<PrimRef>,
    /// Those that are hit through the holes of a lower one, with that one: the next lower of several.
    pub behind: Vec<(PrimRef, PrimRef)>,
}

/// The copies in `scene`.
pub(super) fn copies(scene: &Scene) -> Copies {
    let mut copies = triangle_copies(scene);
    let geom_id = scene.sphere_geom_id();
    let mut spheres: Vec<([u64; 4], u32)> = scene
        .spheres
        .iter()
        .zip(0..)
        .map(|(s, prim_id)| {
            ([s.centre.x, s.centre.y, s.centre.z, s.radius].map(|x| (x + 0.0).to_bits()), prim_id)
        })
        .collect();
    spheres.sort_unstable();
    for same in spheres.chunk_by(|a, b| a.0 == b.0) {
        let prims = same.iter().map(|(_, prim_id)| PrimRef { geom_id, prim_id: *prim_id });
        copies.add(scene, prims);
    }
    copies.hidden.sort_unstable();
    copies.behind.sort_unstable();
    copies
}

/// Corners as bits, in ascending order; both zeros are one.
type Key = [[u32; 3]; 3];

fn triangle_copies(scene: &Scene) -> Copies {
    // First a Bloom filter over all triangles, so that only the few which may have a copy are
    // sorted: of ten million, that is the difference between a tenth of a second and several.
    let filter = Filter::new(scene.triangle_count());
    each_task(scene).for_each(|(geom_id, first)| {
        for (_, key) in keys(scene, geom_id, first) {
            filter.insert(hash(&key));
        }
    });
    let mut suspects: Vec<(Key, PrimRef)> = each_task(scene)
        .flat_map_iter(|(geom_id, first)| {
            let twice = |(_, key): &(PrimRef, Key)| filter.holds_twice(hash(key));
            keys(scene, geom_id, first).filter(twice).map(|(prim, key)| (key, prim))
        })
        .collect();
    suspects.par_sort_unstable();
    let groups = suspects.chunk_by(|a, b| a.0 == b.0);
    let mut copies = Copies::default();
    groups.for_each(|same| copies.add(scene, same.iter().map(|(_, prim)| *prim)));
    copies
}

impl Copies {
    /// Adds those of coincident primitives, ascending. The first one without holes hides the others, unless it is
    /// glass with a priority and they are, too.
    fn add(&mut self, scene: &Scene, prims: impl Iterator<Item = PrimRef>) {
        let (mut lower, mut whole_is_ranked) = (None, None);
        for prim in prims {
            let is_ranked = is_ranked_glass(scene, prim);
            if whole_is_ranked.is_some_and(|ranked| !(ranked && is_ranked)) {
                self.hidden.push(prim);
                continue;
            }
            self.behind.extend(lower.map(|lower| (prim, lower)));
            if has_holes(scene, prim) {
                lower = Some(prim);
            } else if whole_is_ranked.is_none() {
                whole_is_ranked = Some(is_ranked);
            }
        }
    }
}

/// Whether `ray` starts on the sphere `prim`: leaves it, or another one at the same place, where rounding alone says whether
/// the start is a hit of this one. Rays cross all boundaries of glass with priorities: those of the other spheres count.
///
/// Triangles need no such rule, since the offset of a ray's start holds for all at the same place.
pub(super) fn starts_on(scene: &Scene, ray: &Ray, prim: PrimRef) -> bool {
    let left = ray.exclude;
    if left.geom_id != prim.geom_id || prim.geom_id != scene.sphere_geom_id() {
        return false;
    }
    let sphere = |prim: PrimRef| scene.spheres.get(prim.prim_id as usize);
    let at_one_place = |(a, b): (&Sphere, &Sphere)| a.centre == b.centre && a.radius == b.radius;
    left == prim
        || sphere(left).zip(sphere(prim)).is_some_and(at_one_place)
            && !(is_ranked_glass(scene, left) && is_ranked_glass(scene, prim))
}

fn surface_of(scene: &Scene, prim: PrimRef) -> Surface {
    match scene.meshes.get(prim.geom_id as usize) {
        Some(mesh) => mesh.surface,
        None => scene.spheres[prim.prim_id as usize].surface,
    }
}

fn has_holes(scene: &Scene, prim: PrimRef) -> bool {
    match scene.meshes.get(prim.geom_id as usize) {
        Some(mesh) => scene.mesh_mask(mesh).is_some(),
        None => scene.mask(surface_of(scene, prim)).is_some(),
    }
}

fn is_ranked_glass(scene: &Scene, prim: PrimRef) -> bool {
    let glass = &scene.materials[surface_of(scene, prim).material as usize].glass;
    glass.as_ref().is_some_and(|g| g.priority.is_some())
}

/// Runs of triangles: geometry and first triangle.
fn each_task(scene: &Scene) -> impl ParallelIterator<Item = (u32, usize)> + '_ {
    let tasks = scene.meshes.iter().zip(0..).flat_map(|(mesh, geom_id)| {
        (0..mesh.triangles.len()).step_by(TASK).map(move |first| (geom_id, first))
    });
    tasks.collect::<Vec<_>>().into_par_iter()
}

fn keys(scene: &Scene, geom_id: u32, first: usize) -> impl Iterator<Item = (PrimRef, Key)> + '_ {
    let mesh = &scene.meshes[geom_id as usize];
    let run = mesh.triangles[first..].iter().take(TASK).zip(first as u32..);
    run.map(move |(triangle, prim_id)| {
        let mut key = triangle.map(|i| bits(mesh.positions[i as usize]));
        key.sort_unstable();
        (PrimRef { geom_id, prim_id }, key)
    })
}

fn bits(p: Vec3) -> [u32; 3] {
    p.to_array().map(|x| (x + 0.0).to_bits())
}

/// Multiply and fold (as in wyhash, Wang Yi, 2019); it need not resist anybody.
fn hash(key: &Key) -> u64 {
    key.as_flattened().iter().fold(0x9e37_79b9_7f4a_7c15, |state, word| {
        let wide = u128::from(state ^ u64::from(*word)) * 0xa076_1d64_78bd_642f;
        (wide >> 64) as u64 ^ wide as u64
    })
}

/// Which hashes were inserted, and which at least twice: a bit each, sometimes wrongly set.
struct Filter {
    once: Vec<AtomicU64>,
    twice: Vec<AtomicU64>,
}

impl Filter {
    fn new(count: usize) -> Self {
        let words = (count * BITS_EACH / 64).next_power_of_two();
        let zeros = || (0..words).map(|_| AtomicU64::new(0)).collect();
        Self { once: zeros(), twice: zeros() }
    }

    /// The order of insertions decides nothing: bits are only ever set.
    fn insert(&self, hash: u64) {
        let (word, bit) = self.place(hash);
        if self.once[word].fetch_or(bit, Ordering::Relaxed) & bit != 0 {
            self.twice[word].fetch_or(bit, Ordering::Relaxed);
        }
    }

    fn holds_twice(&self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        self.twice[word].load(Ordering::Relaxed) & bit != 0
    }

    fn place(&self, hash: u64) -> (usize, u64) {
        ((hash >> 6) as usize & (self.once.len() - 1), 1 << (hash & 63))
    }
}
