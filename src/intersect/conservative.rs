//! The oracle's conservative filter: which triangles a line may meet, many at a time and never one too few.
//!
//! Triangles are sheared so that the line runs along z (Woop et al., 2013) and their three edge
//! functions compared with a bound on all rounding errors; what passes goes to the exact court, so
//! nothing here decides a hit. Products and sums are not fused: every CPU filters alike.

use super::court::Line;
use crate::math::DVec3;
use pulp::{Arch, Simd, WithSimd};

/// Triangles in a block: nine rows of it in f64 are 18 KB, which stay in the first-level cache.
pub const BLOCK: usize = 256;
/// Vectors looked at before one branch.
const UNROLL: usize = 2;

/// Triangles as nine rows of numbers: `rows[3·corner + axis][triangle]`.
///
/// 36 bytes a triangle; the last block is filled up with triangles of one point.
pub struct Triangles {
    rows: [Vec<f32>; 9],
    count: usize,
}

/// One block, widened to f64.
#[derive(Clone)]
pub struct Block {
    rows: Box<[[f64; BLOCK]; 9]>,
}

/// A line as the filter sees it.
#[derive(Debug, Clone, Copy)]
pub struct ShearedRay {
    /// Axis along which the line moves most, last; the other two before it.
    axes: [usize; 3],
    /// Change of the first two coordinates with the last.
    shear: [f64; 2],
    /// Where the line meets the plane in which the last coordinate is zero.
    foot: [f64; 2],
    /// Edge functions this far on the wrong side still pass.
    bound: f64,
}

impl ShearedRay {
    /// For triangles that `line` meets or passes within `margin` (scene space).
    pub fn new(line: &Line, margin: f64) -> Self {
        let dir = line.end - line.start;
        let size = dir.abs();
        let last = if size.z >= size.x.max(size.y) { 2 } else { usize::from(size.y >= size.x) };
        let axes = [(last + 1) % 3, (last + 2) % 3, last];
        let shear = [0, 1].map(|i| dir[axes[i]] / dir[last]);
        let foot = [0, 1].map(|i| line.start[axes[i]] - shear[i] * line.start[last]);
        let (reach, start) = line.sizes();
        // Sheared coordinates are at most 2(reach + start) and off by at most 8 ε of that; an edge
        // function is a sum of two products of two of them: off by 80 ε (reach + start)². And a
        // triangle at the distance d from the line has no edge function below −d·√3 times the
        // longest sheared edge, which is 4√2 reach at most.
        let rounding = 256.0 * f64::EPSILON * (reach + start).powi(2);
        Self { axes, shear, foot, bound: rounding + 10.0 * margin * reach }
    }
}

impl Triangles {
    /// From the corners of `count` triangles, f32 as Embree holds them.
    pub fn new(count: usize, triangles: impl Iterator<Item = [[f32; 3]; 3]>) -> Self {
        let padded = count.next_multiple_of(BLOCK);
        let mut rows = [(); 9].map(|()| Vec::with_capacity(padded));
        for corners in triangles {
            for (row, value) in rows.iter_mut().zip(corners.as_flattened()) {
                row.push(*value);
            }
        }
        rows.iter_mut().for_each(|row| row.resize(padded, 0.0));
        Self { rows, count }
    }

    /// Triangles.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Bytes held.
    pub fn memory(&self) -> u64 {
        self.rows.iter().map(|row| (row.capacity() * size_of::<f32>()) as u64).sum()
    }

    /// Blocks.
    pub fn blocks(&self) -> usize {
        self.rows[0].len() / BLOCK
    }

    /// The corners of one triangle, widened.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        [0, 3, 6].map(|corner| {
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(self.rows[corner + axis][triangle]));
            DVec3::new(x, y, z)
        })
    }

    /// Pairs (line, triangle) of one block that may meet, appended to `passed`; `work` is scratch.
    pub fn filter(
        &self,
        block: usize,
        rays: &[ShearedRay],
        work: &mut Block,
        passed: &mut Vec<(u32, u32)>,
    ) {
        let first = block * BLOCK;
        let before = passed.len();
        for (wide, narrow) in work.rows.iter_mut().zip(&self.rows) {
            for (wide, narrow) in wide.iter_mut().zip(&narrow[first..first + BLOCK]) {
                *wide = f64::from(*narrow);
            }
        }
        Arch::new().dispatch(ConservativeFilter { block: work, rays, first: first as u32, passed });
        // What fills up the last block is no triangle.
        if first + BLOCK > self.count {
            let count = self.count as u32;
            let mut kept = before;
            for i in before..passed.len() {
                if passed[i].1 < count {
                    passed.swap(kept, i);
                    kept += 1;
                }
            }
            passed.truncate(kept);
        }
    }
}

