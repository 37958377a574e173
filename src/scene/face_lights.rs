//! Lights of the faces of meshes that emit and are seen as they are, as tables of which light is where.

use serde::{Deserialize, Serialize};

/// Most lights of a mesh: each has bounds in the cells of lights. Of more faces one of each group sends the group's light.
pub(super) const MOST_FACE_LIGHTS: usize = 4096;

/// Which light is where on a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaceLights {
    /// For each triangle the first of its parts in `numbers`, and how many rows they lie in; 0 of what is no light.
    faces: Vec<(u32, u32)>,
    /// Index into `Scene::lights` of each part, row by row from the first corner; [`DARK`](Self::DARK) of what is none.
    numbers: Vec<u32>,
}

impl FaceLights {
    const DARK: u32 = u32::MAX;

    /// No light on any of `triangles`.
    pub(super) fn none(triangles: usize) -> Self {
        Self { faces: vec![(0, 0); triangles], numbers: Vec::new() }
    }

    /// Cuts `triangle` into `rows` of parts, whose lights [`push`](Self::push) tells next.
    pub(super) fn cut(&mut self, triangle: usize, rows: u32) {
        self.faces[triangle] = (self.numbers.len() as u32, rows);
    }

    /// The light of the next part.
    pub(super) fn push(&mut self, light: Option<u32>) {
        self.numbers.push(light.unwrap_or(Self::DARK));
    }

    /// The light at the weights `u` and `v` of the second and third corner of triangle `prim`.
    pub fn light(&self, prim: u32, u: f64, v: f64) -> Option<u32> {
        let (first, rows) = self.faces[prim as usize];
        let part = part_at(rows, u, v)?;
        Some(self.numbers[first as usize + part]).filter(|number| *number != Self::DARK)
    }
}

/// The number of the part, of those row by row from the side between the first and the third corner, at the weights `u` and `v`; `None` without rows.
fn part_at(rows: u32, u: f64, v: f64) -> Option<usize> {
    let last = rows.checked_sub(1)?;
    let place = |weight: f64| weight.clamp(0.0, 1.0) * f64::from(rows);
    let (x, y) = (place(u), place(v));
    let i = (x as u32).min(last);
    let j = (y as u32).min(last - i);
    let is_second = j + 1 + i < rows && x - f64::from(i) + (y - f64::from(j)) > 1.0;
    let before = 2 * rows as usize * i as usize - i as usize * i as usize;
    Some(before + 2 * j as usize + usize::from(is_second))
}
