//! Samples found by position: a hash grid whose cells are as wide as the distance between samples.

use crate::inference::SurfacePoint;
use crate::math::DVec3;
use crate::sampling::mix;
use std::ops::Range;

/// Number of cells of a level that a query looks at: those whose middles surround the point.
pub(super) const CELLS: usize = 8;

/// A cell: hash of its level of size, mesh and position.
type Key = u64;

/// Finds samples by position: has for each cell the range of its samples, which are stored sorted by cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Index {
    /// Hash table with open addressing: cell, first sample, one past the last sample.
    table: Vec<(Key, u32, u32)>,
    /// Bloom filter of the cells' keys, eight bits for each slot of the table.
    present: Vec<u64>,
}

/// The cells of one level around a point.
pub(super) struct Cells {
    /// Edge of the cells, scene units.
    pub edge: f64,
    keys: [Key; CELLS],
}

impl Cells {
    /// The eight cells of `level` around the point `p` (scene space) of mesh `geom_id`.
    pub fn around(level: i32, geom_id: u32, p: DVec3) -> Self {
        let edge = edge_of(level);
        let [x, y, z] = cell_of(p - DVec3::splat(0.5 * edge), edge);
        // As `key_of` says, what they share mixed once.
        let all = key_of_level(level, geom_id);
        let columns = [x, x.wrapping_add(1)].map(|x| further(all, x));
        let rows = [y, y.wrapping_add(1)].map(|y| columns.map(|key| further(key, y)));
        let layers = [z, z.wrapping_add(1)].map(|z| rows.map(|row| row.map(|key| further(key, z))));
        let keys = std::array::from_fn(|k| layers[k >> 2][k >> 1 & 1][k & 1]);
        Self { edge, keys }
    }
}

impl Index {
    /// Indexes the points whose numbers are `members`. Also returns these numbers sorted by cell, the order in
    /// which the samples must be stored, from number `first` on.
    pub fn new(points: &[SurfacePoint], members: &[u32], first: u32) -> (Self, Vec<u32>) {
        if members.is_empty() {
            return Default::default();
        }
        let key = |i: &u32| {
            let point = &points[*i as usize];
            let level = level_of(point.footprint);
            key_of(level, point.geom_id, cell_of(point.p, edge_of(level)))
        };
        let mut keyed: Vec<(Key, u32)> = members.iter().map(|i| (key(i), *i)).collect();
        keyed.sort_unstable();
        let runs = || keyed.chunk_by(|a, b| a.0 == b.0);
        let cells = runs().count();
        let mut table = vec![(0, 0, 0); (2 * cells).next_power_of_two()];
        let mut present = vec![0; table.len().div_ceil(8)];
        let mut first = first;
        for run in runs() {
            let mut at = run[0].0 as usize & (table.len() - 1);
            while table[at].2 != 0 {
                at = (at + 1) & (table.len() - 1);
            }
            table[at] = (run[0].0, first, first + run.len() as u32);
            first += run.len() as u32;
            let bit = bit_of(run[0].0, &present);
            present[bit / 64] |= 1 << (bit % 64);
        }
        (Self { table, present }, keyed.into_iter().map(|(_, i)| i).collect())
    }

    /// The samples in `cells`.
    pub fn members<'i>(&'i self, cells: &'i Cells) -> impl Iterator<Item = u32> + 'i {
        let keys = cells.keys.iter().filter(|key| self.may_hold(**key));
        keys.flat_map(|key| self.cell(*key))
    }

    /// Whether the index may hold the cell, by the Bloom filter. It stays in the processor's cache, which is
    /// fast for the many cells that are empty.
    fn may_hold(&self, key: Key) -> bool {
        let bit = bit_of(key, &self.present);
        self.present.get(bit / 64).is_some_and(|word| word >> (bit % 64) & 1 == 1)
    }

