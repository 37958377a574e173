//! Polygons to triangles: ear clipping with exact orientation tests.
//!
//! Takes the corners of one face in order; gives triangles of local corner numbers that wind as
//! the face does. Concave faces are covered exactly; self-crossing ones end too, somehow.

use crate::math::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// Concave faces with more corners than this are refused: clipping is quadratic.
pub(super) const MAX_CONCAVE_CORNERS: usize = 20_000;

/// Triangles of the face with the given corners, appended to `out` as local corner numbers.
/// Convex faces fan out from corner 0. Fewer than three corners give nothing.
///
/// Errors: a concave face with more than [`MAX_CONCAVE_CORNERS`] corners.
pub(super) fn triangulate(
    corners: &[DVec3],
    out: &mut Vec<[u32; 3]>,
) -> std::result::Result<(), String> {
    let n = corners.len();
    if n <= 3 {
        out.extend((n == 3).then_some([0, 1, 2]));
        return Ok(());
    }
    let flat = project(corners);
    if is_convex(&flat) {
        out.extend((2..n as u32).map(|i| [0, i - 1, i]));
        return Ok(());
    }
    if n > MAX_CONCAVE_CORNERS {
        return Err(format!(
            "a concave face with {n} corners; {MAX_CONCAVE_CORNERS} is the most. Split it first"
        ));
    }
    clip_ears(&flat, out);
    Ok(())
}

/// Corners in the coordinate plane that the face is most parallel to, counter-clockwise.
fn project(corners: &[DVec3]) -> Vec<Coord<f64>> {
    // Newell's method: exact for plane faces, the mean plane for others.
    let first = corners[0];
    let mut normal = DVec3::ZERO;
    for (i, a) in corners.iter().enumerate() {
        normal += (*a - first).cross(corners[(i + 1) % corners.len()] - first);
    }
    let size = normal.abs();
    let flat = |p: &DVec3| match size.max_element() {
        m if m == size.x => DVec2::new(p.y, p.z * normal.x.signum()),
        m if m == size.y => DVec2::new(p.z, p.x * normal.y.signum()),
        _ => DVec2::new(p.x, p.y * normal.z.signum()),
    };
    corners.iter().map(flat).map(|p| Coord { x: p.x, y: p.y }).collect()
}

/// No corner turns right, and the turns add up to one round.
fn is_convex(p: &[Coord<f64>]) -> bool {
    let n = p.len();
    let corner = |i: usize| orient2d(p[i], p[(i + 1) % n], p[(i + 2) % n]);
    // A star turns left everywhere but more than once around: x then changes direction often.
    let rises = |i: usize| p[(i + 1) % n].x > p[i].x;
    let reversals = (0..n).filter(|i| rises(*i) != rises((*i + 1) % n)).count();
    (0..n).all(|i| corner(i) > 0.0) && reversals <= 2
}

struct Ring<'a> {
    p: &'a [Coord<f64>],
    prev: Vec<u32>,
    next: Vec<u32>,
    /// Corners that are not strictly convex: only they can lie inside an ear.
    reflex: Vec<u32>,
}

fn clip_ears(p: &[Coord<f64>], out: &mut Vec<[u32; 3]>) {
    let n = p.len() as u32;
    let mut ring = Ring {
        p,
        prev: (0..n).map(|i| (i + n - 1) % n).collect(),
        next: (0..n).map(|i| (i + 1) % n).collect(),
        reflex: Vec::new(),
    };
    ring.reflex = (0..n).filter(|i| ring.turn(*i) <= 0.0).collect();
    let (mut at, mut left, mut refused) = (0, n, 0);
    while left > 3 {
        // A whole round without an ear: the face crosses itself. Clip on, to end.
        if refused < left && !ring.is_ear(at) {
            (at, refused) = (ring.next[at as usize], refused + 1);
            continue;
        }
        let (before, after) = ring.neighbours(at);
        out.push([before, at, after]);
        ring.remove(at);
        (at, left, refused) = (ring.next[after as usize], left - 1, 0);
    }
    let (before, after) = ring.neighbours(at);
    out.push([before, at, after]);
}

