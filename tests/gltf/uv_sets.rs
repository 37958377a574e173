//! Images of one material that lie by different sets of texture coordinates.

use super::build::{File, warns};
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;
use tweenray::intersect;
use tweenray::math::{Rgb, Vec2};
use tweenray::scene::{IntersectorKind, TextureMap};
use tweenray::shade::Renderer;

/// Numbers of the material's maps: base colour, roughness, metal, normals.
fn sets(file: &File) -> [u8; 4] {
    let material = &file.model().world.materials[0];
    let metal = material.fresnel.and_then(|f| f.metallic_map);
    let normals = material.normal_map.map(|map| map.image);
    let set = |map: Option<TextureMap>| map.expect("a map").uv_set;
    [set(material.texture), set(material.roughness_map), set(metal), set(normals)]
}

/// Adds set number `set` to the first primitive.
fn add_set(file: &mut File, set: usize, uvs: &[f32]) {
    let uvs = file.floats("VEC2", uvs);
    file.primitive()["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
}

#[test]
fn each_image_lies_by_the_set_that_it_names() {
    let mut file = File::triangle().with_uvs();
    add_set(&mut file, 1, &[0.25, 0.0, 0.5, 0.0, 0.75, 0.0]);
    add_set(&mut file, 2, &[0.0; 6]);
    add_set(&mut file, 3, &[0.125, 1.0, 0.25, 1.0, 0.375, 1.0]);
    let texture = file.image(1, &[[9; 4]], json!({}));
    let file = file.with_material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture, "texCoord": 3},
            "metallicRoughnessTexture": {"index": texture, "texCoord": 0},
        },
        "normalTexture": {"index": texture, "texCoord": 0, "extensions": {
            "KHR_texture_transform": {"texCoord": 1},
        }},
        "occlusionTexture": {"index": texture, "texCoord": 2},
    }));
    // The base colour's set goes first; nothing is read for the occlusion.
    assert_eq!(sets(&file), [0, 2, 2, 1]);
    let model = file.model();
    let mesh = &model.world.meshes[0];
    let values = |set| mesh.uv_set(set).map(|uvs| uvs.values.clone());
    assert_eq!(values(0), Some([0.125, 0.25, 0.375].map(|u| Vec2::new(u, 0.0)).to_vec()));
    assert_eq!(values(1), Some([0.25, 0.5, 0.75].map(|u| Vec2::new(u, 1.0)).to_vec()));
    assert_eq!(values(2), Some(vec![Vec2::ZERO, Vec2::X, Vec2::Y]));
    assert_eq!(mesh.more_uvs.len(), 2);
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
}

#[test]
fn a_set_that_the_mesh_lacks_is_named_and_moves_no_other() {
    let mut file = File::triangle();
    add_set(&mut file, 1, &[0.25, 0.0, 0.5, 0.0, 0.75, 0.0]);
    let texture = file.image(1, &[[128, 128, 255, 255]], json!({}));
    let file = file.with_material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": texture},
            "metallicRoughnessTexture": {"index": texture, "texCoord": 1},
        },
        "normalTexture": {"index": texture, "texCoord": 0},
    }));
    assert_eq!(sets(&file), [0, 1, 1, 0]);
    let loaded = file.loaded();
    let mesh = &loaded.world.meshes[0];
    assert!(mesh.uv_set(0).is_none() && mesh.uv_set(1).is_some());
    let lacks = "lacks a set of texture coordinates: ";
    assert!(warns(&loaded.warnings, &format!("{lacks}of the material `material 0` it shows")));
    assert!(loaded.warnings.iter().any(|w| w.message.contains("tilts none of its normals")));
    assert!(!warns(&loaded.warnings, "one `roughness`"), "{:?}", loaded.warnings);
}

#[test]
fn a_set_of_another_length_or_without_end_is_refused() {
    let with = |uvs: &[f32]| {
        let mut file = File::triangle().with_uvs();
        add_set(&mut file, 1, uvs);
        let texture = file.image(1, &[[9; 4]], json!({}));
        let file = file.with_material(json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}},
            "normalTexture": {"index": texture, "texCoord": 1},
        }));
        file.try_model().err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert!(with(&[0.0; 4]).contains("TEXCOORD_1: an attribute of 2 elements for 3 vertices"));
    assert!(with(&[0.0, 0.0, f32::NAN, 0.0, 0.0, 0.0]).contains("accessors"));
    assert_eq!(with(&[0.0; 6]), "");
}

#[test]
fn unused_vertices_mirrors_and_instances_keep_the_sets_together() {
    // Vertex 0 is of no triangle; a node that mirrors places the mesh twice.
    let mut file = File::new();
    let positions = [9., 9., 9., 0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let positions = file.floats("VEC3", &positions);
    let triangle = file.indices(&[1, 2, 3]);
    let attributes = json!({"POSITION": positions});
    file.add("meshes", json!({"primitives": [{"attributes": attributes, "indices": triangle}]}));
    let places = file.floats("VEC3", &[0., 0., 0., 0., 0., 5.]);
    let instances = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    file.add("nodes", json!({"mesh": 0, "scale": [-1, 1, 1], "extensions": instances}));
    add_set(&mut file, 0, &[0.9, 0.9, 0.1, 1.0, 0.2, 1.0, 0.3, 1.0]);
    add_set(&mut file, 1, &[0.9, 0.9, 0.4, 1.0, 0.5, 1.0, 0.6, 1.0]);
    let texture = file.image(1, &[[9; 4]], json!({}));
    let model = file
        .with_material(json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}},
            "normalTexture": {"index": texture, "texCoord": 1},
        }))
        .model();
    let mesh = &model.world.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (6, 2));
    for (set, us) in [(0, [0.1, 0.2, 0.3]), (1, [0.4, 0.5, 0.6])] {
        let uvs = mesh.uv_set(set).expect("a set");
        for (prim, triangle) in mesh.triangles.iter().enumerate() {
            for (at, uv) in triangle.iter().zip(uvs.get(prim, *triangle)) {
                let p = mesh.positions[*at as usize];
                let vertex = if p.x < -0.5 { 1 } else { 2 * usize::from(p.y > 0.5) };
                assert_eq!(uv, Vec2::new(us[vertex], 0.0), "{set} {p}");
            }
        }
    }
}

