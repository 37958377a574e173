//! The irradiance of an environment without shadows, by the normal: a table that is made once a scene.
//!
//! Irradiance is the product of the normal and the vector sum of the light above the horizon. So light is summed once in a tree of
//! patches of the sky: what lies whole above the horizon of a normal counts at once, and only patches that the horizon
//! crosses are looked into. The sums for the nodes of a cube's faces make the table, which is interpolated. The few patches with
//! much of the light, such as a sun, stay out of it and are added one by one: irradiance has a crease where such a light
//! sets. `tests/environment.rs` holds all of it against numerical integration.

use super::table::{RadianceTable, brightness};
use crate::math::{DVec3, Rgb, bulk};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Patches at the leaves of the tree: columns and rows.
const LEAVES: [usize; 2] = [128, 64];
/// Nodes along the edge of a cube's face.
const NODES: usize = 65;
/// A patch with more than this share of all light is added by itself.
const BRIGHT: f64 = 1.0 / 256.0;
/// Most patches that are.
const MOST_BRIGHT: usize = 32;

/// Irradiance without shadows of each colour, and of what is brighter than the mean.
type Sums = [f64; 4];
/// The vector sums of the same light.
type Moments = [DVec3; 4];

/// Irradiance without shadows by the normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IrradianceTable {
    /// For each face of a cube, +x, -x, +y, ..., and each node of it, row by row.
    #[serde(with = "bulk")]
    nodes: Vec<[f32; 4]>,
    bright: Vec<BrightPatch>,
}

/// A small part of the sky with much of the light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct BrightPatch {
    /// Unit direction to its middle.
    axis: DVec3,
    /// What it sends to a surface that faces it.
    power: [f32; 4],
    /// Half of its height ([`risen`]).
    half: f64,
}

/// A patch of the sky.
#[derive(Clone, Copy)]
struct Patch {
    moments: Moments,
    /// Of patches at the leaves, half of the height of the light in each ([`risen`]).
    halves: Sums,
    axis: DVec3,
    /// Sine of the angle from the axis that holds all of it; above 1 where that is no acute angle.
    reach: f64,
}

impl IrradianceTable {
    pub(super) fn of(radiance: &RadianceTable) -> Self {
        let mut leaves = leaves(radiance);
        let bright = take_bright(&mut leaves);
        let tree = Tree::of(leaves, radiance.size());
        // Opposite normals see the whole sky together: one of them follows from the other.
        let half = 3 * NODES * NODES;
        let pairs: Vec<[Sums; 2]> = (0..half)
            .into_par_iter()
            .map(|at| {
                tree.irradiance_of_both(normal_of(
                    at % (NODES * NODES) + at / (NODES * NODES) * 2 * NODES * NODES,
                ))
            })
            .collect();
        let narrow = |sums: Sums| sums.map(|x| x.max(0.0) as f32);
        let face = |k: usize| &pairs[k / 2 * NODES * NODES..][..NODES * NODES];
        let nodes = (0..6)
            .flat_map(|k| {
                let last = NODES * NODES - 1;
                // The node opposite of one is as far from the other end.
                (0..=last).map(move |at| if k % 2 == 0 { (k, at, 0) } else { (k, last - at, 1) })
            })
            .map(|(k, at, side)| narrow(face(k)[at][side]))
            .collect();
        Self { nodes, bright }
    }

    /// Irradiance on a surface with the unit normal `n`, in the environment's axes, and the brightness of the part of it that comes
    /// from directions above the mean. NaN goes on.
    pub fn at(&self, n: DVec3) -> (Rgb, f32) {
        let (face, [s, t]) = on_cube(n);
        let last = NODES - 1;
        let place = |x: f64| {
            let x = (0.5 * (x + 1.0) * last as f64).clamp(0.0, last as f64);
            let whole = (x as usize).min(last - 1);
            (whole, (x - whole as f64) as f32)
        };
        let ((column, fs), (row, ft)) = (place(s), place(t));
        let first = (face * NODES + row) * NODES + column;
        let weights = [(1.0 - fs) * (1.0 - ft), fs * (1.0 - ft), (1.0 - fs) * ft, fs * ft];
        let mut sums = [0.0; 4];
        for (at, weight) in
            [first, first + 1, first + NODES, first + NODES + 1].into_iter().zip(weights)
        {
            sums.iter_mut().zip(&self.nodes[at]).for_each(|(sum, node)| *sum += weight * node);
        }
        for patch in &self.bright {
            let cos = risen(patch.axis.dot(n), patch.half) as f32;
            sums.iter_mut().zip(patch.power).for_each(|(sum, power)| *sum += cos * power);
        }
        let [r, g, b, above] = sums;
        (Rgb::new(r, g, b), above)
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.nodes[..]) as u64 + size_of_val(&self.bright[..]) as u64
    }
}

