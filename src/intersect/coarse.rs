//! A coarse tree of boxes around the triangles: which misses deserve a second try, and where from.
//!
//! A ray that meets none of the boxes cannot have been lost between two triangles. Whole blocks
//! of rays are asked about at once, by interval arithmetic on their origins and directions
//! (Boulos et al., 2006), so that open sky costs next to nothing.
//!
//! A ray that leaves a mirror or glass starts in a box, of course. But out of a closed surface a ray
//! meets a front of it first, if anything: boxes that show it only backs of the mesh that it leaves do
//! not count. Where it sets off inwards, the box that it starts in shows it a front.

use super::facts::MeshFacts;
use super::{PrimRef, Ray};
use crate::math::{Bounds3, DVec3, Vec3};
use crate::scene::Scene;
use rayon::prelude::*;

/// Most cells along each axis of the grid that groups the triangles; small scenes need fewer.
const MOST_CELLS: usize = 64;
/// Triangles that one task groups.
const TASK: usize = 1 << 18;
/// Most points of a ray from which it is traced anew.
const STARTS: usize = 8;
/// By how much a normal's components may be off, rounding of rays included: a ray this near to a
/// triangle's plane is taken to see both sides.
const SLACK: f32 = 1e-5;

/// Boxes in depth-first order; `skip` leads past a node's children.
#[derive(Default)]
pub(super) struct CoarseTree {
    nodes: Vec<Node>,
}

struct Node {
    bounds: Bounds3,
    /// Index of the next node that is no child of this one.
    skip: u32,
    /// Where the triangles of a leaf face.
    leaf: Option<Facing>,
}

/// Where triangles face.
#[derive(Clone, Copy)]
struct Facing {
    /// The mesh of all of them, if it is closed; else [`Facing::ANYWHERE`].
    geom_id: u32,
    /// Bounds of their unit normals on the outside.
    min: Vec3,
    max: Vec3,
}

