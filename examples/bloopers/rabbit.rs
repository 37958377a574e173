//! A rabbit of ellipsoids, standing on y = 0, about 1.3 high; or somebody's own mesh at that size.

use std::f64::consts::{PI, TAU};
use std::path::Path;
use tweenray::import::{self, LoadOptions};
use tweenray::math::{Bounds3, DMat3, DVec3};
use tweenray::scene::{Corners, WorldMesh};

/// Centre, half axes, lean in degrees (about z, then about x).
type Ellipsoid = ([f64; 3], [f64; 3], [f64; 2]);

const PARTS: [Ellipsoid; 12] = [
    ([0.0, 0.38, -0.05], [0.34, 0.38, 0.46], [0.0, -12.0]),
    ([0.0, 0.78, 0.3], [0.22, 0.22, 0.25], [0.0, 10.0]),
    ([0.0, 0.72, 0.5], [0.1, 0.08, 0.1], [0.0, 0.0]),
    ([-0.1, 1.08, 0.17], [0.06, 0.24, 0.04], [14.0, -14.0]),
    ([0.11, 1.08, 0.17], [0.06, 0.24, 0.04], [-16.0, -8.0]),
    ([0.0, 0.4, -0.52], [0.12, 0.12, 0.12], [0.0, 0.0]),
    ([-0.22, 0.18, 0.02], [0.14, 0.18, 0.28], [0.0, 0.0]),
    ([0.22, 0.18, 0.02], [0.14, 0.18, 0.28], [0.0, 0.0]),
    ([-0.14, 0.06, 0.38], [0.08, 0.06, 0.16], [0.0, 0.0]),
    ([0.14, 0.06, 0.38], [0.08, 0.06, 0.16], [0.0, 0.0]),
    ([-0.13, 0.84, 0.47], [0.035, 0.035, 0.035], [0.0, 0.0]),
    ([0.13, 0.84, 0.47], [0.035, 0.035, 0.035], [0.0, 0.0]),
];
const COLUMNS: u32 = 96;
const ROWS: u32 = 64;

/// The rabbit, with smooth normals.
pub fn rabbit() -> WorldMesh {
    let (mut positions, mut values, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for (centre, axes, lean) in PARTS {
        let axes = DVec3::from(axes);
        let turn = DMat3::from_rotation_z(lean[0].to_radians())
            * DMat3::from_rotation_x(lean[1].to_radians());
        let first = positions.len() as u32;
        for row in 0..=ROWS {
            let (sin_t, cos_t) = (PI * f64::from(row) / f64::from(ROWS)).sin_cos();
            for column in 0..COLUMNS {
                let (sin_p, cos_p) = (TAU * f64::from(column) / f64::from(COLUMNS)).sin_cos();
                let on_ball = DVec3::new(sin_t * cos_p, cos_t, sin_t * sin_p);
                positions.push(DVec3::from(centre) + turn * (on_ball * axes));
                values.push((turn * (on_ball / axes).normalize()).as_vec3());
            }
        }
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let at = |row: u32, column: u32| first + row * COLUMNS + column % COLUMNS;
                let (a, b) = (at(row, column), at(row, column + 1));
                let (c, d) = (at(row + 1, column), at(row + 1, column + 1));
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    let normals = Some(Corners { values, corners: None });
    WorldMesh { normals, ..WorldMesh::new("rabbit", positions, triangles, 0) }
}

/// The first mesh of a file, put in the rabbit's place.
pub fn read(file: &Path) -> WorldMesh {
    let loaded = import::load(file, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let mut mesh = loaded.world.meshes.into_iter().next().expect("a mesh");
    let mut bounds = Bounds3::EMPTY;
    mesh.positions.iter().for_each(|p| bounds.include(*p));
    let scale = 1.3 / bounds.extent().max_element();
    let foot = DVec3::new(bounds.centre().x, bounds.min.y, bounds.centre().z);
    mesh.positions.iter_mut().for_each(|p| *p = (*p - foot) * scale);
    mesh
}