/// The face of a cube that `n` points at, and where on it, from -1 to 1 each way.
fn on_cube(n: DVec3) -> (usize, [f64; 2]) {
    let size = n.abs();
    let (axis, [major, s, t]) = if size.x >= size.y && size.x >= size.z {
        (0, [n.x, n.y, n.z])
    } else if size.y >= size.z {
        (1, [n.y, n.z, n.x])
    } else {
        (2, [n.z, n.x, n.y])
    };
    let over = 1.0 / major.abs();
    (2 * axis + usize::from(major < 0.0), [s * over, t * over])
}

/// The unit normal of a node.
fn normal_of(node: usize) -> DVec3 {
    let (face, row, column) = (node / (NODES * NODES), node / NODES % NODES, node % NODES);
    let at = |k: usize| 2.0 * k as f64 / (NODES - 1) as f64 - 1.0;
    let (major, s, t) = (if face % 2 == 0 { 1.0 } else { -1.0 }, at(column), at(row));
    let n = match face / 2 {
        0 => DVec3::new(major, s, t),
        1 => DVec3::new(t, major, s),
        _ => DVec3::new(s, t, major),
    };
    n.normalize()
}

/// The first of so many `cells` in a row that belongs to leaf `k` of so many.
fn first_cell(k: usize, cells: usize, leaves: usize) -> usize {
    (k * cells).div_ceil(leaves)
}

/// Where leaf `k` begins, as a share of the row.
fn share(k: usize, cells: usize, leaves: usize) -> f64 {
    first_cell(k, cells, leaves) as f64 / cells as f64
}

/// The patches of the lowest level, row by row.
fn leaves(radiance: &RadianceTable) -> Vec<Patch> {
    let [width, height] = radiance.size();
    // The vector sum of directions over the latitudes of each row, but for longitude, and over the longitudes of each column.
    let rows: Vec<[f64; 2]> = radiance
        .edges()
        .windows(2)
        .map(|cos| {
            let angle = [cos[0], cos[1]].map(|c| libm::acos(c.clamp(-1.0, 1.0)));
            let sin = [cos[0], cos[1]].map(|c| ((1.0 - c) * (1.0 + c)).max(0.0).sqrt());
            let level = 0.5 * (angle[1] - angle[0] - (sin[1] * cos[1] - sin[0] * cos[0]));
            [level, 0.5 * (sin[1] * sin[1] - sin[0] * sin[0])]
        })
        .collect();
    let longitude = |column: usize| TAU * (column as f64 / width as f64 - 0.5);
    let columns: Vec<[f64; 2]> = (0..width)
        .map(|column| {
            let [(sin0, cos0), (sin1, cos1)] =
                [column, column + 1].map(|c| libm::sincos(longitude(c)));
            [cos0 - cos1, sin0 - sin1]
        })
        .collect();
    let wide = TAU / width as f64;
    let leaf = |at: usize| {
        let (x, y) = (at % LEAVES[0], at / LEAVES[0]);
        let [left, right] = [x, x + 1].map(|k| first_cell(k, width, LEAVES[0]));
        let [upper, lower] = [y, y + 1].map(|k| first_cell(k, height, LEAVES[1]));
        let (mut moments, mut powers) = ([DVec3::ZERO; 4], [0.0; 4]);
        for (row, [level, up]) in (upper..lower).zip(&rows[upper..lower]) {
            for (column, [east, north]) in (left..right).zip(&columns[left..right]) {
                let cell = row * width + column;
                let sum = DVec3::new(level * east, up * wide, level * north);
                let [r, g, b] = radiance.radiance(cell).to_array().map(f64::from);
                let above = radiance.above_mean(cell);
                let lights = [r, g, b, above];
                moments.iter_mut().zip(lights).for_each(|(m, light)| *m += sum * light);
                let solid_angle = radiance.solid_angle(cell);
                powers.iter_mut().zip(lights).for_each(|(p, light)| *p += light * solid_angle);
            }
        }
        let columns = [x, x + 1].map(|k| share(k, width, LEAVES[0]));
        let rows = [y, y + 1].map(|k| share(k, height, LEAVES[1]));
        let halves = std::array::from_fn(|k| half_height(moments[k], powers[k]));
        Patch { halves, ..patch(moments, columns, rows) }
    };
    (0..LEAVES[0] * LEAVES[1]).into_par_iter().map(leaf).collect()
}

/// The patch between two longitudes and two latitudes, as shares of the circle and of the way from the zenith down.
fn patch(moments: Moments, columns: [f64; 2], rows: [f64; 2]) -> Patch {
    let latitude = 0.5 * PI * (rows[0] + rows[1]);
    let (level, y) = libm::sincos(latitude);
    let (sin, cos) = libm::sincos(TAU * (0.5 * (columns[0] + columns[1]) - 0.5));
    // Along the meridian, then along the parallel.
    let angle = 0.5 * PI * (rows[1] - rows[0]) + PI * (columns[1] - columns[0]);
    let reach = if angle < 1.5 { libm::sin(angle) } else { 2.0 };
    Patch { moments, halves: [0.0; 4], axis: DVec3::new(level * sin, y, -level * cos), reach }
}

