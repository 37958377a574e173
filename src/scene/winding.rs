//! Which way round the faces of a closed mesh are wound.

use super::weld::weld_here;
use crate::math::DVec3;
use std::collections::HashMap;

/// Which `triangles` must be reversed so that neighbours agree on what is outside: of each
/// connected part the lesser share by area. `None` where that is no question with an answer: an
/// edge has not exactly two triangles, or the part is one-sided.
pub(super) fn strays(positions: &[DVec3], triangles: &[[u32; 3]]) -> Option<Vec<bool>> {
    let welded = welded(positions, triangles);
    let mut edges: HashMap<(u32, u32), Vec<(u32, bool)>> = HashMap::new();
    for (index, t) in welded.iter().enumerate().filter(|(_, t)| is_solid(t)) {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            edges.entry((a.min(b), a.max(b))).or_default().push((index as u32, a < b));
        }
    }
    if edges.values().any(|sides| sides.len() != 2) {
        return None;
    }
    let mut reversed: Vec<Option<bool>> = vec![None; triangles.len()];
    for start in 0..triangles.len() {
        if reversed[start].is_none() && is_solid(&welded[start]) {
            orient_part(positions, triangles, &welded, &edges, &mut reversed, start)?;
        }
    }
    Some(reversed.into_iter().map(|r| r == Some(true)).collect())
}

/// Orients the part that `start` belongs to.
fn orient_part(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    welded: &[[u32; 3]],
    edges: &HashMap<(u32, u32), Vec<(u32, bool)>>,
    reversed: &mut [Option<bool>],
    start: usize,
) -> Option<()> {
    let mut part = vec![start];
    let mut areas = [0.0; 2];
    reversed[start] = Some(false);
    let mut next = 0;
    while let Some(&index) = part.get(next) {
        next += 1;
        let own = reversed[index] == Some(true);
        let [a, b, c] = triangles[index].map(|i| positions[i as usize]);
        areas[usize::from(own)] += (b - a).cross(c - a).length();
        let t = welded[index];
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let sides = &edges[&(a.min(b), a.max(b))];
            let other = sides.iter().find(|(side, _)| *side as usize != index)?;
            // Neighbours that agree run along their edge in opposite directions.
            let wanted = own ^ (other.1 == (a < b));
            match reversed[other.0 as usize] {
                None => {
                    reversed[other.0 as usize] = Some(wanted);
                    part.push(other.0 as usize);
                }
                Some(found) if found != wanted => return None,
                Some(_) => {}
            }
        }
    }
    if areas[1] > areas[0] {
        part.iter().for_each(|i| reversed[*i] = reversed[*i].map(|r| !r));
    }
    Some(())
}

/// Whether a triangle of welded vertices has three of them: rounding may have made it a line.
fn is_solid(t: &[u32; 3]) -> bool {
    t[0] != t[1] && t[1] != t[2] && t[2] != t[0]
}

/// `triangles` with the first vertex at each place in the stead of all others there.
fn welded(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    match weld_here(positions) {
        Some(first) => triangles.iter().map(|t| t.map(|i| first[i as usize])).collect(),
        None => triangles.to_vec(),
    }
}

/// A volume below this share of (area x extent) is rounding: the faces lie on one another and enclose nothing.
pub(crate) const NO_VOLUME: f64 = 1e-9;

/// Six times the signed volume of a closed mesh: positive when its faces wind counter-clockwise
/// seen from outside; `None` when an edge has not exactly one partner that runs the other way, or the faces enclose nothing.
/// Stays on this thread, since verify asks for it under a lock.
pub(crate) fn closed_volume(positions: &[DVec3], triangles: &[[u32; 3]]) -> Option<f64> {
    let mut edges = HashMap::with_capacity(triangles.len() * 3);
    for t in welded(positions, triangles) {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if a != b {
                *edges.entry((a.min(b), a.max(b))).or_insert(0i64) += if a < b { 1 } else { -1 };
            }
        }
    }
    if triangles.is_empty() || edges.values().any(|balance| *balance != 0) {
        return None;
    }
    let origin = positions[triangles[0][0] as usize];
    let (mut volume, mut most) = (0.0, 0.0);
    for t in triangles {
        let [a, b, c] = t.map(|i| positions[i as usize] - origin);
        let normal = (b - a).cross(c - a);
        volume += a.dot(normal);
        most += a.length() * normal.length();
    }
    (f64::abs(volume) > NO_VOLUME * most).then_some(volume)
}

