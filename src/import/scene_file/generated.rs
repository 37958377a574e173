//! Meshes that need no file, as `[[mesh]]` names them.

use super::at::At;
use super::number::{Coordinate, Int, Positive};
use super::quad::{self, QuadShape};
use super::report::Source;
use super::vector::{Direction, List, Point, Size2};
use crate::error::Result;
use crate::math::DVec3;
use schemars::JsonSchema;
use serde::Deserialize;

/// A box with faces along the axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Cuboid {
    /// Corner with the smallest coordinates, world units.
    min: Point,
    /// Corner with the largest coordinates, world units.
    max: Point,
}

/// A parallelogram: either `corner` and `edges`, or `centre`, `normal` and `size`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("oneOf" = [
    {"required": ["corner", "edges"]}, {"required": ["centre", "normal", "size"]}
]))]
pub(super) struct Quad {
    /// One corner, world units.
    corner: Option<Point>,
    /// The two edges that leave the corner, as vectors, world units. The front looks towards
    /// their cross product, first times second.
    edges: Option<List<Point, 2>>,
    /// Middle of the rectangle, world units.
    centre: Option<Point>,
    /// Direction in which the front looks.
    normal: Option<Direction>,
    /// Width and height, world units. The width is level; where the normal is vertical it runs
    /// along x and the height along z.
    size: Option<Size2>,
}

/// A sphere of 2 · meridians · (bands - 1) triangles.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct UvSphere {
    /// Centre, world units.
    #[serde(default = "origin")]
    pub centre: Point,
    /// Radius, world units.
    #[serde(default = "one")]
    pub radius: Positive,
    /// Divisions around the equator.
    #[serde(default = "sphere_meridians")]
    pub meridians: Int<3, 65_535>,
    /// Divisions from pole to pole.
    #[serde(default = "sphere_bands")]
    pub bands: Int<2, 65_535>,
}

/// Rolling ground around the origin of 2 (vertices - 1)² triangles.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Terrain {
    /// Vertices along each side.
    #[serde(default = "terrain_vertices")]
    pub vertices: Int<2, 65_535>,
    /// Length of each side, world units. Heights do not scale with it.
    #[serde(default = "terrain_size")]
    pub size: Positive,
}

fn origin() -> Point {
    List([Coordinate(0.0); 3])
}

fn one() -> Positive {
    Positive(1.0)
}

fn sphere_meridians() -> Int<3, 65_535> {
    Int::clamped(200)
}

fn sphere_bands() -> Int<2, 65_535> {
    Int::clamped(101)
}

fn terrain_vertices() -> Int<2, 65_535> {
    Int::clamped(708)
}

fn terrain_size() -> Positive {
    Positive(20.0)
}

impl At<Cuboid> {
    /// Opposite corners.
    ///
    /// Errors: `min` not below `max` on an axis.
    pub fn corners(&self, source: &Source) -> Result<(DVec3, DVec3)> {
        let (min, max) = (self.min.vec(), self.max.vec());
        if min.cmplt(max).all() {
            return Ok((min, max));
        }
        let message = "`min` must be smaller than `max` on every axis of a box";
        Err(source.fault(&self.span, message).into())
    }
}

impl At<Quad> {
    /// Corners, counter-clockwise seen from the front.
    pub fn corners(&self, source: &Source) -> Result<[DVec3; 4]> {
        let shape = QuadShape {
            corner: self.corner.as_ref(),
            edges: self.edges.as_ref(),
            centre: self.centre.as_ref(),
            normal: self.normal.as_ref(),
            size: self.size.as_ref(),
        };
        quad::corners(&shape, source, &self.span)
    }
}

impl UvSphere {
    /// Triangles it will have.
    pub fn triangles(&self) -> u64 {
        2 * self.meridians.u64() * (self.bands.u64() - 1)
    }
}

impl Terrain {
    /// Triangles it will have.
    pub fn triangles(&self) -> u64 {
        2 * (self.vertices.u64() - 1).pow(2)
    }
}