    fn cell(&self, key: Key) -> Range<u32> {
        let mut at = key as usize & (self.table.len() - 1);
        while self.table[at].2 != 0 {
            let (there, first, end) = self.table[at];
            if there == key {
                return first..end;
            }
            at = (at + 1) & (self.table.len() - 1);
        }
        0..0
    }

    /// Memory that the index takes, bytes.
    pub fn memory(&self) -> u64 {
        (size_of_val(&self.table[..]) + size_of_val(&self.present[..])) as u64
    }
}

/// The bit of a cell among those of `present`, whose length is a power of two, or 0.
fn bit_of(key: Key, present: &[u64]) -> usize {
    (key >> 32) as usize & (64 * present.len()).wrapping_sub(1)
}

/// The level whose cells are at least one footprint wide, and less than two.
pub(super) fn level_of(footprint: f32) -> i32 {
    // The exponent bits: what log2 would give, the same on every machine.
    let bits = footprint.max(f32::MIN_POSITIVE).to_bits();
    (bits >> 23) as i32 - 127 + i32::from(bits & 0x7f_ffff != 0)
}

/// Edge of the cells of a level, scene units.
pub(super) fn edge_of(level: i32) -> f64 {
    f64::from_bits(((level + 1023) as u64) << 52)
}

pub(super) fn cell_of(p: DVec3, edge: f64) -> [i64; 3] {
    (p / edge).to_array().map(|c| {
        // Towards zero, then down: without SSE 4.1 `floor` is a call.
        let towards_zero = c as i64;
        towards_zero.saturating_sub(i64::from(c < towards_zero as f64))
    })
}

pub(super) fn key_of(level: i32, geom_id: u32, cell: [i64; 3]) -> Key {
    cell.into_iter().fold(key_of_level(level, geom_id), further)
}

fn key_of_level(level: i32, geom_id: u32) -> Key {
    mix(u64::from(geom_id) << 32 | u64::from(level as u32 & 0xffff))
}

fn further(key: Key, coordinate: i64) -> Key {
    mix(key ^ coordinate as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    fn point(p: Vec3) -> SurfacePoint {
        SurfacePoint {
            p: p.as_dvec3(),
            n: Vec3::Y,
            geom_id: 3,
            samples: 1,
            footprint: 0.12,
            cos: 1.0,
            direct: true,
        }
    }

    #[test]
    fn a_level_is_as_wide_as_its_footprints() {
        for footprint in [1e-9f32, 0.3, 0.5, 0.500_01, 1.0, 1.7, 1e9] {
            let edge = edge_of(level_of(footprint));
            assert!(edge >= f64::from(footprint) && edge < 2.0 * f64::from(footprint));
        }
    }

    #[test]
    fn everything_within_half_a_cell_is_found_and_nothing_of_another_mesh() {
        let place = |i: usize| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32);
        let points: Vec<SurfacePoint> =
            (0..1000).map(|i| point(place(i) * 0.1 - Vec3::splat(0.45))).collect();
        let all: Vec<u32> = (0..1000).collect();
        let (index, sorted) = Index::new(&points, &all, 7);
        let level = level_of(0.12);
        for p in [DVec3::ZERO, DVec3::new(0.11, -0.32, 0.4), DVec3::splat(-0.449)] {
            let found_in = |level, mesh| -> Vec<u32> {
                let cells = Cells::around(level, mesh, p);
                let members = index.members(&cells);
                members.map(|sample| sorted[sample as usize - 7]).collect()
            };
            let mut found = found_in(level, 3);
            let reach = 0.5 * edge_of(level);
            for (i, s) in points.iter().enumerate() {
                let near = (s.p - p).abs().max_element() <= reach;
                assert!(!near || found.contains(&(i as u32)), "{p} misses {i}");
            }
            found.sort_unstable();
            found.dedup();
            assert!(found.len() < 64 * 2, "{}", found.len());
            assert!(found_in(level, 4).is_empty(), "another mesh");
            assert!(found_in(level + 1, 3).is_empty(), "another level");
        }
    }
}
