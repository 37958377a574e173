//! Morph targets and skins, at one time.

use super::accessor::Accessor;
use super::animation::{Animations, Property};
use super::document::Document;
use super::json::Json;
use super::primitive::{self, Primitive};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;

/// Positions and normals of a primitive's vertices.
pub(super) struct Shape {
    pub positions: Vec<DVec3>,
    /// Of any length.
    pub normals: Option<Vec<DVec3>>,
    /// Whether its outside became its inside.
    pub mirrored: bool,
}

/// Matrices that move the joints of a skin from where they were when it was put on.
pub(super) type JointMatrices = std::sync::Arc<[DAffine3]>;

impl Shape {
    /// The shape as the file has it; the positions are taken out of the primitive.
    pub fn of(primitive: &mut Primitive) -> Self {
        let wide = |v: &[f32; 3]| DVec3::from_array(v.map(f64::from));
        let normals = primitive.normals.take();
        Self {
            positions: std::mem::take(&mut primitive.positions),
            normals: normals.map(|all| all.par_iter().map(wide).collect()),
            mirrored: false,
        }
    }

    /// Adds the morph targets of `json`, a primitive, by their weights. A target without a weight is not read.
    pub fn morph(
        &mut self,
        document: &Document<'_>,
        json: &Json<'_>,
        weights: &[f64],
    ) -> Result<()> {
        for (target, weight) in json.list("targets")?.iter().zip(weights) {
            if *weight == 0.0 {
                continue;
            }
            let target = primitive::target(document, target, self.positions.len())?;
            let add = |to: &mut Vec<DVec3>, by: Option<Vec<[f32; 3]>>| {
                let moved = to.par_iter_mut().zip(by.unwrap_or_default());
                moved.for_each(|(v, d)| *v += DVec3::from_array(d.map(f64::from)) * *weight);
            };
            add(&mut self.positions, target.positions);
            if let Some(normals) = &mut self.normals {
                add(normals, target.normals);
            }
        }
        Ok(())
    }

    /// Moves each vertex with its joints, by their weights made to add up to 1. The result is in the world.
    ///
    /// Errors: a joint that the skin does not have.
    pub fn skin(
        &mut self,
        primitive: &Primitive,
        json: &Json<'_>,
        joints: &JointMatrices,
    ) -> Result<()> {
        let stray = primitive.joints.iter().find_map(|(numbers, _)| {
            numbers.par_iter().flatten_iter().find_first(|at| **at as usize >= joints.len())
        });
        if let Some(stray) = stray {
            let count = joints.len();
            return Err(json
                .fault(format!("there is no joint {stray} (from 0): the skin has {count}"))
                .into());
        }
        let matrix = |vertex: usize| {
            let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
            let mut total = 0.0;
            for (numbers, weights) in &primitive.joints {
                for (joint, weight) in numbers[vertex].iter().zip(weights[vertex]) {
                    let (joint, weight) = (&joints[*joint as usize], f64::from(weight));
                    sum.matrix3 += joint.matrix3 * weight;
                    sum.translation += joint.translation * weight;
                    total += weight;
                }
            }
            let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
            DAffine3 { matrix3: sum.matrix3 * scale, translation: sum.translation * scale }
        };
        let matrices: Vec<DAffine3> =
            (0..self.positions.len()).into_par_iter().map(matrix).collect();
        let moved = self.positions.par_iter_mut().zip(&matrices);
        moved.for_each(|(p, matrix)| *p = matrix.transform_point3(*p));
        if let Some(normals) = &mut self.normals {
            let turned = normals.par_iter_mut().zip(&matrices);
            turned.for_each(|(n, matrix)| *n = cofactors(&matrix.matrix3) * *n);
        }
        // Cofactors turn normals around where a matrix mirrors.
        let mirrors = |matrix: &&DAffine3| matrix.matrix3.determinant() < 0.0;
        self.mirrored = 2 * matrices.par_iter().filter(mirrors).count() > matrices.len();
        if let (true, Some(normals)) = (self.mirrored, &mut self.normals) {
            normals.par_iter_mut().for_each(|n| *n = -*n);
        }
        Ok(())
    }
}

/// The matrix of cofactors, which turns normals as `m` turns planes.
fn cofactors(m: &DMat3) -> DMat3 {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// The weights of at most `most` morph targets of a node's mesh at `time`: animated, the node's own, or the mesh's.
pub(super) fn morph_weights(
    node: &Json<'_>,
    (number, most): (usize, usize),
    mesh: &Json<'_>,
    (animations, time): (&Animations, f64),
) -> Result<Vec<f64>> {
    if most == 0 {
        return Ok(Vec::new());
    }
    if let Some(curve) = animations.get(Property::Weights(number)) {
        return Ok(curve.at(time));
    }
    let own = node.first_numbers("weights", most)?;
    let weights = own.map_or_else(|| mesh.first_numbers("weights", most), |own| Ok(Some(own)))?;
    Ok(weights.unwrap_or_default())
}

/// The joint matrices of a skin, with all nodes where `worlds` has them.
///
/// Errors: nodes that there are not, fewer matrices than joints.
pub(super) fn joint_matrices(
    document: &Document<'_>,
    skin: &Json<'_>,
    worlds: &[DAffine3],
) -> Result<JointMatrices> {
    let joints = skin.required("joints")?.elements()?;
    let joints: Vec<usize> =
        joints.iter().map(|json| json.as_index(worlds.len(), "node")).collect::<Result<_>>()?;
    let inverse = match skin.get("inverseBindMatrices") {
        Some(json) => {
            let mut accessor = Accessor::open(document, &json)?;
            if accessor.count < joints.len() {
                let (is, wanted) = (accessor.count, joints.len());
                return Err(json.fault(format!("{is} matrices for {wanted} joints")).into());
            }
            accessor.count = joints.len();
            accessor.finite::<16>()?
        }
        None => Vec::new(),
    };
    let of = |(at, joint): (usize, &usize)| {
        let inverse = inverse.get(at).map_or(DAffine3::IDENTITY, |m| {
            let column = |c: usize| DVec3::new(m[c].into(), m[c + 1].into(), m[c + 2].into());
            DAffine3 {
                matrix3: DMat3::from_cols(column(0), column(4), column(8)),
                translation: column(12),
            }
        });
        worlds[*joint] * inverse
    };
    Ok(joints.iter().enumerate().map(of).collect())
}
