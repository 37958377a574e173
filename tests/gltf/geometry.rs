//! Positions, normals, coordinates and colours of meshes.

use super::build::{F32, File, I8, I16, U8, U16, U32, Written, bytes_of, warns};
use serde_json::json;
use std::f64::consts::FRAC_1_SQRT_2;
use tweenray::import::{LoadOptions, Model};
use tweenray::math::{DVec3, Rgb, Vec2, Vec3};
use tweenray::scene::WorldMesh;

fn only(model: &Model) -> &WorldMesh {
    let [mesh] = &model.world.meshes[..] else { panic!("one mesh: {:?}", model.world.meshes) };
    mesh
}

fn normal(mesh: &WorldMesh, triangle: usize) -> DVec3 {
    let [a, b, c] = mesh.triangles[triangle].map(|i| mesh.positions[i as usize]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn nodes_add_up_from_the_root_by_parts_and_by_matrices() {
    let mut file = File::triangle();
    file.json["nodes"] = json!([
        {"children": [1], "translation": [10, 0, 0], "rotation": [0, 0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]},
        {"children": [2], "matrix": [2, 0, 0, 0,  0, 2, 0, 0,  0, 0, 2, 0,  0, 5, 0, 1]},
        {"mesh": 0, "scale": [1, 3, 1], "name": "leaf"},
    ]);
    let model = file.model();
    let mesh = only(&model);
    // (1, 0) and (0, 1): scaled by (1, 3), by 2, raised by 5, turned by 90 degrees about z, moved by 10 along x.
    let expected = [[5.0, 0.0], [5.0, 2.0], [-1.0, 0.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    for (p, expected) in mesh.positions.iter().zip(expected) {
        assert!(p.distance(expected) < 1e-12, "{p} {expected}");
    }
    assert_eq!(mesh.name, "leaf");
}

#[test]
fn mirrored_nodes_keep_their_outside_and_sheared_ones_their_normals() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    file.json["nodes"] = json!([{"mesh": 0, "scale": [-1, 1, 1]}]);
    let model = file.model();
    assert_eq!(normal(only(&model), 0), DVec3::Z);
    assert_eq!(only(&model).normals.as_ref().expect("normals").values, [Vec3::Z; 3]);
    // x grows with z: planes turn, and normals with them.
    file.json["nodes"] =
        json!([{"mesh": 0, "matrix": [1, 0, 0.5, 0,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]}]);
    let model = file.model();
    let mesh = only(&model);
    let shaded = mesh.normals.as_ref().expect("normals").values[0].as_dvec3();
    assert!(normal(mesh, 0).distance(shaded) < 1e-6, "{shaded}");
    assert!(shaded.x < -0.4);
}

#[test]
fn a_node_that_flattens_its_mesh_leaves_what_has_an_area() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    file.json["nodes"] = json!([{"mesh": 0, "scale": [1, 1, 0]}, {"mesh": 0, "scale": [1, 0, 1]}]);
    let model = file.model();
    assert_eq!(normal(only(&model), 0), DVec3::Z);
    assert!(warns(&model.warnings, "a triangle without area was dropped"));
    assert!(model.world.into_scene(true).is_ok());
}

#[test]
fn strips_and_fans_wind_as_their_first_triangle_does() {
    // A zigzag, and the rim of a fan about its first vertex.
    let zigzag = [0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.];
    let fan = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., -1., 1., 0.];
    for (mode, positions, order) in [(5, zigzag, [0, 1, 2, 3, 4]), (6, fan, [0, 1, 2, 3, 4])] {
        for indexed in [false, true] {
            let mut file = File::new();
            let positions = file.floats("VEC3", &positions);
            let mut primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
            if indexed {
                primitive["indices"] = json!(file.indices(&order));
            }
            file.add("meshes", json!({"primitives": [primitive]}));
            file.add("nodes", json!({"mesh": 0}));
            let model = file.model();
            let mesh = only(&model);
            assert_eq!(mesh.triangles.len(), 3);
            assert!((0..3).all(|t| normal(mesh, t) == DVec3::Z), "{mode}: {:?}", mesh.triangles);
        }
    }
}

#[test]
fn points_and_lines_are_left_out_by_name() {
    let mut file = File::triangle();
    for mode in 0..4 {
        let primitive = json!({"attributes": {"POSITION": 0}, "mode": mode});
        file.json["meshes"][0]["primitives"].as_array_mut().expect("a list").push(primitive);
    }
    let model = file.model();
    assert_eq!(only(&model).triangles, [[0, 1, 2]]);
    assert!(warns(
        &model.warnings,
        "points and lines have no surface to render: left out (4 times)"
    ));
}

#[test]
fn sparse_accessors_change_elements_and_make_them_of_nothing() {
    let mut file = File::triangle();
    let (indices, values) = (file.view(&[2]), file.view(&bytes_of(&[0., 7., 1.])));
    let sparse = json!({
        "count": 1, "indices": {"bufferView": indices, "componentType": U8}, "values": {"bufferView": values},
    });
    file.json["accessors"][0]["sparse"] = sparse;
    let moved = file.model();
    assert_eq!(only(&moved).positions, [DVec3::ZERO, DVec3::X, DVec3::new(0.0, 7.0, 1.0)]);
    // All zero but for what is changed.
    let (indices, values) =
        (file.view(&[1, 0, 2, 0]), file.view(&bytes_of(&[3., 0., 0., 0., 3., 0.])));
    file.json["accessors"][0] = json!({
        "componentType": F32, "count": 3, "type": "VEC3", "sparse": {
            "count": 2, "indices": {"bufferView": indices, "componentType": U16}, "values": {"bufferView": values},
        },
    });
    assert_eq!(only(&file.model()).positions, [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 3.0]);
}

#[test]
fn integers_are_numbers_or_shares_of_the_largest() {
    let quantised = |component: u32, bytes: &[u8], normalised: bool| {
        let mut file = File::triangle();
        let view = file.view(bytes);
        // Elements of three components, four apart.
        let size = bytes.len() / 3;
        file.json["bufferViews"][view]["byteStride"] = json!(size);
        file.json["accessors"][0] = json!({
            "bufferView": view, "componentType": component, "count": 3, "type": "VEC3", "normalized": normalised,
        });
        file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        only(&file.model()).positions.clone()
    };
    let bytes = [0, 0, 0, 9, 127, 0, 0, 9, 0, 129, 0, 9];
    assert_eq!(quantised(I8, &bytes, true), [DVec3::ZERO, DVec3::X, DVec3::NEG_Y]);
    assert_eq!(quantised(I8, &bytes, false)[2], DVec3::Y * -127.0);
    let shares = quantised(U8, &bytes, true);
    assert_eq!(shares[2].y as f32, 129.0 / 255.0);
    let words: Vec<u8> = [0i16, 0, 0, 9, 32_767, 0, 0, 9, 0, -32_768, 0, 9]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    assert_eq!(quantised(I16, &words, true), [DVec3::ZERO, DVec3::X, DVec3::NEG_Y]);
    assert_eq!(quantised(U16, &words, false)[2], DVec3::Y * 32_768.0);
    assert_eq!(quantised(U16, &words, true)[1].x as f32, 32_767.0 / 65_535.0);
}

#[test]
fn attributes_may_lie_between_one_another() {
    let mut file = File::triangle();
    // Position and normal, vertex by vertex.
    let each = |p: [f32; 3]| [&p[..], &[0., 0., 2.][..]].concat();
    let all = [[0., 0., 0.], [4., 0., 0.], [0., 4., 0.]].map(each).concat();
    let view = file.view(&bytes_of(&all));
    file.json["bufferViews"][view]["byteStride"] = json!(24);
    let part = |offset: u32| json!({"bufferView": view, "byteOffset": offset, "componentType": F32, "count": 3, "type": "VEC3"});
    let (position, normal) = (file.add("accessors", part(0)), file.add("accessors", part(12)));
    file.primitive()["attributes"] = json!({"POSITION": position, "NORMAL": normal});
    let model = file.model();
    assert_eq!(only(&model).positions[1], DVec3::X * 4.0);
    assert_eq!(only(&model).normals.as_ref().expect("normals").values, [Vec3::Z; 3]);
}

#[test]
fn meshes_without_normals_are_flat_as_the_format_has_it() {
    assert!(only(&File::triangle().model()).normals.is_none());
}

#[test]
fn coordinates_are_turned_over_and_of_the_set_that_the_material_names() {
    let mut file = File::triangle().with_uvs();
    let second = file.accessor("VEC2", U8, 3, &[0, 0, 255, 0, 0, 51]);
    file.json["accessors"][second]["normalized"] = json!(true);
    file.primitive()["attributes"]["TEXCOORD_1"] = json!(second);
    let uvs = |file: &File| only(&file.model()).uvs.as_ref().expect("coordinates").values.clone();
    assert_eq!(uvs(&file), [Vec2::ZERO, Vec2::X, Vec2::Y]);
    let texture = file.image(1, &[[9; 4]], json!({}));
    let file = file.with_material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": texture, "texCoord": 1}},
    }));
    assert_eq!(uvs(&file), [Vec2::Y, Vec2::ONE, Vec2::new(0.0, 0.8)]);
}

