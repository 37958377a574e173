//! How often a ray crosses a closed mesh: as often in as out.
//!
//! Hits at one distance are one crossing, since a ray through an edge may meet either face or both.
//! Where those faces look both ways the ray touches the outline, and whether it crosses there
//! twice or not at all is a matter of the last bit: such places do not count, and the others must
//! be as many as exact orientation predicates (Shewchuk, 1997) find.

use crate::shapes;
use crate::suite::{self, Outcome, Size};
use rand::Rng;
use rayon::prelude::*;
use robust::{Coord3D, orient3d};
use std::f64::consts::TAU;
use tweenray::intersect::{EmbreeIntersector, Intersector, PrimRef, Ray};
use tweenray::math::DVec3;
use tweenray::scene::{HitRules, Scene, WorldMesh};
use tweenray::stats::RayCounts;

/// Hits closer than this, of the scene's size 1, are one crossing.
const TOGETHER: f64 = 1e-5;
/// The same for faces that share a vertex.
const FANNED: f64 = 1e-4;
/// A weight below this is at the edge of its triangle.
const BAND: f64 = 1e-4;

pub fn parity(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let columns = size.of(60, 200);
    for (name, mesh) in [
        ("sphere", shapes::sphere(DVec3::ZERO, 1.0, columns, columns / 2)),
        ("torus", torus(columns, columns / 3)),
    ] {
        let scene = shapes::scene_of(mesh);
        let embree = EmbreeIntersector::new(&scene, HitRules::default(), suite::isa(), 4).unwrap();
        let fans = Fans::of(&scene);
        for aim in [Aim::Vertex, Aim::Edge, Aim::Anywhere] {
            let rays = size.of(4_000, 1_000_000 / 6 + 1);
            let judged = (0..rays).into_par_iter().map(|i| {
                let ray = aimed(&scene, i, aim);
                judge(&scene, &fans, &ray, &crossings(&embree, &fans, &ray))
            });
            let found = judged.collect::<Vec<_>>();
            let count = |what: Verdict| found.iter().filter(|v| **v == what).count();
            let (touch, wrong) = (count(Verdict::Settled), count(Verdict::Wrong));
            outcome.show(format!(
                "{name}, {aim:?}: {wrong} of {rays} wrong, {touch} touch the outline"
            ));
            outcome.count(rays, wrong as u64);
            if let Some(i) = found.iter().position(|v| *v == Verdict::Wrong) {
                let ray = aimed(&scene, i as u64, aim);
                let ours = crossings(&embree, &fans, &ray);
                let exact = exact_crossings(&scene, &fans, &ray);
                outcome.example(format!("{name}, {aim:?}: {ray:?}: {ours:?}, exact {exact:?}"));
            }
        }
    }
    outcome
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Aim {
    Vertex,
    Edge,
    Anywhere,
}

/// A ray from outside the ball of radius 2 around the origin, through the mesh.
fn aimed(scene: &Scene, i: u64, aim: Aim) -> Ray {
    let mut rng = suite::rng(22, i);
    let org = shapes::direction(&mut rng) * 2.5;
    let mesh = &scene.meshes[0];
    let corners = mesh.corners(rng.random_range(0..mesh.triangles.len()));
    let k = rng.random_range(0..3);
    let target = match aim {
        Aim::Vertex => corners[k],
        Aim::Edge => corners[k].lerp(corners[(k + 1) % 3], rng.random()),
        Aim::Anywhere => shapes::in_ball(&mut rng, 1.0),
    };
    Ray::new(org, target - org)
}

fn torus(columns: u32, rows: u32) -> WorldMesh {
    let mut mesh = shapes::sphere(DVec3::ZERO, 1.0, 3, 2);
    mesh.positions = (0..columns * rows)
        .map(|k| {
            let (sin_p, cos_p) = (TAU * f64::from(k % columns) / f64::from(columns)).sin_cos();
            let (sin_t, cos_t) = (TAU * f64::from(k / columns) / f64::from(rows)).sin_cos();
            let r = 0.7 + 0.28 * cos_t;
            DVec3::new(r * cos_p, 0.28 * sin_t, r * sin_p)
        })
        .collect();
    let faces = (0..columns * rows).flat_map(|k| {
        let (column, row) = (k % columns, k / columns);
        let at = |c: u32, r: u32| (r % rows) * columns + c % columns;
        let (a, b) = (at(column, row), at(column + 1, row));
        let (c, d) = (at(column, row + 1), at(column + 1, row + 1));
        [[a, d, b], [a, c, d]]
    });
    mesh.triangles = faces.collect();
    mesh
}

/// Which triangles meet at each vertex, and every triangle's normal.
struct Fans {
    of_vertex: Vec<Vec<u32>>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Fans {
    fn of(scene: &Scene) -> Self {
        let mesh = &scene.meshes[0];
        let mut of_vertex = vec![Vec::new(); mesh.vertex_count];
        for (prim, triangle) in mesh.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| of_vertex[*v as usize].push(prim as u32));
        }
        let normal = |prim: usize| {
            let [a, b, c] = mesh.corners(prim);
            (b - a).cross(c - a)
        };
        let normals = (0..mesh.triangles.len()).map(normal).collect();
        Self { of_vertex, normals, triangles: mesh.triangles.clone() }
    }

    /// Whether two faces share a vertex.
    fn are_neighbours(&self, a: u32, b: u32) -> bool {
        self.triangles[a as usize].iter().any(|v| self.triangles[b as usize].contains(v))
    }

    /// Whether the faces around `prim`'s corners look both ways from `dir`.
    fn look_both_ways(&self, prim: u32, dir: DVec3) -> bool {
        let around =
            self.triangles[prim as usize].iter().flat_map(|v| &self.of_vertex[*v as usize]);
        let faces_us = |prim: &u32| self.normals[*prim as usize].dot(dir) < 0.0;
        let (mut any, mut all) = (false, true);
        around.for_each(|prim| {
            any |= faces_us(prim);
            all &= faces_us(prim);
        });
        any != all
    }
}

