//! `transform`: steps applied one after the other.

use super::at::At;
use super::number::Degrees;
use super::report::Source;
use super::vector::{Direction, List, Point, Scale};
use crate::error::Result;
use crate::import::UpAxis;
use crate::math::{DAffine3, DMat3, DVec3};
use schemars::JsonSchema;
use serde::Deserialize;

/// One step of a transform: exactly one of `translate`, `rotate`, `scale` and `matrix`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case", expecting = "a table")]
pub(super) enum Step {
    /// Moves by `[x, y, z]`, world units.
    Translate(Point),
    /// Turns about an axis through the origin.
    Rotate(Rotation),
    /// Scales about the origin, by one factor or by one for each of x, y, z; negative ones mirror.
    Scale(Scale),
    /// Three rows of four numbers: a 3x3 matrix and, in the last column, a translation.
    Matrix(List<List<super::number::Coordinate, 4>, 3>),
}

/// A turn about an axis through the origin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Rotation {
    /// The axis: a vector, or "x", "y", "z".
    axis: Direction,
    /// The angle, degrees, counter-clockwise seen from the axis's tip.
    degrees: Degrees,
}

/// All `steps` in one, the first applied first.
///
/// Errors: a matrix that flattens, at its step.
pub(super) fn combine(steps: &[At<Step>], source: &Source) -> Result<DAffine3> {
    steps.iter().try_fold(DAffine3::IDENTITY, |before, step| Ok(step.affine(source)? * before))
}

impl At<Step> {
    fn affine(&self, source: &Source) -> Result<DAffine3> {
        Ok(match &self.value {
            Step::Translate(by) => DAffine3::from_translation(by.vec()),
            Step::Rotate(r) => DAffine3::from_mat3(rotation(r.axis.unit(), r.degrees.0)),
            Step::Scale(factors) => DAffine3::from_scale(DVec3::from_array(factors.0.map(|f| f.0))),
            Step::Matrix(rows) => {
                let column = |c: usize| DVec3::from_array([0, 1, 2].map(|r| rows.0[r].0[c].0));
                let matrix = DMat3::from_cols(column(0), column(1), column(2));
                if !keeps_volume(&matrix) {
                    let message = "the matrix flattens what it transforms (its determinant is 0)";
                    return Err(source.fault(&self.span, message).into());
                }
                DAffine3::from_mat3_translation(matrix, column(3))
            }
        })
    }
}

/// Whether the three columns span a volume, judged by their directions alone.
fn keeps_volume(m: &DMat3) -> bool {
    let columns = [m.x_axis, m.y_axis, m.z_axis];
    if columns.contains(&DVec3::ZERO) {
        return false;
    }
    let [a, b, c] = columns.map(|v| (v / v.abs().max_element()).normalize());
    a.dot(b.cross(c)).abs() > 1e-12
}

/// Quarter turns come out exact.
fn rotation(axis: DVec3, degrees: f64) -> DMat3 {
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        turn => (libm::sin(turn.to_radians()), libm::cos(turn.to_radians())),
    };
    let column = |v: DVec3| v * cos + axis.cross(v) * sin + axis * axis.dot(v) * (1.0 - cos);
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// Turns a file whose `up` axis points up so that y does.
pub(in crate::import) fn to_y_up(up: UpAxis) -> DAffine3 {
    match up {
        UpAxis::X => DAffine3::from_mat3(rotation(DVec3::Z, 90.0)),
        UpAxis::Y => DAffine3::IDENTITY,
        UpAxis::Z => DAffine3::from_mat3(rotation(DVec3::X, -90.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DQuat;

    #[test]
    fn rotations_are_right_handed_and_quarter_turns_exact() {
        assert_eq!(rotation(DVec3::Y, 90.0) * DVec3::Z, DVec3::X);
        assert_eq!(rotation(DVec3::Z, -270.0) * DVec3::X, DVec3::Y);
        let third = rotation(DVec3::ONE.normalize(), 120.0);
        assert!((third * DVec3::X - DVec3::Y).length() < 1e-15);
        let against = DMat3::from_quat(DQuat::from_axis_angle(DVec3::X, 0.3));
        let ours = rotation(DVec3::X, 0.3f64.to_degrees());
        assert!((ours - against).abs_diff_eq(DMat3::ZERO, 1e-15));
    }

    #[test]
    fn each_axis_comes_up() {
        for (axis, up) in [(UpAxis::X, DVec3::X), (UpAxis::Y, DVec3::Y), (UpAxis::Z, DVec3::Z)] {
            let turn = to_y_up(axis);
            assert_eq!(turn.transform_vector3(up), DVec3::Y);
            assert_eq!(turn.matrix3.determinant(), 1.0);
        }
    }
}
