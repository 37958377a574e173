//! Samples of other surfaces are not used, and uncertain estimates have a high risk.

use super::{Judged, Lookup, LookupChannel};
use crate::film::Provenance;
use crate::inference::{Estimate, Inference, LookupBatch, SurfacePoint, TracedPoint, TracedPoints};
use crate::math::{DVec3, Vec3};
use crate::reuse::Reference;
use crate::reuse::evidence::{Evidence, Finding};
use crate::reuse::risk::{LEVELS, STEPS, is_part, of_lights};
use crate::scene::{Camera, Pose};

const EDGE: u32 = 64;
/// A light of one colour.
const LIGHT: LookupChannel = LookupChannel { rays: 16, is_first: true };

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

/// The estimate from `reference` for `point`, whose light has the radiance 1 without shadows.
fn estimated(reference: &Reference, point: SurfacePoint) -> Estimate {
    estimated_by(true, reference, point)
}

/// The same where points that are not seen directly may be left out.
fn estimated_by(specular: bool, reference: &Reference, point: SurfacePoint) -> Estimate {
    let lookup = Lookup { frame: 2, references: &[reference], channels: &[LIGHT], specular };
    let mut asked = LookupBatch {
        points: vec![point],
        pixels: vec![[0; 2]],
        unshadowed: vec![1.0],
        ratios: vec![f32::NAN],
        estimates: Vec::new(),
        provenance: vec![Provenance::default()],
        ..LookupBatch::default()
    };
    lookup.estimate(&mut asked);
    asked.estimates[0]
}

fn told(reference: &Reference, point: SurfacePoint) -> f32 {
    estimated(reference, point).ratio
}

fn level(reference: &Reference, point: SurfacePoint) -> u8 {
    estimated(reference, point).level
}

fn lifted(footprints: f64) -> SurfacePoint {
    let point = on_wall(30.2, 31.7);
    let towards_eye = -point.p.normalize();
    SurfacePoint { p: point.p + towards_eye * (footprints * camera().pixel_size()), ..point }
}

#[test]
fn samples_on_the_surface_give_an_exact_estimate() {
    let reference = wall(|_| 0.25);
    for point in [on_wall(30.5, 20.5), on_wall(11.13, 47.9), on_wall(0.2, 0.1), lifted(0.5)] {
        assert_eq!(told(&reference, point), 0.25);
    }
}

#[test]
fn points_that_are_not_seen_directly_may_be_left_out() {
    let reference = wall(|_| 0.25);
    let direct = on_wall(30.5, 20.5);
    let specular = SurfacePoint { direct: false, ..direct };
    let known = |is_asked, point| estimated_by(is_asked, &reference, point).ratio;
    assert_eq!([known(true, direct), known(true, specular), known(false, direct)], [0.25; 3]);
    assert!(known(false, specular).is_nan());
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
    assert_eq!(told(&reference, on_wall(30.2, 31.7)), 0.25);
}

#[test]
fn points_seen_in_mirrors_are_estimated_by_position_from_all_references() {
    let ratio = |x: u32, y: u32| if y % 2 == 1 { f32::NAN } else { 0.25 + 0.5 * (x % 2) as f32 };
    let mut traced = TracedPoints::default();
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let point = on_wall(f64::from(x) + 0.5, f64::from(y) + 0.5);
        traced.points.push(TracedPoint { x, y, point: SurfacePoint { direct: false, ..point } });
        traced.ratios.push(ratio(x, y));
    }
    let reference = Reference::new(1, &camera(), &traced, 1);
    let asked = |point| told(&reference, point);
    let mirrored = SurfacePoint { direct: false, ..on_wall(30.1, 31.2) };
    let mean = asked(mirrored);
    assert!((0.4..0.6).contains(&mean), "{mean}");
    // No pixel's own sample, so only by place.
    assert!(asked(SurfacePoint { direct: true, ..mirrored }).is_nan());
    assert!(asked(SurfacePoint { geom_id: 1, ..mirrored }).is_nan());
    assert!(asked(SurfacePoint { n: Vec3::X, ..mirrored }).is_nan());
}

#[test]
fn samples_of_another_mesh_are_not_used() {
    let point = SurfacePoint { geom_id: 1, ..on_wall(30.2, 31.7) };
    assert!(told(&wall(|_| 1.0), point).is_nan());
}