#[test]
fn vertex_colours_are_linear_light() {
    let mut file = File::triangle();
    let colours =
        file.accessor("VEC4", U8, 3, &[255, 0, 51, 255, 0, 0, 0, 128, 255, 255, 255, 255]);
    file.json["accessors"][colours]["normalized"] = json!(true);
    file.primitive()["attributes"]["COLOR_0"] = json!(colours);
    let model = file.model();
    assert!(model.world.materials[only(&model).material as usize].vertex_colours);
    let colours = only(&model).colours.as_ref().expect("colours");
    assert_eq!(colours.of_vertex(0), Rgb::new(1.0, 0.0, 51.0 / 255.0));
    assert!(model.warnings.is_empty(), "what is opaque has no alpha");
    let blend = file.clone().with_material(json!({"alphaMode": "BLEND"})).model();
    assert!(warns(&blend.warnings, "the alpha of vertex colours is ignored"));
    let bright = file.floats("VEC3", &[2., 0., 0., -1., 0., 0., 0.5, 0.5, 0.5]);
    file.primitive()["attributes"]["COLOR_0"] = json!(bright);
    let model = file.model();
    assert_eq!(only(&model).colours.as_ref().expect("colours").of_vertex(0), Rgb::X);
    assert!(warns(&model.warnings, "vertex colours outside of 0 to 1 were cut to that (2 times)"));
}