/// Half of the height of a small source with this vector sum and this sum of its light: that of an even bar which spreads
/// as far (by the variance, which shortens the vector sum).
fn half_height(moment: DVec3, power: f64) -> f64 {
    let short = 1.0 - moment.length() / power;
    if short > 0.0 { (3.0 * short).sqrt() } else { 0.0 }
}

/// The mean of the sines above the horizon over a source whose middle has the sine `sin`, and whose height is twice `half`.
fn risen(sin: f64, half: f64) -> f64 {
    if sin >= half {
        sin
    } else if sin <= -half {
        0.0
    } else {
        (sin + half) * (sin + half) / (4.0 * half)
    }
}

/// Takes the light of patches with much of it out of `leaves`.
fn take_bright(leaves: &mut [Patch]) -> Vec<BrightPatch> {
    let power = |patch: &Patch| {
        let [r, g, b, _] = patch.moments.map(DVec3::length);
        brightness(Rgb::new(r as f32, g as f32, b as f32))
    };
    let all: f64 = leaves.iter().map(power).sum();
    let mut bright: Vec<usize> =
        (0..leaves.len()).filter(|at| power(&leaves[*at]) > BRIGHT * all).collect();
    bright.sort_by(|a, b| power(&leaves[*b]).total_cmp(&power(&leaves[*a])));
    bright.truncate(MOST_BRIGHT);
    let take = |at: usize| {
        let moments = std::mem::replace(&mut leaves[at].moments, [DVec3::ZERO; 4]);
        let [r, g, b, _] = moments;
        let axis = (r + g + b).normalize_or_zero();
        let half = leaves[at].halves[..3].iter().fold(0.0, |most: f64, half| most.max(*half));
        BrightPatch { axis, power: moments.map(|m| m.length() as f32), half }
    };
    bright.into_iter().map(take).collect()
}

/// Patches in levels, the coarsest first; each has four of the next.
struct Tree(Vec<(usize, Vec<Patch>)>);

impl Tree {
    /// The tree over `leaves`, of so many `cells` each way.
    fn of(leaves: Vec<Patch>, cells: [usize; 2]) -> Self {
        let mut levels = vec![(LEAVES[0], leaves)];
        let [mut width, mut height] = LEAVES;
        while height > 1 {
            let (_, finer) = &levels[levels.len() - 1];
            let coarser = |at: usize| {
                let (x, y) = (at % (width / 2), at / (width / 2));
                let first = 2 * (y * width + x);
                let four =
                    [first, first + 1, first + width, first + width + 1].map(|k| finer[k].moments);
                let moments = std::array::from_fn(|k| four.iter().map(|moments| moments[k]).sum());
                let of = |k: usize, axis: usize, count: usize| {
                    share(k * LEAVES[axis] / count, cells[axis], LEAVES[axis])
                };
                let columns = [x, x + 1].map(|k| of(k, 0, width / 2));
                let rows = [y, y + 1].map(|k| of(k, 1, height / 2));
                patch(moments, columns, rows)
            };
            let coarse = (0..width / 2 * (height / 2)).map(coarser).collect();
            (width, height) = (width / 2, height / 2);
            levels.push((width, coarse));
        }
        levels.reverse();
        Self(levels)
    }

    /// Irradiance by the normals `n` and `-n`.
    fn irradiance_of_both(&self, n: DVec3) -> [Sums; 2] {
        let mut sums = [0.0; 4];
        let roots = &self.0[0].1;
        (0..roots.len()).for_each(|at| self.add(0, at, n, &mut sums));
        // What arrives at one side less what arrives at the other is the whole vector sum along the normal.
        let whole = |k: usize| roots.iter().map(|root| root.moments[k].dot(n)).sum::<f64>();
        [sums, std::array::from_fn(|k| sums[k] - whole(k))]
    }

    fn add(&self, level: usize, at: usize, n: DVec3, sums: &mut Sums) {
        let (width, patches) = &self.0[level];
        let Patch { moments, halves, axis, reach } = &patches[at];
        let height = axis.dot(n);
        if height <= -reach {
            return;
        }
        if height >= *reach {
            sums.iter_mut().zip(moments).for_each(|(sum, m)| *sum += m.dot(n));
            return;
        }
        if level + 1 == self.0.len() {
            for (sum, (m, half)) in sums.iter_mut().zip(moments.iter().zip(halves)) {
                let power = m.length();
                *sum += if power > 0.0 { power * risen(m.dot(n) / power, *half) } else { 0.0 };
            }
            return;
        }
        let (x, y) = (at % width, at / width);
        let first = 4 * y * width + 2 * x;
        for child in [first, first + 1, first + 2 * width, first + 2 * width + 1] {
            self.add(level + 1, child, n, sums);
        }
    }
}