#[test]
fn samples_with_another_normal_are_not_used() {
    let turned = |degrees: f32| SurfacePoint {
        n: Vec3::new(degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()),
        ..on_wall(30.2, 31.7)
    };
    let reference = wall(|_| 1.0);
    assert_eq!(told(&reference, turned(20.0)), 1.0);
    assert!(told(&reference, turned(45.0)).is_nan());
}

#[test]
fn samples_off_the_surface_are_not_used() {
    let reference = wall(|_| 1.0);
    assert_eq!(told(&reference, lifted(0.5)), 1.0);
    assert!(told(&reference, lifted(1.4)).is_nan());
    assert!(told(&reference, lifted(-1.8)).is_nan());
}

#[test]
fn much_coarser_references_are_not_used() {
    let finer = |by: f32| {
        let point = on_wall(30.2, 31.7);
        SurfacePoint { footprint: point.footprint / by, ..point }
    };
    let reference = wall(|_| 1.0);
    assert_eq!(told(&reference, finer(2.0)), 1.0);
    assert!(told(&reference, finer(3.0)).is_nan());
}

#[test]
fn risk_rises_towards_an_edge() {
    let edge = wall(|x| if x < 32 { 1.0 } else { 0.0 });
    let at = |x: f64| level(&edge, on_wall(x, 20.0));
    assert_eq!([at(10.5), at(50.5)], [at(20.5); 2], "far from it");
    let near = [at(32.0), at(30.5), at(28.5), at(20.5)];
    assert!(near.is_sorted_by(|a, b| a > b), "{near:?}");
    // As far on the other side, in the dark, a difference shows more.
    assert!(at(33.5) > at(30.5));
    assert_eq!(told(&edge, on_wall(30.5, 20.0)), 1.0);
    assert_eq!(told(&edge, on_wall(33.5, 20.0)), 0.0);
}

#[test]
fn a_steady_change_bends_less_than_a_kink() {
    let point = on_wall(31.3, 20.2);
    let steady = wall(|x| (0.5 + 0.02 * (x as f32 - 31.0)).clamp(0.0, 1.0));
    let kink = wall(|x| 0.5 + 0.04 * (x as f32 - 31.0).clamp(0.0, 9.0));
    assert!((told(&steady, point) - 0.496).abs() < 0.01);
    assert!(level(&steady, point) < level(&kink, point));
}

#[test]
fn samples_to_one_side_are_riskier() {
    let half = wall(|x| if x < 32 { 1.0 } else { f32::NAN });
    assert_eq!(told(&half, on_wall(32.2, 20.5)), 1.0);
    assert!(level(&half, on_wall(32.2, 20.5)) > level(&half, on_wall(20.2, 20.5)));
}

/// Ratios of 16 rays scatter by an eighth in half shadow.
#[test]
fn noise_and_detail_have_scales_of_their_own() {
    let is_detail = |reference: &Reference, x: f64| {
        usize::from(level(reference, on_wall(x, 20.5))) / STEPS == 1
    };
    let noisy = wall(|x| 0.5 + [0.0, 0.125, -0.0625, -0.125, 0.0625][x as usize % 5]);
    assert!(!is_detail(&noisy, 20.2));
    let bars = wall(|x| f32::from(u8::from(x % 5 < 2)));
    assert!(is_detail(&bars, 20.2));
    // A few rays of 16 that are shut now and then.
    let specks = wall(|x| if x % 5 == 0 { 1.0 - 1.0 / 16.0 } else { 1.0 });
    assert!(!is_detail(&specks, 20.2));
}

/// The wall with three channels: lit evenly, at the edge of a shadow, and lit evenly.
fn wall_with_an_edge() -> Reference {
    let mut traced = TracedPoints::default();
    for (x, y) in (0..EDGE).flat_map(|y| (0..EDGE).map(move |x| (x, y))) {
        let point = on_wall(f64::from(x) + 0.5, f64::from(y) + 0.5);
        traced.points.push(TracedPoint { x, y, point });
        traced.ratios.extend([1.0, f32::from(u8::from(x < 32)), 0.5]);
    }
    Reference::new(1, &camera(), &traced, 3)
}

