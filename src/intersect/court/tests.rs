use super::*;
use proptest::prelude::*;

const UNIT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

fn line(org: [f64; 3], dir: [f64; 3]) -> Line {
    Line::new(&Ray::new(org.into(), dir.into()), 1.0)
}

fn down(x: f64, y: f64) -> Line {
    line([x, y, 2.0], [0.0, 0.0, -1.0])
}

#[test]
fn inside_edge_and_outside_differ_to_the_last_bit() {
    let below = f64::EPSILON / 4.0;
    for (x, y, place) in [
        (0.25, 0.25, Place::Inside),
        (0.25, 0.0, Place::Edge),
        (0.0, 0.0, Place::Edge),
        (1.0, 0.0, Place::Edge),
        (0.5, 0.5, Place::Edge),
        (0.25, below, Place::Inside),
        (0.25, -below, Place::Outside),
        (0.5, 0.5 + f64::EPSILON, Place::Outside),
        (0.5, 0.5 - f64::EPSILON, Place::Inside),
        (-below, -below, Place::Outside),
        (3.0, 3.0, Place::Outside),
    ] {
        assert_eq!(down(x, y).place(&UNIT), place, "{x} {y}");
        let [a, b, c] = UNIT;
        assert_eq!(down(x, y).place(&[c, b, a]), place, "{x} {y}, other winding");
    }
}

#[test]
fn meets_the_known_point() {
    let ray = Ray::new(DVec3::new(0.25, 0.5, 2.0), DVec3::new(0.0, 0.0, -4.0));
    let met = Line::new(&ray, 1.0).meet(&UNIT);
    assert_eq!(met, Some(Meeting { t: 0.5, u: 0.25, v: 0.5, place: Place::Inside }));
}

#[test]
fn a_ray_in_the_plane_and_a_degenerate_triangle_meet_nothing() {
    for dir in [[1.0, 0.0, 0.0], [0.3, -0.7, 0.0]] {
        for org in [[-1.0, 0.2, 0.0], [0.0, 0.0, 0.0], [0.25, 0.25, 0.0]] {
            assert_eq!(line(org, dir).meet(&UNIT), None, "{org:?} {dir:?}");
        }
    }
    let x = |x: f64| DVec3::new(x, 0.0, 0.0);
    for corners in
        [[x(0.0); 3], [x(0.0), x(1.0), x(0.5)], [x(0.0), x(0.0), x(1.0)], [x(1.0), x(0.0), x(1.0)]]
    {
        assert_eq!(down(0.25, 0.0).meet(&corners), None, "{corners:?}");
        assert_eq!(down(0.0, 0.0).meet(&corners), None, "{corners:?}");
    }
}

#[test]
fn a_far_origin_keeps_the_line() {
    // 2^30 away: the direction's last bit is 2^-22 wide at the scene, the point is not.
    let far = 2f64.powi(30);
    for (x, place) in [(2f64.powi(-40), Place::Inside), (-2f64.powi(-40), Place::Outside)] {
        let line = line([x, 0.25, far], [0.0, 0.0, -3.0]);
        assert_eq!(line.place(&UNIT), place, "{x}");
        assert_eq!(line.plane_t(&UNIT), Some(far / 3.0));
    }
}

#[test]
fn distances_to_a_triangle_are_the_known_ones() {
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{a} {b}");
    close(down(0.25, 0.125).edge_distance(&UNIT), 0.125);
    close(down(0.25, 0.125).distance(&UNIT), 0.0);
    close(down(2.0, 0.0).distance(&UNIT), 1.0);
    close(down(-3.0, -4.0).distance(&UNIT), 5.0);
    let ulp = f64::from(f32::EPSILON) * 2.0;
    close(down(0.25, -3.0 * ulp).ulps(&UNIT), 3.0);
    close(down(0.25, -3.0 * ulp).moved(DVec3::Y * 4.0 * ulp).edge_ulps(&UNIT), 1.0);
}

#[test]
fn t_of_a_grazed_sliver_is_exact_where_f64_alone_is_not() {
    // The plane is z = y·2^-26 − 2^-27: met at y = 1/2 + 2^26·z from any distance.
    let step = 2f64.powi(-27);
    let corners =
        [DVec3::new(-1.0, 0.0, -step), DVec3::new(1.0, 0.0, -step), DVec3::new(0.0, 1.0, step)];
    let ray = Ray::new(DVec3::new(0.0, -4.0, 0.0), DVec3::Y);
    let met = Line::new(&ray, 1.0).meet(&corners).unwrap();
    assert_eq!((met.t, met.place), (4.5, Place::Inside));
}

