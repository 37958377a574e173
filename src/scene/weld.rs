//! Vertices at exactly the same place are one corner, however often a file lists them.

use crate::math::DVec3;
use rayon::prelude::*;

const EMPTY: u64 = u64::MAX;

/// For each position the first index with the same coordinates (−0 equals 0), or `None` when
/// all positions differ. Linear; 16 bytes a position while it runs.
pub(crate) fn weld(positions: &[DVec3]) -> Option<Vec<u32>> {
    // Each shard owns the positions whose hash falls to its number, so none waits.
    let shards = rayon::current_num_threads().next_power_of_two() as u64;
    let twins: Vec<(u32, u32)> = (0..shards)
        .into_par_iter()
        .flat_map_iter(|shard| twins(positions, shard, shards))
        .collect();
    firsts(positions.len(), &twins)
}

/// [`weld`] without leaving this thread, for callers that may hold a lock: a worker that waits for
/// others takes up whatever work its pool has, and that could want the same lock.
pub(super) fn weld_here(positions: &[DVec3]) -> Option<Vec<u32>> {
    firsts(positions.len(), &twins(positions, 0, 1))
}

/// The result of [`weld`] for `count` positions of which `twins` are pairs of equal ones.
fn firsts(count: usize, twins: &[(u32, u32)]) -> Option<Vec<u32>> {
    if twins.is_empty() {
        return None;
    }
    let mut first: Vec<u32> = (0..count as u32).collect();
    twins.iter().for_each(|(index, twin)| first[*index as usize] = *twin);
    Some(first)
}

/// Pairs (index, lower index at the same place) of one shard.
fn twins(positions: &[DVec3], shard: u64, shards: u64) -> Vec<(u32, u32)> {
    let slots = (2 * positions.len() / shards as usize + 16).next_power_of_two();
    // A slot holds an index and 32 bits of its hash: few comparisons touch another position.
    let mut table = vec![EMPTY; slots];
    let mut used = 0;
    let mut twins = Vec::new();
    for (index, p) in positions.iter().enumerate() {
        let hash = hash(*p);
        if hash % shards != shard {
            continue;
        }
        if 4 * used > 3 * table.len() {
            table = grown(&table, positions);
        }
        match find(&table, positions, *p, hash) {
            Ok(twin) => twins.push((index as u32, twin)),
            Err(slot) => {
                table[slot] = hash & !0xffff_ffff | index as u64;
                used += 1;
            }
        }
    }
    twins
}

/// The index at `p`'s place, or the slot where it belongs.
#[inline]
fn find(table: &[u64], positions: &[DVec3], p: DVec3, hash: u64) -> Result<u32, usize> {
    let mask = table.len() - 1;
    let mut slot = (hash >> 8) as usize & mask;
    loop {
        let entry = table[slot];
        if entry == EMPTY {
            return Err(slot);
        }
        if (entry ^ hash) >> 32 == 0 && positions[entry as u32 as usize] == p {
            return Ok(entry as u32);
        }
        slot = (slot + 1) & mask;
    }
}

fn grown(table: &[u64], positions: &[DVec3]) -> Vec<u64> {
    let mut larger = vec![EMPTY; 2 * table.len()];
    for entry in table.iter().filter(|e| **e != EMPTY) {
        let p = positions[*entry as u32 as usize];
        if let Err(slot) = find(&larger, positions, p, hash(p)) {
            larger[slot] = *entry;
        }
    }
    larger
}

/// Mixes the bits of the coordinates (the finaliser of MurmurHash3, Appleby).
#[inline]
fn hash(p: DVec3) -> u64 {
    let mix = |mut h: u64| {
        h = (h ^ (h >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
        h = (h ^ (h >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        h ^ (h >> 33)
    };
    // Adding zero turns −0 into 0.
    let [x, y, z] = (p + DVec3::ZERO).to_array().map(f64::to_bits);
    mix(mix(mix(x).wrapping_add(y)).wrapping_add(z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_every_twin_and_only_twins() {
        let point = |i: u32| DVec3::new(f64::from(i % 7), f64::from(i % 11) * 1e-300, -0.0);
        let mut positions: Vec<DVec3> = (0..77).map(point).collect();
        assert_eq!((weld(&positions), weld_here(&positions)), (None, None));
        positions.extend((0..1000).map(|i| point(i) * DVec3::new(1.0, 1.0, -1.0)));
        let first = weld(&positions).expect("twins");
        for (i, p) in positions.iter().enumerate() {
            let expected = positions.iter().position(|q| q == p).expect("itself");
            assert_eq!(first[i] as usize, expected);
        }
        assert_eq!(weld_here(&positions), Some(first));
    }
}
