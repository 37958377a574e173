use super::*;
use crate::import::{bench_terrain, load_model, uv_sphere};
use crate::math::{DVec3, Vec2};
use crate::scene::{Corners, NormalPolicy, World};

const AUTO: NormalPolicy = NormalPolicy::Auto { crease_degrees: 30.0 };

fn obj_to_ply(text: &str) -> (ConvertReport, World) {
    let folder = tempfile::tempdir().expect("a folder");
    let (obj, ply) = (folder.path().join("a.obj"), folder.path().join("b.PLY"));
    std::fs::write(&obj, text).expect("written");
    let report = convert(&obj, &ply, None).expect("converted");
    let size = std::fs::metadata(&ply).expect("there").len();
    assert_eq!(report.written.bytes, size);
    let files = std::fs::read_dir(folder.path()).expect("listed").count();
    assert_eq!(files, 2, "no temporary file stays");
    (report, load_model(&ply, AUTO).expect("read back").world)
}

#[test]
fn attributes_survive_by_splitting_vertices() {
    let (report, world) = obj_to_ply(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn -1 0 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
         f 1/1/1 2/2/1 3/3/1\nf 1/1/2 3/2/2 4/3/2\n",
    );
    assert_eq!((report.written.vertices, report.written.triangles), (6, 2));
    assert!(!report.written.doubles && report.warnings.is_empty());
    let mesh = &world.meshes[0];
    let normals = mesh.normals.as_ref().expect("normals");
    assert_eq!(normals.get(1, mesh.triangles[1]), [-crate::math::Vec3::X; 3]);
    let uvs = mesh.uvs.as_ref().expect("uvs");
    assert_eq!(uvs.get(1, mesh.triangles[1]), [Vec2::ZERO, Vec2::X, Vec2::Y]);
    assert_eq!(mesh.triangles[1].map(|i| mesh.positions[i as usize])[2], DVec3::Z);
}

#[test]
fn far_from_the_origin_positions_are_doubles() {
    let (report, world) =
        obj_to_ply("v 1000000.1 0 0\nv 1000001.1 0 0\nv 1000000.1 1 0\nf 1 2 3\n");
    assert!(report.written.doubles);
    assert_eq!(world.meshes[0].positions[0].x, 1_000_000.1);
    let (report, _) = obj_to_ply("v 1000000 0 0\nv 1000001 0 0\nv 1000000 1 0\nf 1 2 3\n");
    assert!(!report.written.doubles, "these are exact as floats");
}

#[test]
fn data_that_the_format_cannot_hold_gives_a_warning() {
    let (report, world) = obj_to_ply(
        "material\ndiffuse 1 0 0\nmaterial\nemitted 1 1 1\nm 0\ns 0 0 0 1\nm 1\n\
         v 0 5 0\nv 1 5 0\nv 1 5 1\nv 0 5 1\nf 1 2 3 4\n",
    );
    assert_eq!(report.written.triangles, 80_000);
    assert_eq!(report.warnings.len(), 3, "{:?}", report.warnings);
    assert!(report.written.normals && world.meshes[0].normals.is_some());
}

#[test]
fn meshes_with_and_without_normals_go_together() {
    let mut world = World::default();
    world.meshes.push(bench_terrain("t", 5, 1.0, 0).expect("a terrain"));
    world.meshes.push(uv_sphere("s", DVec3::Y, 1.0, 8, 5, 0).expect("a sphere"));
    let mut bytes = Vec::new();
    let report = write_ply(&world, &mut bytes, Path::new("x.ply")).expect("written");
    assert_eq!((report.vertices, report.triangles), (25 + 34, 32 + 64));
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x.ply");
    std::fs::write(&file, bytes).expect("written");
    let model = load_model(&file, AUTO).expect("read back");
    let Some(Corners { values, .. }) = &model.world.meshes[0].normals else { panic!("normals") };
    assert!(values[..25].iter().all(|n| *n == crate::math::Vec3::ZERO));
}

#[test]
fn other_endings_and_unwritable_places_are_errors() {
    let input = Path::new("/nowhere/a.obj");
    assert!(matches!(convert(input, Path::new("b.obj"), None), Err(Error::Usage(_))));
    assert!(matches!(
        convert(input, Path::new("b.ply"), None),
        Err(Error::Io { action: "read", .. })
    ));
    assert!(matches!(convert(input, Path::new("b.ply"), Some(1.0)), Err(Error::Usage(_))));
    let file = tempfile::NamedTempFile::new().expect("a file");
    let below = file.path().join("b.ply");
    let error = write_atomically(&below, |_| Ok(())).expect_err("a file is no folder");
    assert!(matches!(&error, Error::Io { path, .. } if *path == below), "{error}");
}