/// What is asked about a point of the wall where the channels send `unshadowed`.
fn asked_at(x: f64, unshadowed: [f32; 3]) -> LookupBatch {
    LookupBatch {
        points: vec![on_wall(x, 20.5)],
        refinement: 1.0,
        pixels: vec![[0; 2]],
        unshadowed: unshadowed.to_vec(),
        ratios: vec![f32::NAN; 3],
        provenance: vec![Provenance::default()],
        ..LookupBatch::default()
    }
}

/// A light that errs makes what it and the weaker ones together are told uncertain, but not these alone.
#[test]
fn lights_are_ordered_by_what_they_send() {
    let reference = wall_with_an_edge();
    let lookup =
        Lookup { frame: 2, references: &[&reference], channels: &[LIGHT; 3], specular: true };
    let of = |x: f64, second: f32| {
        let mut asked = asked_at(x, [1.0, second, 1.0]);
        lookup.estimate(&mut asked);
        [0, 1, 2].map(|k| asked.estimates[k])
    };
    let [first, second, third] = of(31.5, 2.0);
    assert_eq!([first, second, third].map(|e| e.order), [0, 2, 1]);
    assert_eq!([first, second, third].map(|e| is_part(e.level)), [true, false, true]);
    let calm = of_lights(first.level, false);
    assert!(second.level > calm && third.level == first.level);
    assert_eq!(of(10.5, 2.0)[1].level, calm, "far from the edge");
    // A weaker light that errs counts for brighter ones.
    assert!(of(31.5, 0.5).iter().all(|e| of_lights(e.level, false) > calm));
    // The second does not shine there.
    assert_eq!(of(31.5, 0.0)[2].level, calm);
    // As the second ratio of the first light it counts for that one.
    let part = LookupChannel { is_first: false, ..LIGHT };
    let lookup = Lookup { channels: &[LIGHT, part, LIGHT], ..lookup };
    let mut asked = asked_at(31.5, [1.0; 3]);
    lookup.estimate(&mut asked);
    assert_eq!([0, 1, 2].map(|k| asked.estimates[k].order), [1, 1, 0]);
    assert_eq!(asked.estimates[0].level, asked.estimates[1].level);
}

/// Where the evidence does not allow all lights of a point, the weaker ones are inferred and checked, if that saves
/// enough rays.
#[test]
fn only_the_brighter_lights_are_traced() {
    let reference = wall_with_an_edge();
    let finding = |level: usize, error| {
        let level = level as u8;
        Finding { level, agreed: true, error, noise: 1.0 }
    };
    let half = LEVELS / 2;
    let calm = [0, half].map(|scale| vec![finding(scale + 1, 0.0); 100]).concat();
    let wrong = |level: &usize| level % half > 4;
    let wrong: Vec<Finding> = (0..LEVELS).filter(wrong).map(|l| finding(l, 100.0)).collect();
    let some = Evidence::of(calm.iter().chain(&wrong), 0.25);
    let none = Evidence::of(wrong.iter(), 0.25);
    let answers = |evidence: &Evidence, x: f64, rays: u32| {
        let channels = [LookupChannel { rays, ..LIGHT }; 3];
        let lookup =
            Lookup { frame: 2, references: &[&reference], channels: &channels, specular: true };
        let mut asked = asked_at(x, [0.1, 0.2, 0.1]);
        let judge = |_| evidence;
        Judged { lookup: &lookup, evidence: &judge, tolerance: 0.25 }.infer(&mut asked);
        let checks = asked.checks.iter();
        assert!(checks.zip(&asked.ratios).all(|(check, ratio)| *check != ratio.is_nan()));
        [0, 1, 2].map(|k| asked.ratios[k])
    };
    assert_eq!(answers(&some, 10.5, 64), [1.0, 1.0, 0.5]);
    let [first, second, third] = answers(&some, 31.5, 64);
    assert!((first, third) == (1.0, 0.5) && second.is_nan());
    for (evidence, x, rays) in [(&some, 31.5, 16), (&none, 10.5, 64), (&none, 31.5, 64)] {
        assert!(answers(evidence, x, rays).iter().all(|ratio| ratio.is_nan()));
    }
}
