//! Each rule refuses what it is for, and it alone does: with the rule relaxed the answer is there.

use super::{Evidence, Lookup};
use crate::inference::{Inference, Origin, Questions, SurfacePoint, TracedPoint, TracedPoints};
use crate::math::{DVec3, Vec3};
use crate::reuse::Reference;
use crate::scene::{Camera, Pose};

const EDGE: u32 = 64;
const RAYS: u32 = 100;

fn camera() -> Camera {
    let (eye, up) = (DVec3::ZERO, DVec3::Y);
    let pose = Pose { eye, target: -DVec3::Z, up, roll_degrees: 0.0 };
    Camera::new(&pose, 40.0, EDGE, EDGE).expect("a camera")
}

/// The point of the wall z = -1 that is seen at an image point, pixels.
fn on_wall(x: f64, y: f64) -> SurfacePoint {
    let camera = camera();
    let dir = camera.direction(x, y);
    SurfacePoint {
        p: dir / -dir.z,
        n: Vec3::Z,
        geom_id: 0,
        footprint: camera.pixel_size() as f32,
        cos: 1.0,
        direct: true,
        samples: 1,
    }
}

/// The wall traced where `ratio` (of a column) is a number.
fn wall(ratio: impl Fn(u32) -> f32) -> Reference {
    let mut traced = TracedPoints::default();
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        if !ratio(x).is_nan() {
            let point = on_wall(f64::from(x) + 0.5, f64::from(y) + 0.5);
            traced.points.push(TracedPoint { x, y, point });
            traced.ratios.push(ratio(x));
        }
    }
    Reference::new(1, &camera(), &traced, 1)
}

/// What `evidence` lets `reference` tell about `point`, which would show 1 without shadows.
fn told(reference: &Reference, point: SurfacePoint, evidence: Evidence) -> f32 {
    let lookup = Lookup { frame: 2, references: &[reference], rays: &[RAYS], evidence };
    let mut asked = Questions {
        points: vec![point],
        unshadowed: vec![1.0],
        ratios: vec![f32::NAN],
        origins: vec![Origin::default()],
    };
    lookup.infer(&mut asked);
    asked.ratios[0]
}

/// Refused by default, told once `relaxed`.
fn refused(reference: &Reference, point: SurfacePoint, relaxed: impl Fn(&mut Evidence)) {
    assert!(told(reference, point, Evidence::default()).is_nan(), "{point:?}");
    let mut evidence = Evidence::default();
    relaxed(&mut evidence);
    assert!(!told(reference, point, evidence).is_nan(), "another rule refuses {point:?}");
}

fn lifted(footprints: f64) -> SurfacePoint {
    let point = on_wall(30.2, 31.7);
    let towards_eye = -point.p.normalize();
    SurfacePoint { p: point.p + towards_eye * (footprints * camera().pixel_size()), ..point }
}

#[test]
fn what_lies_on_the_surface_is_told_exactly() {
    let reference = wall(|_| 0.25);
    for point in [on_wall(30.5, 20.5), on_wall(11.13, 47.9), on_wall(0.2, 0.1), lifted(0.5)] {
        assert_eq!(told(&reference, point, Evidence::default()), 0.25);
    }
}

#[test]
fn a_file_may_hold_normals_a_little_longer_than_1() {
    let mut traced = TracedPoints::default();
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let point = on_wall(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let point = SurfacePoint { n: point.n * 1.0009, samples: u32::MAX / 2, ..point };
        // Three of a pixel: more camera samples than can be counted.
        traced.points.extend([TracedPoint { x, y, point }; 3]);
        traced.ratios.extend([0.25; 3]);
    }
    let reference = Reference::new(1, &camera(), &traced, 1);
    assert_eq!(told(&reference, on_wall(30.2, 31.7), Evidence::default()), 0.25);
}

