//! Malformed mesh files: no panic, each a typed error with its place, or accepted with the
//! warning that is stated here.

#![allow(clippy::expect_used)]

mod mtl;
mod mutations;
mod obj;
mod ply;
#[path = "../common/says.rs"]
mod says;

use says::says;
use std::path::Path;
use tweenray::error::{Error, Result};
use tweenray::import::{Model, load_model};
use tweenray::scene::NormalPolicy;

/// What must come of a file.
pub(crate) enum Expect {
    /// `Error::Input` on this line, whose message [`says`] this.
    Line(usize, &'static str),
    /// `Error::Input` without a line (binary data say the byte), whose message [`says`] this.
    File(&'static str),
    /// A model, with a warning on this line that [`says`] this.
    Warns(usize, &'static str),
    /// A model without a warning.
    Fine,
}

pub(crate) fn load(path: &Path) -> Result<Model> {
    load_model(path, NormalPolicy::Auto { crease_degrees: 30.0 })
}

/// Loads `content` as a file with the given ending, beside the files `others`.
pub(crate) fn load_bytes(ending: &str, content: &[u8], others: &[(&str, &[u8])]) -> Result<Model> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, content) in others {
        std::fs::write(folder.path().join(name), content).expect("written");
    }
    let path = folder.path().join(format!("bad.{ending}"));
    std::fs::write(&path, content).expect("written");
    load(&path)
}

/// Checks an outcome; `what` names the case.
pub(crate) fn check(what: &str, outcome: Result<Model>, expect: &Expect) {
    match (outcome, expect) {
        (Ok(model), Expect::Fine) => {
            assert!(model.warnings.is_empty(), "{what}: {:?}", model.warnings);
            sound(&model);
        }
        (Ok(model), Expect::Warns(line, part)) => {
            let found =
                model.warnings.iter().any(|w| w.line == Some(*line) && says(&w.message, part));
            assert!(found, "{what}: no warning `{part}` on line {line} in {:?}", model.warnings);
            sound(&model);
        }
        (Err(Error::Input(d)), Expect::Line(line, part)) => {
            assert!(
                d.line == Some(*line) && says(&d.message, part),
                "{what}: `{d}` instead of `{part}` on line {line}"
            );
        }
        (Err(Error::Input(d)), Expect::File(part)) => {
            assert!(d.line.is_none() && says(&d.message, part), "{what}: `{d}`, not `{part}`");
        }
        (Ok(model), _) => panic!("{what}: accepted, with {:?}", model.warnings),
        (Err(error), _) => panic!("{what}: `{error}`"),
    }
}

/// The promise of `WorldMesh`: indices in range, numbers finite, lists of one length.
pub(crate) fn sound(model: &Model) {
    let world = &model.world;
    for mesh in &world.meshes {
        assert!((mesh.material as usize) < world.materials.len());
        assert!(mesh.positions.iter().all(|p| p.is_finite()));
        let in_range = |t: &[u32; 3], n: usize| t.iter().all(|i| (*i as usize) < n);
        assert!(mesh.triangles.iter().all(|t| in_range(t, mesh.positions.len())));
        let check = |corners: &Option<Vec<[u32; 3]>>, count: usize| match corners {
            Some(c) => {
                assert_eq!(c.len(), mesh.triangles.len());
                assert!(c.iter().all(|t| in_range(t, count)));
            }
            None => assert_eq!(count, mesh.positions.len()),
        };
        if let Some(n) = &mesh.normals {
            check(&n.corners, n.values.len());
            let good = |n: f32| n == 0.0 || (n - 1.0).abs() < 1e-5;
            assert!(n.values.iter().all(|n| good(n.length())));
        }
        if let Some(uv) = &mesh.uvs {
            check(&uv.corners, uv.values.len());
            assert!(uv.values.iter().all(|uv| uv.is_finite()));
        }
    }
    assert!(world.spheres.iter().all(|s| s.radius > 0.0 && s.centre.is_finite()));
    assert!(world.spheres.iter().all(|s| (s.material as usize) < world.materials.len()));
    let textures = world.materials.iter().filter_map(|m| m.texture);
    assert!(textures.into_iter().all(|t| (t.image as usize) < world.textures.len()));
}
