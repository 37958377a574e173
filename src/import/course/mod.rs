//! The OBJ dialect of the graphics course that the source paper came from.
//!
//! `material` opens a material (`diffuse r g b` or `texture_file NAME`, `reflective r g b`,
//! `emitted r g b`, `roughness x`); `m N` selects material N, from 0; `v x y z` with an optional
//! `vt u v` after it; `f a b c d` (or three corners); `s x y z r` a sphere. Colours are linear.
//!
//! Faces that emit become area lights: a flat convex quad becomes one light, other faces several. In the course's
//! renderer lights shine to both sides, so ours do too (`two_sided`); the quad of `reflective_spheres.obj`
//! winds counter-clockwise seen from below and would light the scene under it in any case.
//! Spheres that emit become sphere lights.

mod statements;

use super::images::{ImageUse, Images};
use super::model::Model;
use super::source::{self, Notes};
use super::{lamps, polygon, tidy};
use crate::error::{Diagnostic, Error, Result};
use crate::math::{DVec3, Rgb, Vec2};
use crate::scene::{
    Corners, Light, Material, MaterialId, SphereLight, TextureMap, WorldMesh, WorldSphere,
};
use statements::{CourseMaterial, Face, File};
use std::path::Path;

/// Reads a file in the course's dialect. The meshes have no normals.
///
/// Errors: `Error::Input` with the line.
pub(super) fn read(path: &Path, text: &[u8]) -> Result<Model> {
    let mut file = statements::parse(text).map_err(|fault| fault.at(path))?;
    let mut model = Model { files: vec![path.to_path_buf()], ..Model::default() };
    let mut images = Images::default();
    let materials = std::mem::take(&mut file.materials);
    let named = materials.iter().filter_map(|material| material.texture.as_ref());
    images.read(named.map(|(_, name)| (source::beside(path, name), ImageUse::Colour)));
    for (number, material) in materials.iter().enumerate() {
        let converted = convert(path, number, material, &mut images, &mut model);
        model.world.materials.push(converted);
    }
    model.warnings.extend(std::mem::take(&mut file.notes).into_warnings(path));
    add_spheres(&file, &materials, &mut model);
    add_faces(path, &file, &materials, &mut model)?;
    let world = &model.world;
    if world.meshes.is_empty() && world.spheres.is_empty() && world.lights.is_empty() {
        let message = "no faces and no spheres: there is no surface to render";
        return Err(Error::input(path, message));
    }
    Ok(model)
}

fn convert(
    path: &Path,
    number: usize,
    source: &CourseMaterial,
    images: &mut Images,
    model: &mut Model,
) -> Material {
    let mut out = Material::diffuse(format!("material {number}"), source.diffuse);
    out.mirror = source.reflective;
    out.emission = source.emitted;
    out.emits_back = true;
    if let Some((line, name)) = &source.texture {
        let file = source::beside(path, name);
        match images.place(&file, ImageUse::Colour, &mut model.world, &mut model.files) {
            Ok(id) => {
                (out.texture, out.diffuse) = (Some(TextureMap::of(id)), Rgb::ONE);
                let doubt = images.doubt(&file, ImageUse::Colour);
                let warn = |doubt| {
                    let message = format!("material {number}: `texture_file` {name}: {doubt}");
                    Diagnostic::new(path, message).line(*line)
                };
                model.warnings.extend(doubt.map(warn));
            }
            Err(error) => {
                let message = format!("texture left out: {error}");
                model.warnings.push(Diagnostic::new(path, message).line(*line));
                out.diffuse = super::model::DEFAULT_ALBEDO;
            }
        }
    }
    out
}

fn add_spheres(file: &File, materials: &[CourseMaterial], model: &mut Model) {
    for (number, sphere) in file.spheres.iter().enumerate() {
        let radiance = sphere.material.map_or(Rgb::ZERO, |m| materials[m as usize].emitted);
        let (centre, radius) = (sphere.centre, sphere.radius);
        if radiance != Rgb::ZERO {
            model.world.lights.push(Light::Sphere(SphereLight { centre, radius, radiance }));
        } else {
            let material = sphere.material.unwrap_or_else(|| model.default_material());
            let name = format!("sphere {}", number + 1);
            model.world.spheres.push(WorldSphere::new(name, centre, radius, material));
        }
    }
}

fn add_faces(
    path: &Path,
    file: &File,
    materials: &[CourseMaterial],
    model: &mut Model,
) -> Result<()> {
    let mut dropped = 0;
    let slots = materials.len() + 1;
    let mut by_material: Vec<Vec<&Face>> = vec![Vec::new(); slots];
    for face in &file.faces {
        by_material[face.material.map_or(slots - 1, |m| m as usize)].push(face);
    }
    for (slot, faces) in by_material.into_iter().enumerate() {
        if faces.is_empty() {
            continue;
        }
        match materials.get(slot) {
            Some(material) if material.emitted != Rgb::ZERO => {
                for face in faces {
                    let lights = lamps::of_face(&corners_of(file, face), material.emitted)
                        .map_err(|message| Error::input(path, message))?;
                    dropped += usize::from(lights.is_empty());
                    model.world.lights.extend(lights);
                }
            }
            known => {
                let id = known.map_or_else(|| model.default_material(), |_| slot as MaterialId);
                let mut mesh = mesh_of(file, &faces, id, &mut dropped)
                    .map_err(|message| Error::input(path, message))?;
                mesh.name = model.world.materials[id as usize].name.clone();
                model.world.meshes.extend((!mesh.triangles.is_empty()).then_some(mesh));
            }
        }
    }
    model.warnings.extend(tidy::warning(path, dropped));
    Ok(())
}

fn corners_of(file: &File, face: &Face) -> Vec<DVec3> {
    face.corners.iter().map(|i| file.positions[*i as usize]).collect()
}

fn mesh_of(
    file: &File,
    faces: &[&Face],
    material: MaterialId,
    dropped: &mut usize,
) -> std::result::Result<WorldMesh, String> {
    let mut triangles = Vec::new();
    let mut local = Vec::new();
    for face in faces {
        local.clear();
        polygon::triangulate(&corners_of(file, face), &mut local)?;
        triangles.extend(local.iter().map(|t| t.map(|i| face.corners[i as usize])));
    }
    *dropped += tidy::drop_degenerate(&file.positions, &mut triangles, &mut []);
    let mut uv_triangles = triangles.clone();
    let positions = tidy::compact_owned(file.positions.clone(), &mut triangles);
    let has_uvs = uv_triangles.iter().flatten().any(|i| file.uvs[*i as usize].is_some());
    let uvs = has_uvs.then(|| {
        let values = file.uvs.iter().map(|uv| uv.unwrap_or(Vec2::ZERO)).collect();
        Corners { values: tidy::compact_owned(values, &mut uv_triangles), corners: None }
    });
    Ok(WorldMesh { uvs, ..WorldMesh::new("", positions, triangles, material) })
}
