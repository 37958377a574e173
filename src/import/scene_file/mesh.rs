//! `[[mesh]]` and `[[sphere]]`.

use super::at::{At, Span};
use super::number::{Crease, Int, Positive};
use super::quad::{self, QuadShape};
use super::report::Source;
use super::transform::Step;
use super::vector::{Direction, List, Point, Size2};
use crate::error::Result;
use crate::import::UpAxis;
use crate::math::DVec3;
use crate::scene::NormalPolicy;
use schemars::JsonSchema;
use serde::Deserialize;

/// Triangles, from exactly one of `file`, `box`, `quad`, `uv_sphere` and `terrain`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("oneOf" = [
    {"required": ["file"]}, {"required": ["box"]}, {"required": ["quad"]},
    {"required": ["uv_sphere"]}, {"required": ["terrain"]}
]))]
pub(super) struct Mesh {
    /// Name in messages. Absent: the file's name or the kind.
    pub name: Option<String>,
    /// Mesh file, relative to the scene file: .obj (with .mtl) or .ply.
    pub file: Option<At<String>>,
    /// A box with faces along the axes.
    #[serde(rename = "box")]
    pub cuboid: Option<At<Cuboid>>,
    /// A flat rectangle or parallelogram.
    pub quad: Option<At<Quad>>,
    /// A sphere of triangles along meridians, shaded smooth.
    pub uv_sphere: Option<At<UvSphere>>,
    /// Rolling ground of any number of triangles, shaded flat.
    pub terrain: Option<At<Terrain>>,
    /// Name of a `[material.NAME]`. Absent: what the file says, else a light grey.
    pub material: Option<At<String>>,
    /// Shading normals: the file's own, where it has them, else smooth ("auto"), each triangle's
    /// plane ("flat"), or averaged at each vertex ("smooth"). Generated meshes keep their own
    /// under "auto".
    #[serde(default = "auto")]
    pub normals: Normals,
    /// Edges sharper than this angle stay sharp where normals are averaged, degrees.
    #[serde(default = "default_crease")]
    pub crease_angle: Crease,
    /// The axis that points up in the mesh file, "x", "y" or "z"; it is turned to y before
    /// `transform`. Absent: "y".
    pub up: Option<At<UpAxis>>,
    /// Steps that place the mesh, applied one after the other.
    #[serde(default)]
    pub transform: Vec<At<Step>>,
}

/// Where shading normals come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum Normals {
    /// The file's own where it has them, else smooth.
    Auto,
    /// Each triangle's plane.
    Flat,
    /// Averaged at each vertex over faces that meet at less than the crease angle.
    Smooth,
}

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

/// An exact sphere, without triangles.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Sphere {
    /// Name in messages. Absent: "sphere" and its number.
    pub name: Option<String>,
    /// Centre, world units.
    pub centre: Point,
    /// Radius, world units.
    pub radius: Positive,
    /// Name of a `[material.NAME]`. Absent: a light grey.
    pub material: Option<At<String>>,
}

fn auto() -> Normals {
    Normals::Auto
}

fn default_crease() -> Crease {
    Crease(crate::import::DEFAULT_CREASE_DEGREES)
}

fn origin() -> Point {
    List([super::number::Coordinate(0.0); 3])
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

/// Where a mesh's triangles come from.
pub(super) enum Shape<'a> {
    File(&'a At<String>),
    Cuboid(&'a At<Cuboid>),
    Quad(&'a At<Quad>),
    UvSphere(&'a At<UvSphere>),
    Terrain(&'a At<Terrain>),
}

impl Mesh {
    /// The one shape that the table gives.
    ///
    /// Errors: none, at `span`; more than one, at the second.
    pub fn shape(&self, source: &Source, span: &Span) -> Result<Shape<'_>> {
        let shapes = [
            self.file.as_ref().map(|s| (&s.span, Shape::File(s))),
            self.cuboid.as_ref().map(|s| (&s.span, Shape::Cuboid(s))),
            self.quad.as_ref().map(|s| (&s.span, Shape::Quad(s))),
            self.uv_sphere.as_ref().map(|s| (&s.span, Shape::UvSphere(s))),
            self.terrain.as_ref().map(|s| (&s.span, Shape::Terrain(s))),
        ];
        let mut given: Vec<_> = shapes.into_iter().flatten().collect();
        given.sort_by_key(|(span, _)| span.start);
        let help = "a mesh has exactly one of `file`, `box`, `quad`, `uv_sphere` and `terrain`";
        if let Some((second, _)) = given.get(1) {
            let message = "the mesh has its triangles from elsewhere already";
            return Err(source.fault(second, message).help(help).into());
        }
        match given.pop() {
            Some((_, shape)) => Ok(shape),
            None => Err(source.fault(span, "the mesh has no triangles").help(help).into()),
        }
    }

    /// How normals of a file's meshes come about.
    pub fn policy(&self) -> NormalPolicy {
        let crease_degrees = self.crease_angle.0;
        match self.normals {
            Normals::Auto => NormalPolicy::Auto { crease_degrees },
            Normals::Flat => NormalPolicy::Flat,
            Normals::Smooth => NormalPolicy::Smooth { crease_degrees },
        }
    }
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