impl Ring<'_> {
    fn neighbours(&self, i: u32) -> (u32, u32) {
        (self.prev[i as usize], self.next[i as usize])
    }

    fn turn(&self, i: u32) -> f64 {
        let (before, after) = self.neighbours(i);
        self.orient(before, i, after)
    }

    fn orient(&self, a: u32, b: u32, c: u32) -> f64 {
        orient2d(self.p[a as usize], self.p[b as usize], self.p[c as usize])
    }

    fn is_ear(&self, i: u32) -> bool {
        if self.turn(i) <= 0.0 {
            return false;
        }
        let (a, c) = self.neighbours(i);
        let same = |j: u32, k: u32| self.p[j as usize] == self.p[k as usize];
        !self.reflex.iter().any(|&r| {
            !(same(r, a) || same(r, i) || same(r, c))
                && self.orient(a, i, r) >= 0.0
                && self.orient(i, c, r) >= 0.0
                && self.orient(c, a, r) >= 0.0
        })
    }

    fn remove(&mut self, i: u32) {
        let (before, after) = self.neighbours(i);
        self.next[before as usize] = after;
        self.prev[after as usize] = before;
        // Clipping an ear never makes a convex corner reflex, but may make a reflex one convex.
        let convex = |j: u32, ring: &Self| (j == before || j == after) && ring.turn(j) > 0.0;
        let reflex = std::mem::take(&mut self.reflex);
        self.reflex = reflex.into_iter().filter(|&j| j != i && !convex(j, self)).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
        let cross = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| corners[i as usize]);
            0.5 * (b - a).cross(c - a)
        };
        triangles.iter().map(cross).collect()
    }

    fn run(corners: &[DVec3]) -> Vec<[u32; 3]> {
        let mut out = Vec::new();
        triangulate(corners, &mut out).expect("a small face");
        assert_eq!(out.len(), corners.len() - 2);
        out
    }

    fn lift(flat: &[(f64, f64)]) -> Vec<DVec3> {
        flat.iter().map(|(x, y)| DVec3::new(*x, 0.3 * *x + 0.2 * *y, *y)).collect()
    }

    #[test]
    fn concave_faces_are_covered_once_and_wind_alike() {
        let arrow = lift(&[(0.0, 0.0), (2.0, -1.0), (0.0, 3.0), (-2.0, -1.0)]);
        let l_shape =
            lift(&[(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]);
        let comb: Vec<(f64, f64)> = (0..40)
            .map(|i| (f64::from(i), if i % 2 == 0 { 0.0 } else { 5.0 }))
            .chain([(39.5, -1.0), (-0.5, -1.0)])
            .collect();
        for face in [arrow, l_shape, lift(&comb)] {
            for turned in 0..face.len() {
                let mut face = face.clone();
                face.rotate_left(turned);
                let whole: DVec3 =
                    area(&face, &(2..face.len() as u32).map(|i| [0, i - 1, i]).collect::<Vec<_>>())
                        .iter()
                        .sum();
                let parts = area(&face, &run(&face));
                assert!(parts.iter().all(|part| part.dot(whole) > 0.0), "turned by {turned}");
                let sum: f64 = parts.iter().map(|part| part.length()).sum();
                assert!((sum - whole.length()).abs() < 1e-12 * sum);
            }
        }
    }

    #[test]
    fn degenerate_and_self_intersecting_faces_end() {
        run(&[DVec3::ZERO; 9]);
        run(&lift(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]));
        let star: Vec<(f64, f64)> =
            (0..5).map(|i| (f64::from(i) * 4.0 * std::f64::consts::PI / 5.0).sin_cos()).collect();
        run(&lift(&star));
        let zigzag: Vec<DVec3> = (0..MAX_CONCAVE_CORNERS + 1)
            .map(|i| DVec3::new(i as f64, (i % 2) as f64, 0.0))
            .collect();
        assert!(triangulate(&zigzag, &mut Vec::new()).is_err());
    }
}
