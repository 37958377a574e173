//! Normals under affine transforms.

use crate::suite::{self, Outcome, Size};
use crate::{common, shapes};
use rand::Rng;
use tweenray::math::{DAffine3, DMat3, DVec3, Vec3};
use tweenray::scene::Corners;

/// A random affine transform: rotation, scale 10^±3 an axis, shear, mirrored half of the time.
fn transform(rng: &mut impl Rng) -> DAffine3 {
    let turn = |rng: &mut _| {
        let x: DVec3 = shapes::direction(rng);
        let z = x.any_orthonormal_vector();
        DMat3::from_cols(x, z.cross(x), z)
    };
    let scale = DVec3::from_array([(); 3].map(|()| {
        let size = 10f64.powf(rng.random_range(-3.0..=3.0));
        if rng.random() { size } else { -size }
    }));
    let mut shear = DMat3::IDENTITY;
    shear.y_axis.x = rng.random_range(-2.0..=2.0);
    shear.z_axis.x = rng.random_range(-2.0..=2.0);
    shear.z_axis.y = rng.random_range(-2.0..=2.0);
    let matrix = turn(rng) * shear * DMat3::from_diagonal(scale) * turn(rng);
    DAffine3::from_mat3_translation(matrix, shapes::direction(rng) * 10.0)
}

/// The angle between two unit vectors, exact for small ones.
fn angle(a: DVec3, b: DVec3) -> f64 {
    2.0 * (0.5 * (a - b).length()).min(1.0).asin()
}

/// What one mesh of a single triangle becomes: its shading normal, and its plane's by the winding.
fn moved(corners: [DVec3; 3], n: Vec3, by: &DAffine3) -> (DVec3, DVec3) {
    let mut mesh = common::mesh(corners.to_vec(), vec![[0, 1, 2]], 0);
    mesh.normals = Some(Corners { values: vec![n; 3], corners: None });
    mesh.apply_transform(by).unwrap();
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    (mesh.normals.unwrap().values[0].as_dvec3(), (b - a).cross(c - a).normalize())
}

pub fn normal_transform(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let (mut worst, mut naive_off, mut naive_side, mut mirrored) = (0f64, 0, 0, 0);
    let count = size.of(20_000, 1_000_000);
    for i in 0..count {
        let mut rng = suite::rng(32, i);
        let by = transform(&mut rng);
        let corners = [(); 3].map(|()| shapes::in_ball(&mut rng, 1.0));
        let plane = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        // A shading normal on the outside, up to 80 degrees from the plane's.
        let n = (plane + shapes::direction(&mut rng) * 0.98).normalize().as_vec3();
        let (ns, ng) = moved(corners, n, &by);
        // A normal is a covector: it takes values on tangents, which move by the matrix. Solved
        // here, not by cofactors: the inverse transpose by glam's f64 inverse.
        let inverse = by.matrix3.inverse().transpose();
        let expected = (inverse * n.as_dvec3()).normalize();
        let error = angle(ns, expected);
        worst = worst.max(error);
        // The outside stays outside: the moved plane's normal is the moved normal of the plane.
        let side = ng.dot((inverse * plane).normalize());
        let ok = error <= 1e-6 && side > 0.0;
        outcome.check(ok, || format!("{by:?}: {error:e} rad off, side {side}"));
        let naive = (by.matrix3 * n.as_dvec3()).normalize();
        naive_off += u64::from(angle(naive, expected) > 1e-3);
        mirrored += u64::from(by.matrix3.determinant() < 0.0);
        let kept = by.transform_vector3(corners[1] - corners[0]);
        let kept = kept.cross(by.transform_vector3(corners[2] - corners[0]));
        naive_side += u64::from(kept.dot(inverse * plane) < 0.0);
    }
    outcome.at_most("largest angle from the inverse transpose, rad", worst, 1e-6);
    let share = |n: u64| n as f64 / count as f64;
    outcome.at_least("share that the matrix itself turns wrongly", share(naive_off), 0.5);
    outcome.at_least("share turned inside out by an unreversed winding", share(naive_side), 0.4);
    outcome.at_least("share that mirrors", share(mirrored), 0.4);
    known(&mut outcome);
    outcome
}

/// diag(2, 1, 1) on the plane x + y = 0: its normal goes to (1, 2, 0), the matrix gives (2, 1, 0).
fn known(outcome: &mut Outcome) {
    let by = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
    let n = Vec3::new(1.0, 1.0, 0.0).normalize();
    let (ns, _) = moved([DVec3::ZERO, DVec3::new(-1.0, 1.0, 0.0), DVec3::Z], n, &by);
    let expected = DVec3::new(1.0, 2.0, 0.0).normalize();
    let naive = (by.matrix3 * n.as_dvec3()).normalize();
    outcome.at_most("diag(2,1,1): rad off", angle(ns, expected), 1e-6);
    outcome.at_least(
        "diag(2,1,1): degrees off by the matrix",
        angle(naive, expected).to_degrees(),
        36.86,
    );
}