/// Of each triangle, which edges (bit 0 the first, from corner 0 to 1) no other triangle has: where the
/// surface ends.
pub(crate) fn borders(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let welded = welded(positions, triangles);
    let edges_of = |t: &[u32; 3]| {
        [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].map(|(a, b)| (a.min(b), a.max(b)))
    };
    let mut uses = HashMap::with_capacity(triangles.len() * 3);
    for edge in welded.iter().filter(|t| is_solid(t)).flat_map(edges_of) {
        *uses.entry(edge).or_insert(0u32) += 1;
    }
    let bits = |t: &[u32; 3]| match is_solid(t) {
        true => {
            let alone = edges_of(t).map(|edge| u8::from(uses[&edge] == 1));
            alone[0] | alone[1] << 1 | alone[2] << 2
        }
        false => 0,
    };
    welded.iter().map(bits).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    fn corners() -> Vec<DVec3> {
        vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]
    }

    #[test]
    fn the_stray_face_is_found() {
        assert_eq!(strays(&corners(), &TETRAHEDRON), Some(vec![false; 4]));
        for stray in 0..4 {
            let mut triangles = TETRAHEDRON;
            triangles[stray].swap(0, 1);
            // The slanted face has the most area of one, not of all.
            let expected: Vec<bool> = (0..4).map(|i| i == stray).collect();
            assert_eq!(strays(&corners(), &triangles), Some(expected), "{stray}");
        }
    }

    #[test]
    fn an_open_mesh_has_no_answer() {
        assert_eq!(strays(&corners(), &TETRAHEDRON[..3]), None);
    }

    #[test]
    fn borders_are_the_edges_of_one_triangle() {
        assert_eq!(borders(&corners(), &TETRAHEDRON), [0; 4]);
        // Without the last face its edges 2-0, 0-3 and 3-2 are left to one triangle each.
        assert_eq!(borders(&corners(), &TETRAHEDRON[..3]), [1, 4, 2]);
        let with_a_line: Vec<[u32; 3]> = TETRAHEDRON.into_iter().chain([[0, 0, 1]]).collect();
        assert_eq!(borders(&corners(), &with_a_line), [0; 5]);
        let open = [&TETRAHEDRON[..3], &[[2, 2, 3]]].concat();
        assert_eq!(borders(&corners(), &open), [1, 4, 2, 0]);
    }

    #[test]
    fn what_encloses_nothing_is_not_closed() {
        let positions = corners().into_iter().map(|p| DVec3::new(p.x, p.y, 0.3 * p.x + 0.7 * p.y));
        let positions: Vec<DVec3> = positions.collect();
        assert_eq!(closed_volume(&positions, &[[0, 1, 2], [1, 0, 2]]), None);
    }

    #[test]
    fn twins_close_a_mesh() {
        // Each face has corners of its own, and what is zero there is -0 in every other face.
        let mut positions = Vec::new();
        for (face, t) in TETRAHEDRON.iter().enumerate() {
            let own = t.map(|i| corners()[i as usize]);
            positions.extend(if face % 2 == 0 { own } else { own.map(|p| -(DVec3::ZERO - p)) });
        }
        let mut triangles: Vec<[u32; 3]> = (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        assert_eq!(closed_volume(&positions, &triangles), Some(1.0));
        triangles[2].swap(0, 1);
        assert_eq!(closed_volume(&positions, &triangles), None);
        assert_eq!(strays(&positions, &triangles), Some(vec![false, false, true, false]));
    }

    /// A worker that waits takes up other work of its pool.
    #[test]
    fn computing_the_volume_starts_no_other_task_of_the_pool() {
        let positions: Vec<DVec3> = (0..3000).map(|i| DVec3::splat(f64::from(i % 7))).collect();
        let busy: Vec<AtomicBool> = (0..8).map(|_| AtomicBool::new(false)).collect();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(busy.len()).build().unwrap();
        let job = |_: &rayon::Scope| {
            let mine = &busy[rayon::current_thread_index().unwrap()];
            assert!(!mine.swap(true, Ordering::Relaxed), "taken up while another waits");
            closed_volume(&positions, &[[0, 1, 2]]);
            mine.store(false, Ordering::Relaxed);
        };
        pool.scope(|scope| (0..1000).for_each(|_| scope.spawn(job)));
    }
}