impl Default for Block {
    fn default() -> Self {
        Self { rows: Box::new([[0.0; BLOCK]; 9]) }
    }
}

struct ConservativeFilter<'a> {
    block: &'a Block,
    rays: &'a [ShearedRay],
    first: u32,
    passed: &'a mut Vec<(u32, u32)>,
}

impl WithSimd for ConservativeFilter<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for (index, ray) in self.rays.iter().enumerate() {
            let lanes = Lanes::new(simd, self.block, ray);
            let vectors = BLOCK / S::F64_LANES;
            let mut at = 0;
            while at < vectors {
                let mut best = lanes.least_side(simd, at);
                for more in 1..UNROLL {
                    best = simd.max_f64s(best, lanes.least_side(simd, at + more));
                }
                if simd.reduce_max_f64s(best) >= -ray.bound {
                    for vector in at..at + UNROLL {
                        let sides = [lanes.least_side(simd, vector)];
                        for (lane, side) in
                            bytemuck::cast_slice::<_, f64>(&sides).iter().enumerate()
                        {
                            if *side >= -ray.bound {
                                let triangle = vector * S::F64_LANES + lane;
                                self.passed.push((index as u32, self.first + triangle as u32));
                            }
                        }
                    }
                }
                at += UNROLL;
            }
        }
    }
}

/// The rows and the line as vectors. Nothing here is a closure: only what is `inline(always)` is sure
/// to be compiled for the instruction set that `S` stands for.
struct Lanes<'a, S: Simd> {
    corners: [[&'a [S::f64s]; 3]; 3],
    shear: [S::f64s; 2],
    foot: [S::f64s; 2],
}

impl<'a, S: Simd> Lanes<'a, S> {
    #[inline(always)]
    fn new(simd: S, block: &'a Block, ray: &ShearedRay) -> Self {
        let [x, y, z] = ray.axes;
        let rows = &block.rows;
        Self {
            corners: [
                [vectors::<S>(&rows[x]), vectors::<S>(&rows[y]), vectors::<S>(&rows[z])],
                [
                    vectors::<S>(&rows[3 + x]),
                    vectors::<S>(&rows[3 + y]),
                    vectors::<S>(&rows[3 + z]),
                ],
                [
                    vectors::<S>(&rows[6 + x]),
                    vectors::<S>(&rows[6 + y]),
                    vectors::<S>(&rows[6 + z]),
                ],
            ],
            shear: [simd.splat_f64s(ray.shear[0]), simd.splat_f64s(ray.shear[1])],
            foot: [simd.splat_f64s(ray.foot[0]), simd.splat_f64s(ray.foot[1])],
        }
    }

    /// How far the line is inside, as the least edge function seen from the side on which most of
    /// them are positive: negative outside.
    #[inline(always)]
    fn least_side(&self, simd: S, at: usize) -> S::f64s {
        let a = self.sheared(simd, 0, at);
        let b = self.sheared(simd, 1, at);
        let c = self.sheared(simd, 2, at);
        let (u, v, w) = (edge(simd, a, b), edge(simd, b, c), edge(simd, c, a));
        let least = simd.min_f64s(u, simd.min_f64s(v, w));
        let most = simd.max_f64s(u, simd.max_f64s(v, w));
        simd.max_f64s(least, simd.neg_f64s(most))
    }

    #[inline(always)]
    fn sheared(&self, simd: S, corner: usize, at: usize) -> (S::f64s, S::f64s) {
        let [x, y, z] = self.corners[corner];
        let (x, y, z) = (x[at], y[at], z[at]);
        let x = simd.sub_f64s(x, simd.mul_f64s(self.shear[0], z));
        let y = simd.sub_f64s(y, simd.mul_f64s(self.shear[1], z));
        (simd.sub_f64s(x, self.foot[0]), simd.sub_f64s(y, self.foot[1]))
    }
}

#[inline(always)]
fn vectors<S: Simd>(row: &[f64; BLOCK]) -> &[S::f64s] {
    S::as_simd_f64s(row).0
}

#[inline(always)]
fn edge<S: Simd>(simd: S, p: (S::f64s, S::f64s), q: (S::f64s, S::f64s)) -> S::f64s {
    simd.sub_f64s(simd.mul_f64s(p.0, q.1), simd.mul_f64s(p.1, q.0))
}