/// A floor that is seen at a grazing angle, with an image of each kind: base colour by set 0, metal, roughness and normals by a set
/// that is turned, stretched and moved against it. Either as set 1, or `by_transform` as set 0 with the same move in the material.
fn floor(by_transform: bool) -> File {
    let mut file = File::new();
    let corners = [[-1.0f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions: Vec<f32> = corners.iter().flat_map(|[x, y]| [4.0 * x, 0.0, -4.0 * y]).collect();
    let positions = file.floats("VEC3", &positions);
    let triangles = file.indices(&[0, 1, 2, 0, 2, 3]);
    let attributes = json!({"POSITION": positions});
    file.add("meshes", json!({"primitives": [{"attributes": attributes, "indices": triangles}]}));
    file.add("nodes", json!({"mesh": 0}));
    // In the file v points down.
    let first = corners.map(|[x, y]| [0.5 + 0.5 * x, 0.5 - 0.5 * y]);
    let (angle, scale, offset) = (0.6f64, [2.0f64, 3.0], [0.3f64, 0.1]);
    let (sin, cos) = angle.sin_cos();
    let moved = first.map(|uv| {
        let [u, v] = [0, 1].map(|k| scale[k] * f64::from(uv[k]));
        [u * cos + v * sin + offset[0], v * cos - u * sin + offset[1]].map(|x| x as f32)
    });
    add_set(&mut file, 0, first.as_flattened());
    let mut info = json!({"texCoord": 1});
    if by_transform {
        let transform = json!({"offset": offset, "rotation": angle, "scale": scale});
        info = json!({"extensions": {"KHR_texture_transform": transform}});
    } else {
        add_set(&mut file, 1, moved.as_flattened());
    }
    let mut image = |edge: u32, texel: fn(u32, u32) -> [u8; 3]| {
        let texel = |at: u32| {
            let [r, g, b] = texel(at % edge, at / edge);
            [r, g, b, 255]
        };
        let texels: Vec<[u8; 4]> = (0..edge * edge).map(texel).collect();
        file.image(edge, &texels, json!({}))
    };
    let base = image(32, |x, y| if (x + y) % 2 == 0 { [240, 60, 20] } else { [30, 90, 200] });
    let rough = image(16, |x, y| [0, 90 + 7 * x as u8, if y % 4 < 2 { 255 } else { 20 }]);
    let normal = image(16, |x, y| {
        [[80, 128, 240], [190, 128, 240], [128, 170, 245]][(x + 2 * y) as usize % 3]
    });
    let laid = |index: usize, info: &Value| {
        let mut info = info.clone();
        info["index"] = json!(index);
        info
    };
    file.with_material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": laid(base, &json!({})),
            "metallicRoughnessTexture": laid(rough, &info),
        },
        "normalTexture": laid(normal, &info),
    }))
}

/// The picture of a file, by the intersector.
fn picture(file: &File, kind: IntersectorKind) -> Vec<Rgb> {
    let mut loaded = file.loaded();
    loaded.settings.intersector = kind;
    (loaded.settings.spp, loaded.settings.shadow_samples) = (1, 4);
    (loaded.settings.width, loaded.settings.height) = (64, 48);
    let settings = &loaded.settings;
    let scene = loaded.world.clone().into_scene(true).expect("a scene");
    let intersector = intersect::build(&scene, settings, 1).expect("an intersector");
    let renderer = Renderer::new(&scene, settings, &*intersector);
    let camera = loaded.shot.camera(1, settings.width, settings.height).expect("a camera");
    let film = renderer.render(&camera, 1, true, &AtomicBool::new(false), &()).expect("a film").0;
    film.rgb
}

#[test]
fn a_second_set_shows_what_a_transform_of_the_first_shows() {
    for kind in [IntersectorKind::Embree, IntersectorKind::Oracle] {
        let [sets, transform] = [false, true].map(|by| picture(&floor(by), kind));
        let off = |(a, b): (&Rgb, &Rgb)| (*a - *b).abs().max_element();
        let worst = sets.iter().zip(&transform).map(off).fold(0.0, f32::max);
        assert!(worst < 1e-3, "{kind:?}: {worst}");
        // Not vacuous: by the first set the images show something else.
        let mut one = floor(false);
        one.json["materials"][0]["normalTexture"]["texCoord"] = json!(0);
        let others = picture(&one, kind);
        let differ = sets.iter().zip(&others).filter(|pair| off((pair.0, pair.1)) > 0.01).count();
        assert!(differ > sets.len() / 20, "{differ}");
    }
}
