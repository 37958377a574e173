//! Meshes as OBJ text.

use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// A mesh as it grows.
#[derive(Default)]
pub struct Obj {
    text: String,
    vertices: usize,
}

impl Obj {
    /// The file's text.
    pub fn into_text(self) -> String {
        self.text
    }

    fn vertex(&mut self, p: DVec3) -> usize {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "v {:.6} {:.6} {:.6}", p.x, p.y, p.z);
        self.vertices += 1;
        self.vertices
    }

    fn face(&mut self, corners: &[usize]) {
        self.text.push('f');
        for corner in corners {
            let _ = write!(self.text, " {corner}");
        }
        self.text.push('\n');
    }

    /// A triangle or a flat quad.
    pub fn polygon(&mut self, corners: &[DVec3]) {
        let indices: Vec<usize> = corners.iter().map(|c| self.vertex(*c)).collect();
        self.face(&indices);
    }

    /// A quad whose texture spans `repeats` of the image along both edges.
    pub fn textured_quad(&mut self, corner: DVec3, edges: [DVec3; 2], repeats: [f64; 2]) {
        let [a, b] = edges;
        let first = self.vertices + 1;
        for (p, [u, v]) in [
            (corner, [0.0, 0.0]),
            (corner + a, [repeats[0], 0.0]),
            (corner + a + b, repeats),
            (corner + b, [0.0, repeats[1]]),
        ] {
            self.vertex(p);
            let _ = writeln!(self.text, "vt {u:.4} {v:.4}");
        }
        // Every vertex of such a mesh has a texture coordinate, so both count alike.
        let [i, j, k, l] = [first, first + 1, first + 2, first + 3];
        let _ = writeln!(self.text, "f {i}/{i} {j}/{j} {k}/{k} {l}/{l}");
    }

    /// A box with textured sides, its texture `per_unit` times in a unit of length.
    pub fn textured_block(&mut self, min: DVec3, max: DVec3, per_unit: f64) {
        let d = max - min;
        let (x, y, z) = (DVec3::X * d.x, DVec3::Y * d.y, DVec3::Z * d.z);
        for (corner, a, b) in
            [(min, x, y), (min + z, x, y), (min, z, y), (min + x, z, y), (min + y, x, z)]
        {
            self.textured_quad(corner, [a, b], [a.length() * per_unit, b.length() * per_unit]);
        }
    }

    /// A box from `centre`, half edges and a turn about y in radians.
    pub fn block(&mut self, centre: DVec3, half: DVec3, turn: f64) {
        self.turned_block(centre, half, DMat3::from_rotation_y(turn));
    }

    /// A box turned by `turn` about its centre.
    pub fn turned_block(&mut self, centre: DVec3, half: DVec3, turn: DMat3) {
        let first = self.vertices + 1;
        for i in 0..8 {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            self.vertex(centre + turn * (half * DVec3::new(sign(0), sign(1), sign(2))));
        }
        for face in
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        {
            self.face(&face.map(|i| first + i));
        }
    }

    /// A closed prism from `a` to `b`, with these radii at its ends.
    pub fn prism(&mut self, [a, b]: [DVec3; 2], radii: [f64; 2], sides: usize) {
        let (u, v) = (b - a).normalize().any_orthonormal_pair();
        let first = self.vertices + 1;
        for (end, radius) in [(a, radii[0]), (b, radii[1])] {
            for i in 0..sides {
                let t = TAU * i as f64 / sides as f64;
                self.vertex(end + radius * (u * t.cos() + v * t.sin()));
            }
        }
        for i in 0..sides {
            let j = (i + 1) % sides;
            self.face(&[first + i, first + j, first + sides + j, first + sides + i]);
        }
        let caps: [Vec<usize>; 2] = [
            (0..sides).rev().map(|i| first + i).collect(),
            (sides..2 * sides).map(|i| first + i).collect(),
        ];
        caps.iter().for_each(|cap| self.face(cap));
    }

    /// An ellipsoid of 2 · `bands` · `bands` faces, turned by `turn`.
    pub fn ball(&mut self, centre: DVec3, radii: DVec3, bands: usize, turn: DMat3) {
        let meridians = 2 * bands;
        let point = |i: usize, j: usize| {
            let (a, b) = (PI * i as f64 / bands as f64, TAU * j as f64 / meridians as f64);
            let unit = DVec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin());
            centre + turn * (radii * unit)
        };
        let north = self.vertex(point(0, 0));
        let first = self.vertices + 1;
        for i in 1..bands {
            for j in 0..meridians {
                self.vertex(point(i, j));
            }
        }
        let south = self.vertex(point(bands, 0));
        let at = |i: usize, j: usize| first + (i - 1) * meridians + j % meridians;
        for j in 0..meridians {
            self.face(&[north, at(1, j + 1), at(1, j)]);
            self.face(&[south, at(bands - 1, j), at(bands - 1, j + 1)]);
            for i in 1..bands - 1 {
                self.face(&[at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }

    /// A torus of radii `ring` and `tube` about the y axis, turned by `turn`.
    pub fn torus(&mut self, centre: DVec3, [ring, tube]: [f64; 2], steps: usize, turn: DMat3) {
        let around = 2 * steps;
        let first = self.vertices + 1;
        for i in 0..around {
            for j in 0..steps {
                let (a, b) = (TAU * i as f64 / around as f64, TAU * j as f64 / steps as f64);
                let r = ring + tube * b.cos();
                let p = DVec3::new(r * a.cos(), tube * b.sin(), r * a.sin());
                self.vertex(centre + turn * p);
            }
        }
        let at = |i: usize, j: usize| first + i % around * steps + j % steps;
        for i in 0..around {
            for j in 0..steps {
                self.face(&[at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }

    /// Ground over the square of this half edge, `steps` squares a side, of this height.
    pub fn ground(&mut self, half: f64, steps: usize, height: impl Fn(f64, f64) -> f64) {
        let first = self.vertices + 1;
        let along = |i: usize| half * (2.0 * i as f64 / steps as f64 - 1.0);
        for i in 0..=steps {
            for j in 0..=steps {
                let (x, z) = (along(i), along(j));
                self.vertex(DVec3::new(x, height(x, z), z));
            }
        }
        let at = |i: usize, j: usize| first + i * (steps + 1) + j;
        for i in 0..steps {
            for j in 0..steps {
                self.face(&[at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
                self.face(&[at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
            }
        }
    }
}