#[test]
fn what_is_seen_in_mirrors_is_told_by_place_by_all_that_know() {
    let ratio = |x: u32, y: u32| if y % 2 == 1 { f32::NAN } else { 0.25 + 0.5 * (x % 2) as f32 };
    let mut traced = TracedPoints::default();
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let point = on_wall(f64::from(x) + 0.5, f64::from(y) + 0.5);
        traced.points.push(TracedPoint { x, y, point: SurfacePoint { direct: false, ..point } });
        traced.ratios.push(ratio(x, y));
    }
    let reference = Reference::new(1, &camera(), &traced, 1);
    let asked =
        |point| told(&reference, point, Evidence { tolerance: 255.0, ..Evidence::default() });
    let mirrored = SurfacePoint { direct: false, ..on_wall(30.1, 31.2) };
    let mean = asked(mirrored);
    assert!((0.4..0.6).contains(&mean), "{mean}");
    // No pixel's own sample, so only by place.
    assert!(asked(SurfacePoint { direct: true, ..mirrored }).is_nan());
    assert!(asked(SurfacePoint { geom_id: 1, ..mirrored }).is_nan());
    assert!(asked(SurfacePoint { n: Vec3::X, ..mirrored }).is_nan());
}

#[test]
fn another_mesh_tells_nothing() {
    let point = SurfacePoint { geom_id: 1, ..on_wall(30.2, 31.7) };
    assert!(told(&wall(|_| 1.0), point, Evidence::default()).is_nan());
}

#[test]
fn a_normal_turned_away_is_refused() {
    let turned = |degrees: f32| SurfacePoint {
        n: Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()),
        ..on_wall(30.2, 31.7)
    };
    let reference = wall(|_| 1.0);
    assert_eq!(told(&reference, turned(20.0), Evidence::default()), 1.0);
    refused(&reference, turned(45.0), |e| e.least_cos = 0.0);
}

#[test]
fn what_stands_off_the_surface_is_refused() {
    let reference = wall(|_| 1.0);
    refused(&reference, lifted(1.4), |e| e.height = 1.5);
    refused(&reference, lifted(1.4), |e| e.slope = 1.0);
    refused(&reference, lifted(-1.8), |e| e.height = 2.0);
}

#[test]
fn a_coarser_sampling_is_refused() {
    let finer = |by: f32| {
        let point = on_wall(30.2, 31.7);
        SurfacePoint { footprint: point.footprint / by, ..point }
    };
    let reference = wall(|_| 1.0);
    assert_eq!(told(&reference, finer(2.0), Evidence::default()), 1.0);
    refused(&reference, finer(3.0), |e| e.coarser = 10.0);
}

#[test]
fn samples_that_disagree_are_refused_at_the_edge_and_nowhere_else() {
    let reference = wall(|x| if x < 32 { 1.0 } else { 0.0 });
    assert_eq!(told(&reference, on_wall(30.5, 20.0), Evidence::default()), 1.0);
    assert_eq!(told(&reference, on_wall(33.5, 20.0), Evidence::default()), 0.0);
    refused(&reference, on_wall(32.0, 20.0), |e| e.tolerance = 255.0);
}

#[test]
fn a_steady_change_is_told_and_a_kink_is_not() {
    let point = on_wall(31.3, 20.2);
    let steady = wall(|x| (0.5 + 0.2 * (x as f32 + 0.5 - 31.3)).clamp(0.0, 1.0));
    let ratio = told(&steady, point, Evidence::default());
    assert!((ratio - 0.5).abs() < 1e-4, "{ratio}");
    let no_plane = Evidence { plane_leverage: 0.0, ..Evidence::default() };
    assert!(told(&steady, point, no_plane).is_nan());
    // The four samples about the point lie on a plane too, those beside them do not.
    let step = wall(|x| if x < 32 { 0.5 } else { 0.9 });
    refused(&step, on_wall(32.0, 20.0), |e| e.change_noise = 100.0);
}

#[test]
fn samples_to_one_side_tell_only_what_does_not_change_on_the_way() {
    // Nothing is known from column 32 on.
    let known = |ratio: fn(u32) -> f32| wall(move |x| if x < 32 { ratio(x) } else { f32::NAN });
    let beside = on_wall(32.2, 20.5);
    assert_eq!(told(&known(|_| 1.0), beside, Evidence::default()), 1.0);
    assert_eq!(told(&known(|_| 0.5), beside, Evidence::default()), 0.5);
    let steep = known(|x| 0.1 + 0.2 * (31 - x.min(31)).min(4) as f32);
    refused(&steep, beside, |e| e.change_noise = 100.0);
    // All that is asked sees the whole light, but a shadow is one sample further.
    let rim = known(|x| if x < 31 { 0.0 } else { 1.0 });
    refused(&rim, beside, |e| e.change = 1000.0);
    assert_eq!(told(&rim, on_wall(31.5, 20.5), Evidence::default()), 1.0);
}
