//! Vertex normals from the triangles around each vertex, split at sharp edges.
//!
//! Weighted by the angle at the vertex (Thürmer and Wüthrich, 1998): the result does not depend
//! on how a face is cut into triangles. An edge is smooth where two triangles run along it in
//! opposite directions, as neighbours of one orientation do, and their planes meet at no more
//! than the crease angle; reversed neighbours meet in a crease.

use super::unit_or_zero;
use crate::math::{DVec3, Vec3};
use crate::scene::{Corners, weld};
use rayon::prelude::*;

/// Vertices a task.
const TASK: usize = 1 << 14;
/// Up to this many triangles around a vertex are compared pair by pair.
const SMALL: usize = 32;
/// More triangles than this that leave a vertex along one edge make it a crease.
const MAX_ALONG_EDGE: usize = 8;

/// Smooth normals; `crease_degrees` from 0 (every edge sharp that is not flat) to 180.
///
/// Corners have indices of their own only where some vertex has more than one normal. A vertex
/// without triangles has a zero normal. Linear in the mesh's size.
pub(super) fn smooth(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    crease_degrees: f64,
) -> Corners<Vec3> {
    let welded = weld(positions);
    let around = Around::new(positions.len(), triangles, welded.as_deref());
    // A little more than the angle itself: an edge of exactly that angle stays smooth.
    let min_cos = libm::cos(crease_degrees.clamp(0.0, 180.0).to_radians()) - 1e-9;
    let mesh = Mesh { positions, triangles, welded: welded.as_deref(), min_cos };
    let tasks: Vec<Task> = (0..positions.len())
        .step_by(TASK)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|from| mesh.task(&around, from, (from + TASK).min(positions.len())))
        .collect();
    if tasks.iter().any(|task| task.split.is_some()) {
        return split_corners(tasks, &around, triangles.len());
    }
    let mut values = Vec::with_capacity(positions.len());
    tasks.into_iter().for_each(|task| values.extend(task.values));
    if let Some(welded) = welded {
        // Twins come after their first: each reads a value that is already its own.
        (0..values.len()).for_each(|i| values[i] = values[welded[i] as usize]);
    }
    Corners { values, corners: None }
}

/// The corners (`3 · triangle + k`) at each vertex, flat.
struct Around {
    starts: Vec<u32>,
    corners: Vec<u32>,
}

impl Around {
    fn new(vertices: usize, triangles: &[[u32; 3]], welded: Option<&[u32]>) -> Self {
        let vertex = |i: u32| welded.map_or(i, |w| w[i as usize]) as usize;
        let mut starts = vec![0u32; vertices + 2];
        triangles.iter().flatten().for_each(|i| starts[vertex(*i) + 2] += 1);
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        // starts[v + 1] is where v's next corner goes, and in the end where v's corners end.
        let mut corners = vec![0; 3 * triangles.len()];
        for (corner, i) in triangles.iter().flatten().enumerate() {
            let next = &mut starts[vertex(*i) + 1];
            corners[*next as usize] = corner as u32;
            *next += 1;
        }
        starts.pop();
        Self { starts, corners }
    }

    fn at(&self, vertex: usize) -> &[u32] {
        &self.corners[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }
}

struct Mesh<'a> {
    positions: &'a [DVec3],
    triangles: &'a [[u32; 3]],
    welded: Option<&'a [u32]>,
    min_cos: f64,
}

/// The normals of a run of vertices.
struct Task {
    values: Vec<Vec3>,
    /// For each corner around them, in order, the index into `values`; `None` when each vertex
    /// has just one.
    split: Option<Vec<u32>>,
    corners: usize,
}

/// A triangle at a vertex.
#[derive(Clone, Copy)]
struct Wing {
    /// Welded vertices before and after, in the triangle's order.
    before: u32,
    after: u32,
    normal: DVec3,
    angle: f64,
    /// Index of another wing of its smooth group, or its own: a union-find forest.
    group: u32,
}

impl Mesh<'_> {
    fn task(&self, around: &Around, from: usize, to: usize) -> Task {
        let corners = (around.starts[to] - around.starts[from]) as usize;
        let mut task = Task { values: Vec::with_capacity(to - from), split: None, corners };
        let mut wings = Vec::new();
        let mut done = 0;
        for vertex in from..to {
            wings.clear();
            wings.extend(around.at(vertex).iter().map(|corner| self.wing(*corner)));
            (0..wings.len()).for_each(|i| wings[i].group = i as u32);
            self.join(&mut wings);
            let count = push_normals(&mut wings, &mut task.values);
            if count > 1 && task.split.is_none() {
                task.split = Some(one_each(around, from, vertex, corners));
            }
            if let Some(split) = &mut task.split {
                let first = (task.values.len() - count) as u32;
                split.extend(wings.iter().map(|wing| first + wing.group));
            }
            done += wings.len();
        }
        debug_assert_eq!(done, corners);
        task
    }

    fn wing(&self, corner: u32) -> Wing {
        let triangle = self.triangles[corner as usize / 3];
        let k = corner as usize % 3;
        let [at, after, before] = [triangle[k], triangle[(k + 1) % 3], triangle[(k + 2) % 3]];
        let p = self.positions[at as usize];
        let (u, v) = (self.positions[after as usize] - p, self.positions[before as usize] - p);
        let (normal, cos) = plane_and_cos(u, v).unwrap_or_else(|| {
            // So small or large that squares under- or overflow: scaled, then once more.
            let unit = |v: DVec3| v / v.abs().max_element().max(f64::MIN_POSITIVE);
            plane_and_cos(unit(u), unit(v)).unwrap_or((DVec3::ZERO, 1.0))
        });
        let weld = |i: u32| self.welded.map_or(i, |w| w[i as usize]);
        Wing { before: weld(before), after: weld(after), normal, angle: acos(cos), group: 0 }
    }

    /// Joins wings that meet smoothly along an edge at the vertex.
    fn join(&self, wings: &mut [Wing]) {
        let smooth = |a: &Wing, b: &Wing| a.normal.dot(b.normal) >= self.min_cos;
        if wings.len() <= SMALL {
            for i in 0..wings.len() {
                for j in 0..wings.len() {
                    if wings[i].after == wings[j].before && smooth(&wings[i], &wings[j]) {
                        unite(wings, i, j);
                    }
                }
            }
            return;
        }
        let mut by_before: Vec<(u32, u32)> =
            wings.iter().enumerate().map(|(j, w)| (w.before, j as u32)).collect();
        by_before.sort_unstable();
        for i in 0..wings.len() {
            let after = wings[i].after;
            let start = by_before.partition_point(|(before, _)| *before < after);
            let along = by_before[start..].iter().take_while(|(before, _)| *before == after);
            for (_, j) in along.take(MAX_ALONG_EDGE) {
                if smooth(&wings[i], &wings[*j as usize]) {
                    unite(wings, i, *j as usize);
                }
            }
        }
    }
}

