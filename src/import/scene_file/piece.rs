//! One entry of `[[mesh]]` on its way into the world: made, named, placed.

use super::mesh::Mesh;
use super::report::{Source, nearest};
use super::transform;
use crate::error::{Error, Result};
use crate::import;
use crate::math::DVec3;
use crate::scene::{World, WorldMesh};
use std::path::Path;

/// The generator rounds to six decimals; smaller spheres are made large and shrunk.
const LEAST_ROUNDED_RADIUS: f64 = 0.01;

/// The generator's sphere, whatever its size.
///
/// Errors: as [`import::uv_sphere`].
pub(super) fn uv_sphere(
    radius: f64,
    centre: DVec3,
    meridians: u32,
    bands: u32,
) -> Result<WorldMesh> {
    if radius >= LEAST_ROUNDED_RADIUS {
        return import::uv_sphere("uv_sphere", centre, radius, meridians, bands, 0);
    }
    let origin = DVec3::ZERO;
    let mut mesh = import::uv_sphere("uv_sphere", origin, 1.0, meridians, bands, 0)?;
    mesh.positions.iter_mut().for_each(|p| *p = *p * radius + centre);
    Ok(mesh)
}

/// A lone mesh takes the name, several prefix it.
pub(super) fn name_meshes(piece: &mut World, name: Option<&str>) {
    let Some(name) = name else { return };
    let names = piece.meshes.iter_mut().map(|m| &mut m.name);
    let mut names: Vec<&mut String> =
        names.chain(piece.spheres.iter_mut().map(|s| &mut s.name)).collect();
    if let [only] = names.as_mut_slice() {
        name.clone_into(only);
    } else {
        names.into_iter().for_each(|n| *n = format!("{name}/{n}"));
    }
}

/// Moves the piece as `up` and `transform` say.
///
/// Errors: a transform that flattens, or deforms an exact sphere; `up` without a file.
pub(super) fn place(piece: &mut World, mesh: &Mesh, source: &Source) -> Result<()> {
    let up = match &mesh.up {
        Some(up) if mesh.file.is_none() => {
            let message = "`up` is for mesh files; turn a generated mesh by `transform`";
            return Err(source.fault(&up.span, message).into());
        }
        Some(up) => transform::to_y_up(up.value),
        None => Default::default(),
    };
    let whole = transform::combine(&mesh.transform, source)? * up;
    if whole == Default::default() {
        return Ok(());
    }
    piece.apply_transform(&whole).map_err(|error| match (error, mesh.transform.first()) {
        (Error::Usage(what), Some(step)) => source.fault(&step.span, what).into(),
        (other, _) => other,
    })
}

/// The name of a file in the folder of `path` that it most likely stands for.
pub(super) fn nearest_file(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_string_lossy().into_owned();
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).ok()?;
    let mut names: Vec<String> =
        entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    let known: Vec<&str> = names.iter().map(String::as_str).collect();
    nearest(&wanted, &known).map(str::to_owned)
}