impl CoarseTree {
    /// The tree of `scene`'s triangles. Boxes are padded by `margin`, for the rounding of
    /// rays.
    pub fn new(scene: &Scene, facts: &[MeshFacts], margin: DVec3) -> Self {
        let all = scene.meshes.iter().fold(Bounds3::EMPTY, |b, m| b.union(m.bounds));
        let edge = ((2.0 * (scene.triangle_count() as f64).cbrt()) as usize).clamp(1, MOST_CELLS);
        let mut cells = vec![Cell::EMPTY; if all.is_empty() { 0 } else { edge.pow(3) }];
        let longest = all.extent().max_element();
        let per_unit = if longest > 0.0 { edge as f64 / longest } else { 0.0 };
        let tasks: Vec<(u32, &[[u32; 3]])> = scene
            .meshes
            .iter()
            .zip(0..)
            .flat_map(|(mesh, id)| mesh.triangles.chunks(TASK).map(move |part| (id, part)))
            .collect();
        // A grid for each thread's share, not for each mesh; the union of boxes does not depend on
        // the order.
        let share = tasks.len().div_ceil(rayon::current_num_threads()).max(1);
        let grouped = tasks.par_chunks(share).map(|tasks| {
            let mut cells = vec![Cell::EMPTY; edge.pow(3)];
            for (id, triangles) in tasks {
                let (mesh, facts) = (&scene.meshes[*id as usize], &facts[*id as usize]);
                for triangle in *triangles {
                    let corners = triangle.map(|i| mesh.positions[i as usize]);
                    let at = (corners[0].as_dvec3() - all.min) * per_unit;
                    let [x, y, z] = at.to_array().map(|c| (c as usize).min(edge - 1));
                    let cell = &mut cells[(z * edge + y) * edge + x];
                    corners.iter().for_each(|c| cell.include(*c));
                    cell.facing.join(&Facing::of(*id, facts, &corners));
                }
            }
            cells
        });
        for part in grouped.collect::<Vec<_>>() {
            cells.iter_mut().zip(part).for_each(|(cell, other)| cell.union(&other));
        }
        let padded = |cell: &Cell| {
            let Bounds3 { min, max } = cell.bounds()?;
            Some((Bounds3 { min: min - margin, max: max + margin }, cell.facing))
        };
        let mut boxes: Vec<(Bounds3, Facing)> = cells.iter().filter_map(padded).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * boxes.len()) };
        if !boxes.is_empty() {
            tree.add(&mut boxes);
        }
        tree
    }

    /// Adds the subtree of `boxes`, halved at the median of its longest axis.
    fn add(&mut self, boxes: &mut [(Bounds3, Facing)]) {
        let bounds = boxes.iter().fold(Bounds3::EMPTY, |b, (o, _)| b.union(*o));
        let node = self.nodes.len();
        let leaf = (boxes.len() == 1).then(|| boxes[0].1);
        self.nodes.push(Node { bounds, skip: 0, leaf });
        if boxes.len() > 1 {
            let axis = bounds.extent().max_position();
            let middle = boxes.len() / 2;
            let centre = |(bounds, _): &(Bounds3, Facing)| bounds.centre()[axis];
            let by_centre = |a: &_, b: &_| f64::total_cmp(&centre(a), &centre(b));
            boxes.select_nth_unstable_by(middle, by_centre);
            let (left, right) = boxes.split_at_mut(middle);
            self.add(left);
            self.add(right);
        }
        self.nodes[node].skip = self.nodes.len() as u32;
    }

    /// Whether any ray of `bundle` may meet a triangle: never wrongly no, but for backs of the mesh that it leaves.
    pub fn may_meet(&self, bundle: &Bundle) -> bool {
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if !bundle.may_meet(&node.bounds) {
                at = node.skip as usize;
                continue;
            }
            if node.leaf.is_some_and(|facing| !bundle.leaves_behind(&facing)) {
                return true;
            }
            at += 1;
        }
        false
    }

    /// Where `ray` enters the boxes (in `t`, ascending): the first of each of [`STARTS`] equal parts of its way
    /// through all of them. A box that it starts in does not count.
    pub fn entries(&self, ray: &Ray) -> impl Iterator<Item = f64> + use<> {
        let inv_dir = 1.0 / ray.dir;
        let way = |bounds: &Bounds3| bounds.clip(ray.org, inv_dir, ray.tnear, ray.tfar);
        let whole = self.nodes.first().and_then(|root| way(&root.bounds));
        let (near, far) = whole.unwrap_or((0.0, 0.0));
        let parts = STARTS as f64 / (far - near);
        let mut first = [f64::INFINITY; STARTS];
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let Some((enters, _)) = way(&node.bounds) else {
                at = node.skip as usize;
                continue;
            };
            if node.leaf.is_some() && enters > ray.tnear {
                let part = &mut first[(((enters - near) * parts) as usize).min(STARTS - 1)];
                *part = part.min(enters);
            }
            at += 1;
        }
        first.into_iter().filter(|enters| enters.is_finite())
    }

    /// Bytes held.
    pub fn memory(&self) -> u64 {
        (self.nodes.capacity() * size_of::<Node>()) as u64
    }
}

impl Facing {
    /// Triangles of several meshes, or of an open one.
    const ANYWHERE: u32 = u32::MAX - 1;
    const EMPTY: Self =
        Self { geom_id: PrimRef::NONE.geom_id, min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box of one triangle.
    fn of(geom_id: u32, facts: &MeshFacts, corners: &[Vec3; 3]) -> Self {
        if !facts.closed {
            return Self { geom_id: Self::ANYWHERE, ..Self::EMPTY };
        }
        let [a, b, c] = corners.map(|c| c.as_dvec3());
        let normal = (b - a).cross(c - a) * facts.sense;
        // One without area is never met.
        let Some(normal) = normal.try_normalize() else { return Self { geom_id, ..Self::EMPTY } };
        let normal = normal.as_vec3();
        Self { geom_id, min: normal - SLACK, max: normal + SLACK }
    }

    fn join(&mut self, other: &Self) {
        self.geom_id = match (self.geom_id, other.geom_id) {
            (own, id) if own == id || id == Self::EMPTY.geom_id => own,
            (own, id) if own == Self::EMPTY.geom_id => id,
            _ => Self::ANYWHERE,
        };
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }
}

/// A box of f32 corners, cheap to grow.
#[derive(Clone, Copy)]
struct Cell {
    min: Vec3,
    max: Vec3,
    facing: Facing,
}

impl Cell {
    const EMPTY: Self =
        Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY, facing: Facing::EMPTY };

