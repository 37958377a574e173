//! References that somebody supplies: frames of an earlier job of the same scene.

use crate::math::DVec3;
use crate::reuse::Reference;
use crate::scene::Camera;

/// How many of those that know much a frame asks, and how many of the others.
const DENSE: usize = 2;
const OTHERS: usize = 6;

/// A frame's `own` references, and behind them those of `supplied` that it is inferred from too. With
/// any of these, references that know much come before those that do not: the first two are always
/// asked, and key frames that were inferred themselves know little.
pub(super) fn with_supplied<'r>(
    own: Vec<&'r Reference>,
    supplied: &'r [Reference],
    camera: &Camera,
) -> Vec<&'r Reference> {
    if supplied.is_empty() {
        return own;
    }
    let mut all = own;
    all.extend(nearest(supplied, camera));
    let most = all.iter().map(|r| r.len()).max().unwrap_or(0);
    all.sort_by_key(|r| 2 * r.len() < most);
    all
}

/// Those of `supplied` that a frame seen by `camera` (scene space) is inferred from: a function of
/// these alone. Frames in between know only what they discovered, so the nearest ones alone would
/// know little: the two nearest of those with at least half as many samples as the one with most come
/// first, then the nearest of the others.
fn nearest<'r>(supplied: &'r [Reference], camera: &Camera) -> Vec<&'r Reference> {
    let most = supplied.iter().map(Reference::len).max().unwrap_or(0);
    let farthest = supplied.iter().map(|r| r.eye().distance(camera.eye)).fold(0.0, f64::max);
    let apart = |r: &Reference| {
        let eyes = r.eye().distance(camera.eye) / farthest.max(f64::MIN_POSITIVE);
        let turn: DVec3 = r.forward() - camera.forward;
        eyes + 0.5 * turn.length()
    };
    let mut all: Vec<(f64, &Reference)> = supplied.iter().map(|r| (apart(r), r)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (dense, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, r)| 2 * r.len() >= most);
    let rest = dense.iter().skip(DENSE).chain(&others);
    let mut rest: Vec<_> = rest.copied().collect();
    rest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = dense.into_iter().take(DENSE).chain(rest.into_iter().take(OTHERS));
    chosen.map(|(_, r)| r).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::{SurfacePoint, TracedPoint, TracedPoints};
    use crate::math::Vec3;
    use crate::scene::Pose;

    fn camera(x: f64) -> Camera {
        let eye = DVec3::new(x, 0.0, 0.0);
        let pose = Pose { eye, target: eye - DVec3::Z, up: DVec3::Y, roll_degrees: 0.0 };
        Camera::new(&pose, 40.0, 64, 64).expect("a camera")
    }

    fn reference(x: f64, points: u32) -> Reference {
        let point = SurfacePoint {
            p: -DVec3::Z,
            n: Vec3::Z,
            geom_id: 0,
            footprint: 0.01,
            cos: 1.0,
            direct: true,
            samples: 1,
        };
        let points = (0..points).map(|i| TracedPoint { x: i % 64, y: i / 64, point }).collect();
        let traced = TracedPoints { ratios: vec![1.0; 4096], points };
        Reference::new(Reference::SUPPLIED, &camera(x), &traced, 1)
    }

    #[test]
    fn what_knows_much_is_asked_first_and_nothing_changes_without_a_supply() {
        let own = [reference(0.0, 3), reference(1.0, 900), reference(2.0, 4)];
        let places = |supplied: &[Reference]| -> Vec<f64> {
            let all = with_supplied(own.iter().collect(), supplied, &camera(0.0));
            all.iter().map(|r| r.eye().x).collect()
        };
        assert_eq!(places(&[]), [0.0, 1.0, 2.0]);
        let supplied = [reference(5.0, 6), reference(7.0, 1000)];
        assert_eq!(places(&supplied), [1.0, 7.0, 0.0, 2.0, 5.0]);
    }

    #[test]
    fn two_that_know_much_come_before_the_nearest_of_the_others() {
        let mut all: Vec<Reference> = (0..20).map(|i| reference(f64::from(i), 5)).collect();
        all.extend([0.5, 9.0, 19.5].map(|x| reference(x, 1000)));
        let places =
            |x| -> Vec<f64> { nearest(&all, &camera(x)).iter().map(|r| r.eye().x).collect() };
        assert_eq!(places(18.9), [19.5, 9.0, 19.0, 18.0, 17.0, 16.0, 15.0, 14.0]);
        assert_eq!(places(0.4)[..3], [0.5, 9.0, 0.0]);
        assert!(nearest(&[], &camera(0.0)).is_empty());
    }
}