fn root(wings: &mut [Wing], mut i: usize) -> usize {
    while wings[i].group as usize != i {
        let up = wings[i].group as usize;
        wings[i].group = wings[up].group;
        i = up;
    }
    i
}

fn unite(wings: &mut [Wing], i: usize, j: usize) {
    let (i, j) = (root(wings, i), root(wings, j));
    wings[i.max(j)].group = i.min(j) as u32;
}

/// Appends the normal of each group, numbers the wings' groups from 0, and returns how many
/// there are; a vertex without wings counts as one.
fn push_normals(wings: &mut [Wing], values: &mut Vec<Vec3>) -> usize {
    if wings.is_empty() {
        values.push(Vec3::ZERO);
        return 1;
    }
    // Roots precede their members, so one pass can number them.
    (0..wings.len()).for_each(|i| wings[i].group = root(wings, i) as u32);
    let mut sums: [DVec3; 4] = [DVec3::ZERO; 4];
    let mut more = Vec::new();
    let mut count = 0;
    for i in 0..wings.len() {
        let up = wings[i].group as usize;
        let group = if up == i { count } else { wings[up].group as usize };
        count += usize::from(up == i);
        let weighted = wings[i].angle * wings[i].normal;
        wings[i].group = group as u32;
        if let Some(sum) = sums.get_mut(group) {
            *sum += weighted;
        } else {
            more.resize(more.len().max(group - sums.len() + 1), DVec3::ZERO);
            more[group - sums.len()] += weighted;
        }
    }
    values.extend(sums.iter().chain(&more).take(count).map(|sum| unit_or_zero(*sum)));
    count
}

/// The corners' values before `vertex`, as long as each vertex had one.
fn one_each(around: &Around, from: usize, vertex: usize, corners: usize) -> Vec<u32> {
    let mut split = Vec::with_capacity(corners);
    for v in from..vertex {
        split.extend(around.at(v).iter().map(|_| (v - from) as u32));
    }
    split
}

fn split_corners(tasks: Vec<Task>, around: &Around, triangles: usize) -> Corners<Vec3> {
    let mut values = Vec::with_capacity(tasks.iter().map(|t| t.values.len()).sum());
    let mut corners = vec![[0; 3]; triangles];
    let mut slot = 0;
    for (number, task) in tasks.into_iter().enumerate() {
        let base = values.len() as u32;
        let split = task.split.unwrap_or_else(|| {
            let (from, to) = (number * TASK, number * TASK + task.values.len());
            one_each(around, from, to, task.corners)
        });
        for value in split {
            let corner = around.corners[slot] as usize;
            corners[corner / 3][corner % 3] = base + value;
            slot += 1;
        }
        values.extend(task.values);
    }
    Corners { values, corners: Some(corners) }
}

/// The unit normal of the plane along `u` and `v` and the cosine between them, unless a square
/// under- or overflows.
#[inline]
fn plane_and_cos(u: DVec3, v: DVec3) -> Option<(DVec3, f64)> {
    let cross = u.cross(v);
    let (area, sides) = (cross.length(), u.length() * v.length());
    let safe = 1e-140..1e140;
    (safe.contains(&area) && safe.contains(&sides)).then(|| (cross / area, u.dot(v) / sides))
}

/// Arc cosine to 2e-8 by additions, products and a root alone, hence the same on every machine
/// (Abramowitz and Stegun 4.4.46). Arguments beyond ±1 and NaN count as the end of the range.
fn acos(x: f64) -> f64 {
    const C: [f64; 8] = [
        1.570_796_305_0,
        -0.214_598_801_6,
        0.088_978_987_4,
        -0.050_174_304_6,
        0.030_891_881_0,
        -0.017_088_125_6,
        0.006_670_090_1,
        -0.001_262_491_1,
    ];
    let a = x.abs().min(1.0);
    let half = (1.0 - a).sqrt() * C.iter().rev().fold(0.0, |sum, c| sum * a + c);
    if x < 0.0 { std::f64::consts::PI - half } else { half }
}