    fn include(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    fn union(&mut self, other: &Self) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.facing.join(&other.facing);
    }

    fn bounds(&self) -> Option<Bounds3> {
        let bounds = Bounds3 { min: self.min.as_dvec3(), max: self.max.as_dvec3() };
        self.min.cmple(self.max).all().then_some(bounds)
    }
}

/// Rays between bounds of their origins and directions.
pub(super) struct Bundle {
    org: [DVec3; 2],
    dir: [DVec3; 2],
    /// `1 / dir`.
    inv: [DVec3; 2],
    tnear: f64,
    tfar: f64,
    /// The mesh that all rays leave, if that is one.
    left: u32,
}

impl Bundle {
    /// The bundle that holds `rays`; `None` of none.
    pub fn of<'r>(rays: impl IntoIterator<Item = &'r Ray>) -> Option<Self> {
        let mut rays = rays.into_iter();
        let first = rays.next()?;
        let (mut org, mut dir) = ([first.org; 2], [first.dir; 2]);
        let (mut tnear, mut tfar) = (first.tnear, first.tfar);
        let mut left = first.exclude.geom_id;
        for ray in rays {
            org = [org[0].min(ray.org), org[1].max(ray.org)];
            dir = [dir[0].min(ray.dir), dir[1].max(ray.dir)];
            (tnear, tfar) = (tnear.min(ray.tnear), tfar.max(ray.tfar));
            left = if ray.exclude.geom_id == left { left } else { PrimRef::NONE.geom_id };
        }
        Some(Self { org, dir, inv: dir.map(|d| 1.0 / d), tnear, tfar, left })
    }

    /// Whether the triangles that face so show all rays their backs, and are of the mesh that these
    /// leave.
    fn leaves_behind(&self, facing: &Facing) -> bool {
        if facing.geom_id != self.left || self.tnear < 0.0 {
            return false;
        }
        let (low, high) = (facing.min.as_dvec3(), facing.max.as_dvec3());
        let products = |dir: DVec3| (low * dir).min(high * dir);
        products(self.dir[0]).min(products(self.dir[1])).dot(DVec3::ONE) > 0.0
    }

    /// Whether some `t` lies in all three slabs for some ray of the bundle.
    fn may_meet(&self, bounds: &Bounds3) -> bool {
        let (mut near, mut far) = (self.tnear, self.tfar);
        for axis in 0..3 {
            // t·d must lie in [low, high].
            let low = bounds.min[axis] - self.org[1][axis];
            let high = bounds.max[axis] - self.org[0][axis];
            let (least, most) = (self.dir[0][axis], self.dir[1][axis]);
            let (inv_least, inv_most) = (self.inv[0][axis], self.inv[1][axis]);
            if least > 0.0 {
                near = near.max(low * if low >= 0.0 { inv_most } else { inv_least });
                far = far.min(high * if high >= 0.0 { inv_least } else { inv_most });
            } else if most < 0.0 {
                near = near.max(high * if high <= 0.0 { inv_least } else { inv_most });
                far = far.min(low * if low <= 0.0 { inv_most } else { inv_least });
            } else if self.tnear < 0.0 {
                // Directions of both signs and a segment on both sides of the origin.
            } else if low > 0.0 {
                near = near.max(if most > 0.0 { low * inv_most } else { f64::INFINITY });
            } else if high < 0.0 {
                near = near.max(if least < 0.0 { high * inv_least } else { f64::INFINITY });
            }
        }
        near <= far
    }
}

#[cfg(test)]
mod tests;