/// Hits at one distance.
#[derive(Debug, Default, Clone)]
struct Crossing {
    prims: Vec<PrimRef>,
    /// Nearest and farthest of its hits.
    near: f64,
    far: f64,
    /// Entering, leaving.
    ways: [bool; 2],
    touches: bool,
}

/// Walks along `ray`, hit by hit.
fn crossings(embree: &EmbreeIntersector, fans: &Fans, ray: &Ray) -> Vec<Crossing> {
    let together = TOGETHER / ray.dir.length();
    let mut all: Vec<Crossing> = Vec::new();
    let mut next = *ray;
    while let Some(hit) = embree.intersect(&next, &mut RayCounts::default()) {
        let leaves = fans.normals[hit.prim.prim_id as usize].dot(ray.dir) >= 0.0;
        let at_edge = hit.u.min(hit.v).min(1.0 - hit.u - hit.v) < BAND;
        let open = all.last_mut().filter(|c| {
            // Where a ray grazes the edge of two faces it may be said to meet both, a little apart;
            // that it went the same way twice gives it away.
            let again = c.ways == [!leaves, leaves]
                && at_edge
                && hit.t - c.far <= FANNED / ray.dir.length()
                && fans.are_neighbours(c.prims[c.prims.len() - 1].prim_id, hit.prim.prim_id);
            hit.t - c.far <= together || again
        });
        if let Some(seen) = open.as_ref().filter(|c| c.prims.contains(&hit.prim)) {
            // All here have had their turn: on.
            next.tnear = seen.far + together;
            continue;
        }
        let crossing = match open {
            Some(crossing) => crossing,
            None => {
                all.push(Crossing { near: hit.t, far: hit.t, ..Crossing::default() });
                all.last_mut().unwrap()
            }
        };
        crossing.prims.push(hit.prim);
        crossing.far = crossing.far.max(hit.t);
        crossing.ways[usize::from(leaves)] = true;
        crossing.touches |=
            crossing.ways == [true; 2] || at_edge && fans.look_both_ways(hit.prim.prim_id, ray.dir);
        (next.tnear, next.exclude) = (hit.t, hit.prim);
    }
    all
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Verdict {
    /// In as often as out.
    Even,
    /// The outline is touched; the predicates agree elsewhere.
    Settled,
    Wrong,
}

fn judge(scene: &Scene, fans: &Fans, ray: &Ray, found: &[Crossing]) -> Verdict {
    let plain = found.iter().filter(|c| !c.touches).count();
    let in_turn = found.iter().enumerate().all(|(i, c)| c.ways[i % 2] && c.ways != [true; 2]);
    if found.len() % 2 == 0 && in_turn {
        return Verdict::Even;
    }
    if plain == found.len() {
        return Verdict::Wrong;
    }
    let together = 2.0 * TOGETHER / ray.dir.length();
    let exact = exact_crossings(scene, fans, ray);
    let at_outline = |t: f64| {
        let near = |c: &Crossing| (c.near - together..=c.far + together).contains(&t);
        found.iter().any(|c| c.touches && near(c))
    };
    let elsewhere = exact.iter().filter(|(t, _)| !at_outline(*t)).count();
    let right = exact.len() % 2 == 0 && elsewhere % 2 == plain % 2;
    if right { Verdict::Settled } else { Verdict::Wrong }
}

/// Where the line of `ray`, which starts outside, crosses the mesh: by exact signs of the line
/// against every edge, an edge that it meets exactly counted to one fixed side. Ray parameter and
/// triangle of each.
fn exact_crossings(scene: &Scene, fans: &Fans, ray: &Ray) -> Vec<(f64, usize)> {
    let mesh = &scene.meshes[0];
    let point = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    // Not `org + dir`, which may be a vertex to the last bit: then nothing would decide.
    let (start, end) = (point(ray.org), point(ray.org + ray.dir * 1.371_828));
    let vertex = |i: u32| point(mesh.positions[i as usize].as_dvec3());
    let side = |a: u32, b: u32| {
        let sign = orient3d(start, end, vertex(a.min(b)), vertex(a.max(b))) >= 0.0;
        sign == (a < b)
    };
    let mut crossed = Vec::new();
    for (prim, [a, b, c]) in mesh.triangles.iter().copied().enumerate() {
        let first = side(a, b);
        if first == side(b, c) && first == side(c, a) {
            let normal = fans.normals[prim];
            let corner = mesh.positions[a as usize].as_dvec3();
            crossed.push(((corner - ray.org).dot(normal) / ray.dir.dot(normal), prim));
        }
    }
    crossed
}
