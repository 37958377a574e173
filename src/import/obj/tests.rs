use super::*;
use crate::import::bench_terrain;
use crate::math::{DVec3, Vec2, Vec3};
use crate::scene::WorldMesh;
use std::fmt::Write;

fn read_text(text: &str) -> Model {
    read(Path::new("folder/test.obj"), text.as_bytes()).expect("a good file")
}

fn only_mesh(text: &str) -> WorldMesh {
    let model = read_text(text);
    assert_eq!(model.warnings, []);
    let [mesh] = &model.world.meshes[..] else { panic!("one mesh") };
    mesh.clone()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn weights_divide_and_indices_count_from_either_end() {
    let mesh = only_mesh(
        "v 0 0 0 2\nv 2 0 0 2\nf 1 2 -1\nv 0 3e0 0\nf -3 2 -1\n".replace("f 1 2 -1\n", "").as_str(),
    );
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, 3.0 * DVec3::Y]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.name, "test");
}

#[test]
fn faces_that_lack_an_attribute_do_not_borrow_one() {
    let mesh = only_mesh(&format!(
        "{SQUARE}vt .5 .25\nvt 1 1\nvn 0 0 3\nf 1/1/1 2/2/1 3/1/1\nf 1 3 4\nf 1/2 3 4//1\n"
    ));
    let normals = mesh.normals.as_ref().expect("normals");
    let uvs = mesh.uvs.as_ref().expect("uvs");
    let at = |prim: usize| {
        (normals.get(prim, mesh.triangles[prim]), uvs.get(prim, mesh.triangles[prim]))
    };
    let (a, b) = (Vec2::new(0.5, 0.25), Vec2::ONE);
    assert_eq!(at(0), ([Vec3::Z; 3], [a, b, a]));
    assert_eq!(at(1), ([Vec3::ZERO; 3], [Vec2::ZERO; 3]));
    assert_eq!(at(2), ([Vec3::ZERO, Vec3::ZERO, Vec3::Z], [b, Vec2::ZERO, Vec2::ZERO]));
}

#[test]
fn attributes_indexed_like_positions_have_no_indices_of_their_own() {
    let mesh = only_mesh(&format!(
        "{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\nvn 0 0 1\n\
         f 1/1/1 2/2/2 3/3/3 4/4/4\n"
    ));
    assert!(mesh.uvs.is_some_and(|uv| uv.corners.is_none() && uv.values.len() == 4));
    assert!(mesh.normals.is_some_and(|n| n.corners.is_none()));
}

#[test]
fn groups_of_one_material_are_one_mesh_of_its_own_vertices() {
    let model = read_text(&format!(
        "{SQUARE}o a\nf 1 2 3\nusemtl red\nf 1 3 4\ng b\nusemtl blue\nf 2 3 4\nusemtl red\nf 1 2 4\n\
         usemtl\nf 1 2 3\n"
    ));
    let meshes: Vec<_> =
        model.world.meshes.iter().map(|m| (&m.name[..], m.triangles.clone())).collect();
    let expected = [
        ("test", vec![[0, 1, 2], [0, 1, 2]]),
        ("red", vec![[0, 2, 3], [0, 1, 3]]),
        ("blue", vec![[0, 1, 2]]),
    ];
    assert_eq!(meshes, expected);
    assert_eq!(model.world.meshes[2].positions.len(), 3);
    assert_eq!(model.warnings.len(), 2, "two unknown materials");
    assert_eq!(model.world.materials.len(), 1);
}

#[test]
fn concave_faces_are_cut_inside() {
    let mesh = only_mesh("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 3 1 0\nv 0 1 0\nf 2 3 4 5 1\n");
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let z = (b - a).cross(c - a).z;
            assert!(z > 0.0);
            0.5 * z
        })
        .sum();
    assert!((area - 5.5).abs() < 1e-12);
}

/// Text of a mesh with every attribute, in `parts` materials.
fn big_text(parts: usize) -> (String, usize) {
    let terrain = bench_terrain("t", 120, 10.0, 0).expect("a terrain");
    let mut text = String::new();
    for p in &terrain.positions {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "v {} {} {}\nvt {} {}", p.x, p.y, p.z, p.x / 20.0, p.z / 20.0);
    }
    let _ = writeln!(text, "vn 0 1 0");
    for (number, [a, b, c]) in terrain.triangles.iter().enumerate() {
        if number % (terrain.triangles.len() / parts) == 0 {
            let _ = writeln!(text, "usemtl m{}", number % 7);
        }
        let (a, b, c) = (a + 1, b + 1, c + 1);
        let _ = writeln!(text, "f {a}/{a}/1 {b}/{b}/-1 {c}/{c}/1");
    }
    (text, terrain.triangles.len())
}

