//! Drops what cannot be seen: triangles without area, and values that no triangle uses.

use crate::error::Diagnostic;
use crate::math::DVec3;
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Removes triangles that repeat a vertex or whose corners lie exactly on one line, and the
/// same entries of the parallel lists. Returns how many.
pub(super) fn drop_degenerate(
    positions: &[DVec3],
    triangles: &mut Vec<[u32; 3]>,
    parallel: &mut [&mut Option<Vec<[u32; 3]>>],
) -> usize {
    let bad = triangles.par_iter().filter(|t| is_degenerate(positions, **t)).count();
    if bad > 0 {
        let keep: Vec<bool> = triangles.par_iter().map(|t| !is_degenerate(positions, *t)).collect();
        for list in parallel.iter_mut().filter_map(|list| list.as_mut()) {
            retain(list, &keep);
        }
        retain(triangles, &keep);
    }
    bad
}

/// Keeps the entries for which `keep` holds.
pub(super) fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    list.retain(|_| *keep.next().unwrap_or(&true));
    list.shrink_to_fit();
}

fn is_degenerate(positions: &[DVec3], [a, b, c]: [u32; 3]) -> bool {
    if a == b || b == c || a == c {
        return true;
    }
    let [a, b, c] = [a, b, c].map(|i| positions[i as usize]);
    let (u, v) = (b - a, c - a);
    let cross = u.cross(v);
    if cross != DVec3::ZERO {
        return false;
    }
    // Tiny triangles: scaled up so that the products do not underflow.
    let size = u.abs().max(v.abs()).max_element();
    !(size > 0.0 && size < 1e-100 && (u / size).cross(v / size) != DVec3::ZERO)
}

/// The one warning about dropped triangles, if any.
pub(super) fn warning(file: &Path, dropped: usize) -> Option<Diagnostic> {
    let triangles = if dropped == 1 { "triangle" } else { "triangles" };
    let message = format!("{dropped} {triangles} without area dropped");
    (dropped > 0).then(|| Diagnostic::new(file, message))
}

/// The values that `triangles` use, in their old order, with `triangles` made to match.
///
/// `owned`: nobody else uses `values`; they are taken, without a copy where all are used.
/// `scratch` is memory to reuse between calls with shared values.
pub(super) fn compact<T: Copy + Send + Sync>(
    values: &mut Vec<T>,
    triangles: &mut [[u32; 3]],
    owned: bool,
    scratch: &mut Vec<u32>,
) -> Vec<T> {
    if owned {
        compact_owned(std::mem::take(values), triangles)
    } else {
        pick(values, triangles, scratch)
    }
}

/// As [`compact`], for values of one's own.
pub(super) fn compact_owned<T: Copy>(mut values: Vec<T>, triangles: &mut [[u32; 3]]) -> Vec<T> {
    if let Some(kept) = used(values.len(), triangles) {
        retain(&mut values, &kept);
        renumber(triangles, &kept);
    }
    values
}

/// Which of `count` values `triangles` use; `None`: all of them.
pub(super) fn used(count: usize, triangles: &[[u32; 3]]) -> Option<Vec<bool>> {
    let used: Vec<AtomicBool> = (0..count).map(|_| AtomicBool::new(false)).collect();
    triangles.par_iter().flatten_iter().for_each(|i| {
        // Reading first: shared cache lines stay shared.
        let flag = &used[*i as usize];
        if !flag.load(Relaxed) {
            flag.store(true, Relaxed);
        }
    });
    let used: Vec<bool> = used.into_iter().map(AtomicBool::into_inner).collect();
    (!used.iter().all(|used| *used)).then_some(used)
}

/// Makes indices match values of which only those `kept` are left.
pub(super) fn renumber(triangles: &mut [[u32; 3]], kept: &[bool]) {
    let mut next = 0u32;
    let mut new_index = Vec::with_capacity(kept.len());
    for kept in kept {
        new_index.push(next);
        next += u32::from(*kept);
    }
    triangles.par_iter_mut().for_each(|t| *t = t.map(|i| new_index[i as usize]));
}

/// Time and memory in proportion to the triangles, not to all values.
fn pick<T: Copy>(values: &[T], triangles: &mut [[u32; 3]], scratch: &mut Vec<u32>) -> Vec<T> {
    const UNSEEN: u32 = u32::MAX;
    if scratch.len() < values.len() {
        scratch.resize(values.len(), UNSEEN);
    }
    let mut used = Vec::new();
    for i in triangles.iter().flatten() {
        if std::mem::replace(&mut scratch[*i as usize], 0) == UNSEEN {
            used.push(*i);
        }
    }
    used.sort_unstable();
    for (new, old) in used.iter().enumerate() {
        scratch[*old as usize] = new as u32;
    }
    triangles.iter_mut().for_each(|t| *t = t.map(|i| scratch[i as usize]));
    let picked = used.iter().map(|i| values[*i as usize]).collect();
    used.iter().for_each(|i| scratch[*i as usize] = UNSEEN);
    picked
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_to_compact_agree() {
        let values: Vec<u32> = (0..9).map(|i| 10 * i).collect();
        let triangles = vec![[8, 2, 3], [3, 2, 5]];
        let expected = (vec![20, 30, 50, 80], vec![[3, 0, 1], [1, 0, 2]]);
        let mut scratch = Vec::new();
        for owned in [false, false, true] {
            let (mut values, mut triangles) = (values.clone(), triangles.clone());
            let picked = compact(&mut values, &mut triangles, owned, &mut scratch);
            assert_eq!((picked, triangles), expected);
        }
    }

    #[test]
    fn only_triangles_without_area_are_dropped() {
        let p = [0.0, 1.0, 2.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let needle = DVec3::new(1.0, 1e-8, 0.0);
        let tiny = [DVec3::ZERO, DVec3::X * 1e-180, DVec3::Y * 1e-180];
        let positions = [p[0], p[1], p[2], needle, tiny[0], tiny[1], tiny[2]];
        let mut triangles = vec![[0, 1, 2], [0, 3, 2], [0, 0, 3], [4, 5, 6], [0, 4, 3]];
        let mut uvs = Some(triangles.clone());
        let dropped = drop_degenerate(&positions, &mut triangles, &mut [&mut uvs]);
        assert_eq!((dropped, &triangles), (3, &vec![[0, 3, 2], [4, 5, 6]]));
        assert_eq!(uvs, Some(triangles));
    }
}