#[test]
fn buffers_may_be_data_uris_or_files_with_encoded_names() {
    let file = File::triangle();
    let mut json = file.json.clone();
    // The nine floats of the triangle, of which 1 is 0x3f800000.
    let text =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    json["buffers"] = json!([{"byteLength": 36, "uri": text}]);
    let inside = Written::of("test.gltf", json.to_string().as_bytes()).model().expect("a model");
    assert_eq!(only(&inside).positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    json["buffers"] = json!([{"byteLength": 36, "uri": "a%20b.bin"}]);
    let written = Written::of("test.gltf", json.to_string().as_bytes());
    written.beside("a b.bin", &file.bytes);
    let beside = written.model().expect("a model");
    assert_eq!(only(&beside).positions, only(&inside).positions);
    assert_eq!(beside.files.len(), 2);
}

#[test]
fn the_default_scene_is_shown_else_the_first_else_everything() {
    let mut file = File::triangle();
    file.json["nodes"] =
        json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}, {"mesh": 0, "name": "c"}]);
    let names = |file: &File| -> Vec<String> {
        file.model().world.meshes.iter().map(|mesh| mesh.name.clone()).collect()
    };
    assert_eq!(names(&file), ["a", "b", "c"]);
    file.json["scenes"] = json!([{"nodes": [1]}, {"nodes": [2, 0]}]);
    assert_eq!(names(&file), ["b"]);
    file.json["scene"] = json!(1);
    assert_eq!(names(&file), ["c", "a"]);
    file.json["nodes"][2]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    assert_eq!(names(&file), ["a"]);
}