#[test]
fn tobj_reads_the_same_geometry() {
    let (text, triangles) = big_text(1);
    let mesh = read_text(&text).world.meshes.remove(0);
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, |_| {
        Ok((Vec::new(), Default::default()))
    })
    .expect("tobj reads it");
    let oracle = &models[0].mesh;
    assert_eq!((mesh.triangles.len(), oracle.indices.len()), (triangles, 3 * triangles));
    let uvs = mesh.uvs.as_ref().expect("uvs");
    for (prim, t) in mesh.triangles.iter().enumerate() {
        for (k, uv) in uvs.get(prim, *t).iter().enumerate() {
            let theirs = 3 * oracle.indices[3 * prim + k] as usize;
            assert_eq!(
                mesh.positions[t[k] as usize].to_array(),
                oracle.positions[theirs..theirs + 3]
            );
            let theirs = 2 * oracle.texcoord_indices[3 * prim + k] as usize;
            let theirs = &oracle.texcoords[theirs..theirs + 2];
            assert_eq!(uv.to_array(), [theirs[0] as f32, theirs[1] as f32]);
        }
    }
}

#[test]
fn chunks_make_no_difference() {
    let (text, triangles) = big_text(50);
    assert!(count::split(text.as_bytes()).len() == 1, "one chunk of its own");
    let whole = read_text(&text);
    // Comments push the text over many chunks.
    let padding = format!("#{}\n", "-".repeat(2000));
    let long: String = text
        .lines()
        .enumerate()
        .flat_map(|(i, line)| [if i % 20 == 0 { &padding[..] } else { "" }, line, "\n"])
        .collect();
    assert!(count::split(long.as_bytes()).len() > 1);
    let parts = read_text(&long);
    let total: usize = parts.world.meshes.iter().map(|m| m.triangles.len()).sum();
    assert_eq!(total, triangles);
    assert_eq!(format!("{:?}", whole.world.meshes), format!("{:?}", parts.world.meshes));
    let bad = long.clone() + "\nf 1 2 x\n";
    let error = read(Path::new("a.obj"), bad.as_bytes()).map(|_| ()).expect_err("a bad index");
    let line = bad.lines().count();
    assert!(error.to_string().starts_with(&format!("a.obj:{line}: ")), "{error}");
}

#[test]
fn smoothing_groups_are_no_spheres() {
    for text in ["s 1", "s off", "s 1 # 2 3", "m", "material red"] {
        assert!(!is_course_dialect(text.as_bytes()), "{text}");
    }
    for text in ["\n material \n", "m 0", "s 0 0 0 1"] {
        assert!(is_course_dialect(text.as_bytes()), "{text}");
    }
}

#[test]
fn meshes_with_and_without_vertex_colours_share_a_file() {
    let model = read_text(
        "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\nv 5 0 0\nv 6 0 0\nv 5 1 0\nusemtl gone\nf 4 5 6\n",
    );
    let [coloured, plain] = &model.world.meshes[..] else { panic!("two meshes") };
    let codes = coloured.colours.as_ref().and_then(|colours| colours.codes());
    assert_eq!(codes, Some(&[[255, 0, 0], [0, 255, 0], [255; 3]][..]));
    assert!(plain.colours.is_none());
    let of = |mesh: &WorldMesh| &model.world.materials[mesh.material as usize];
    assert!(of(coloured).vertex_colours && !of(plain).vertex_colours);
}

#[test]
fn vertex_colours_multiply_kd_and_give_way_to_a_texture() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("dot.ppm"), b"P6 1 1 255\n\x10\x20\x30").expect("written");
    let materials = "newmtl half\nKd .5 .5 .5\nnewmtl bare\nnewmtl image\nmap_Kd dot.ppm\n\
                     newmtl chrome\nillum 3\nKs 1 1 1\nKd 0 0 0\nnewmtl pane\nillum 4\nd 0.5\n";
    std::fs::write(at("m.mtl"), materials).expect("written");
    let mut text = "mtllib m.mtl\nv 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\n".to_string();
    for name in ["half", "bare", "image", "chrome", "pane"] {
        text += &format!("usemtl {name}\nf 1 2 3\n");
    }
    let model = read(&at("a.obj"), text.as_bytes()).expect("a good file");
    let shown = model.world.meshes.iter().map(|mesh| {
        let material = &model.world.materials[mesh.material as usize];
        // Where they are not shown, a scene file's own material may still ask for them.
        assert!(mesh.colours.is_some());
        (&mesh.name[..], material.vertex_colours, material.diffuse.x)
    });
    let expected = [
        ("half", true, 0.5),
        ("bare", true, 1.0),
        ("image", false, 1.0),
        ("chrome", false, 0.0),
        ("pane", false, 0.0),
    ];
    assert_eq!(shown.collect::<Vec<_>>(), expected);
    let given_way = |w: &crate::error::Diagnostic| w.message.contains("vertex colours are not");
    assert_eq!(model.warnings.iter().filter(|w| given_way(w)).count(), 1);
}