fn point() -> impl Strategy<Value = DVec3> {
    [-1f32..1.0, -1f32..1.0, -1f32..1.0].prop_map(|p| DVec3::from_array(p.map(f64::from)))
}

/// A line that leaves no triangle of a fan around the vertex `hub` unhit, or hits just one.
fn fan_hits(line: &Line, hub: DVec3, rim: &[DVec3]) -> Vec<Place> {
    let next = rim.iter().cycle().skip(1);
    let places = rim.iter().zip(next).map(|(a, b)| line.place(&[hub, *a, *b]));
    places.filter(|place| *place != Place::Outside).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// Rays aimed at an edge hit one of the two triangles at it, both only exactly through it.
    #[test]
    fn a_shared_edge_neither_leaks_nor_counts_twice(
        a in point(), b in point(), c in point(), org in point(), share in 0.001f64..0.999,
    ) {
        // d lies opposite c, so the two triangles cover the neighbourhood of the edge from org.
        let aim = a + (b - a) * share;
        let d = (aim + (aim - c)).as_vec3().as_dvec3();
        let line = Line::new(&Ray::new(org, aim - org), 1.0);
        let flat = (aim - org).dot((b - a).cross(c - a)).abs();
        prop_assume!(flat > 1e-6 && a.distance(b) > 1e-3);
        let one = line.place(&[a, b, c]);
        let two = line.place(&[b, a, d]);
        let both = [one, two];
        prop_assert!(both != [Place::Outside; 2], "leak");
        if both.iter().all(|p| *p != Place::Outside) {
            prop_assert_eq!(both, [Place::Edge; 2], "counted twice");
        }
    }

    /// Rays aimed at a vertex hit its fan exactly once, unless they pass through it or an edge.
    #[test]
    fn a_vertex_neither_leaks_nor_counts_twice(
        height in prop::collection::vec(-0.2f32..0.2, 7), hub in point(), org in point(),
        size in 1e-4f32..0.5,
    ) {
        // A fan seen from above, however bumpy, covers its hub once.
        let org = DVec3::new(org.x * 0.05, org.y * 0.05, org.z.abs() + 1.5) + hub;
        let rim: Vec<DVec3> = height.iter().enumerate().map(|(i, h)| {
            let angle = i as f64 / 7.0 * std::f64::consts::TAU;
            let around = DVec3::new(angle.cos(), angle.sin(), f64::from(*h)) * f64::from(size);
            (hub + around).as_vec3().as_dvec3()
        }).collect();
        let line = Line::new(&Ray::new(org, hub - org), 4.0);
        let hits = fan_hits(&line, hub, &rim);
        prop_assert!(!hits.is_empty(), "leak");
        prop_assert!(hits.len() == 1 || hits.iter().all(|p| *p == Place::Edge), "{:?}", hits);
    }

    /// Away from edges the verdict is that of the plain formula, and `t` leads into the plane.
    #[test]
    fn agrees_with_the_plain_formula(a in point(), b in point(), c in point(), org in point(), dir in point()) {
        prop_assume!(dir.length() > 1e-3);
        let line = Line::new(&Ray::new(org, dir), 1.0);
        let (e1, e2) = (b - a, c - a);
        let p = dir.cross(e2);
        let det = e1.dot(p);
        prop_assume!(det.abs() > 1e-6);
        let s = org - a;
        let (u, v) = (s.dot(p) / det, dir.dot(s.cross(e1)) / det);
        let least = u.min(v).min(1.0 - u - v);
        prop_assume!(least.abs() > 1e-8);
        let met = line.meet(&[a, b, c]);
        prop_assert_eq!(met.is_some(), least > 0.0);
        if let Some(met) = met {
            let t = e2.dot(s.cross(e1)) / det;
            prop_assert!((met.t - t).abs() <= 1e-8 * (1.0 + t.abs()));
            prop_assert!((met.u - u).abs() < 1e-8 && (met.v - v).abs() < 1e-8);
        }
    }
}