#[test]
fn instances_are_copies_and_inspected_as_such() {
    let mut file = File::triangle();
    let places = file.floats("VEC3", &[0., 0., 0., 5., 0., 0.]);
    let turns = file.floats("VEC4", &[0., 0., 0., 1., 0., 0., 1., 0.]);
    let scales = file.floats("VEC3", &[1., 1., 1., 2., 2., 2.]);
    file.json["nodes"] = json!([{"mesh": 0, "translation": [0, 0, 1], "extensions": {"EXT_mesh_gpu_instancing": {
        "attributes": {"TRANSLATION": places, "ROTATION": turns, "SCALE": scales},
    }}}]);
    file.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let model = file.model();
    let mesh = only(&model);
    assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
    let expected =
        [DVec3::new(5.0, 0.0, 1.0), DVec3::new(3.0, 0.0, 1.0), DVec3::new(5.0, -2.0, 1.0)];
    assert!(mesh.positions[3..].iter().zip(expected).all(|(p, e)| p.distance(e) < 1e-12));
    // A copy of 3 vertices and a triangle of 12 bytes each.
    let repeats = file.loaded().repeats;
    assert_eq!((repeats.copies, repeats.bytes), (1, 48));
    assert_eq!(File::triangle().loaded().repeats.copies, 0);
    let mut twice = File::triangle();
    twice.add("nodes", json!({"mesh": 0, "translation": [0, 0, 4]}));
    let loaded = twice.loaded_with(&LoadOptions::default());
    assert_eq!((loaded.repeats.copies, loaded.repeats.bytes), (1, 48));
}

#[test]
fn indices_of_every_size_are_read() {
    for (component, bytes) in [
        (U8, vec![2, 0, 1]),
        (U16, vec![2, 0, 0, 0, 1, 0]),
        (U32, vec![2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]),
    ] {
        let mut file = File::triangle();
        let indices = file.accessor("SCALAR", component, 3, &bytes);
        file.primitive()["indices"] = json!(indices);
        assert_eq!(only(&file.model()).triangles, [[2, 0, 1]]);
    }
}

#[test]
fn a_scene_file_takes_a_gltf_file_as_a_mesh() {
    use super::build::Written;
    let scene = "[[mesh]]\nfile = 'part.glb'\ntransform = [{ translate = [0, 3, 0] }]\n[sky]\nradiance = 1\n";
    let written = Written::of("scene.toml", scene.as_bytes());
    written.beside("part.glb", &File::triangle().glb());
    let world = written.load(&LoadOptions::default()).expect("a scene").world;
    assert_eq!(world.meshes[0].positions[0], DVec3::Y * 3.0);
}

#[test]
fn a_file_that_a_scene_places_again_is_a_copy() {
    use super::build::Written;
    let part = "[[mesh]]\nfile = 'part.glb'\n";
    let scene = format!("{}[sky]\nradiance = 1\n", part.repeat(3));
    let written = Written::of("scene.toml", scene.as_bytes());
    written.beside("part.glb", &File::triangle().glb());
    let repeats = written.load(&LoadOptions::default()).expect("a scene").repeats;
    assert_eq!((repeats.copies, repeats.bytes), (2, 96));
}
