//! `[[mesh]]` and `[[sphere]]`.

use super::at::{At, Span};
use super::file_name;
use super::generated::{Cuboid, Quad, Terrain, UvSphere};
use super::number::{Crease, Moment, Positive};
use super::report::Source;
use super::transform::Step;
use super::vector::Point;
use crate::error::Result;
use crate::import::UpAxis;
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
    /// Mesh file, relative to the scene file: .obj (with .mtl), .ply, .glb or .gltf.
    #[serde(default, deserialize_with = "file_name::placed")]
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
    /// Shading normals. "auto": the file's own where it has them, else as "smooth" (of glTF: "flat"); generated meshes keep
    /// their own. "flat": the normal of each triangle's plane. "smooth": averaged at each vertex.
    #[serde(default = "auto")]
    pub normals: Normals,
    /// Edges sharper than this angle stay sharp where normals are averaged, degrees.
    #[serde(default = "default_crease")]
    pub crease_angle: Crease,
    /// The axis that points up in the mesh file, "x", "y" or "z"; it is turned to y before
    /// `transform`. Absent: "y".
    pub up: Option<At<UpAxis>>,
    /// Moment at which a glTF file's animated meshes and lights stand, seconds. Absent: 0.
    pub time: Option<At<Moment>>,
    /// Steps that place the mesh, applied one after the other.
    #[serde(default)]
    pub transform: Vec<At<Step>>,
    /// Whether its light may be inferred from other frames; if not, it is traced in every frame.
    #[serde(default = "yes")]
    pub reuse: bool,
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
    /// Whether its light may be inferred from other frames; if not, it is traced in every frame.
    #[serde(default = "yes")]
    pub reuse: bool,
}

fn yes() -> bool {
    true
}

fn auto() -> Normals {
    Normals::Auto
}

fn default_crease() -> Crease {
    Crease(crate::import::DEFAULT_CREASE_DEGREES)
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
