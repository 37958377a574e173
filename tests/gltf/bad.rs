//! Hostile files: each is refused at once, with its place and what is wrong.

use super::build::{F32, File, U8, Written, glb_of};
use serde_json::{Value, json};
use tweenray::error::Error;

/// The message about a file, without its name.
fn refusal(name: &str, content: &[u8]) -> String {
    let written = Written::of(name, content);
    let error = written.model().expect_err("refused");
    assert!(matches!(error, Error::Input(_)), "{error}");
    let start = format!("{}: ", written.path.display());
    let text = error.to_string();
    text.strip_prefix(&start).unwrap_or(&text).to_owned()
}

/// Changes the value at a JSON pointer, whose parents are there, and gives the refusal.
fn changed(pointer: &str, value: Value) -> String {
    changed_in(File::triangle(), pointer, value)
}

fn changed_in(mut file: File, pointer: &str, value: Value) -> String {
    let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
    let parent = file.json.pointer_mut(parent).expect("its parent");
    match parent {
        Value::Array(list) => list.push(value),
        object => object[key] = value,
    }
    refusal("test.glb", &file.glb())
}

#[test]
fn containers_that_lie_are_refused() {
    let glb = File::triangle().glb();
    let with = |at: usize, bytes: &[u8]| {
        let mut glb = glb.clone();
        glb[at..at + bytes.len()].copy_from_slice(bytes);
        refusal("test.glb", &glb)
    };
    assert_eq!(refusal("test.glb", &[]), "the file is empty");
    let length = glb.len();
    assert_eq!(refusal("test.glb", b"glTF\x02"), "a .glb of 5 bytes: its header alone has 12");
    assert_eq!(with(4, &[1]), "a .glb of version 1; version 2 can be read");
    assert_eq!(
        with(8, &u32::MAX.to_le_bytes()),
        format!(
            "the header says 4294967295 bytes, the file has {length}: it is cut off or damaged"
        )
    );
    assert_eq!(
        with(12, &u32::MAX.to_le_bytes()),
        "the chunk at byte 12 goes beyond the end of the file"
    );
    assert_eq!(with(16, b"TEXT"), "the first chunk of the .glb is not JSON");
    assert_eq!(
        refusal("test.glb", &glb[..length - 4]),
        format!(
            "the header says {length} bytes, the file has {}: it is cut off or damaged",
            length - 4
        )
    );
}

#[test]
fn json_that_is_damaged_is_refused_with_line_and_column() {
    let written = Written::of("test.gltf", b"{\n  \"asset\": {,\n}");
    let Err(Error::Input(d)) = written.model() else { panic!("refused") };
    assert_eq!((d.line, d.column), (Some(2), Some(13)));
    assert_eq!(d.message, "the JSON of the file is damaged: key must be a string");
    let marked = [b"\xef\xbb\xbf".as_slice(), File::new().json.to_string().as_bytes()].concat();
    assert!(Written::of("test.gltf", &marked).model().is_ok(), "a byte order mark");
    let help = "\n  help: export the file again, or check it with a glTF validator";
    let nested = "[".repeat(100_000);
    let deep = refusal("test.glb", &glb_of(nested.as_bytes(), b""));
    assert_eq!(deep, format!("the JSON of the file is damaged: recursion limit exceeded{help}"));
    let list = refusal("test.glb", &glb_of(b"[1]", b""));
    assert_eq!(list, "the JSON is no object: this is not a glTF file");
}

#[test]
fn files_of_another_version_are_refused_with_what_to_do() {
    let of = |json: &str| refusal("test.glb", &glb_of(json.as_bytes(), b""));
    let help = "\n  help: export or convert it to glTF 2.0";
    let unknown = format!("`asset` is missing: this is no glTF 2.0{help}");
    assert_eq!(of("{}"), unknown);
    assert_eq!(of(r#"{"asset":{}}"#), format!("asset: `version` is missing{help}"));
    for (asset, version) in [
        (r#"{"version":"1.0"}"#, "1.0"),
        (r#"{"version":"x"}"#, "x"),
        (r#"{"version":"2.0","minVersion":"2.1"}"#, "2.1"),
    ] {
        let expected = format!("asset: glTF of version `{version}`; version 2.0 can be read{help}");
        assert_eq!(of(&format!(r#"{{"asset":{asset}}}"#)), expected);
    }
    for asset in [json!({"version": "2.1"}), json!({"version": "2.1", "minVersion": "2.0"})] {
        let mut file = File::triangle();
        file.json["asset"] = asset;
        file.model();
    }
}

#[test]
fn what_is_there_only_in_a_packed_form_is_refused_with_what_to_do() {
    let refused = |file: &File, start: &str, help: &str| {
        let refused = refusal("test.glb", &file.glb());
        assert!(refused.starts_with(start) && refused.contains(help), "{refused}");
    };
    let mut file = File::triangle();
    file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    let draco =
        json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    file.json["meshes"][0]["primitives"][0]["extensions"] = draco;
    let start = "meshes[0].primitives[0]: `KHR_draco_mesh_compression` is not read";
    refused(&file, start, "untick Compression");
    let mut json = File::triangle().json;
    let meshopt = json!({"EXT_meshopt_compression": {"fallback": true}});
    json["buffers"] = json!([{"byteLength": 36, "extensions": meshopt}]);
    let meshopt = refusal("test.gltf", json.to_string().as_bytes());
    let start = "buffers[0]: `EXT_meshopt_compression` is not read";
    assert!(meshopt.starts_with(start) && meshopt.contains("without -c"), "{meshopt}");
    for (bytes, format, help) in [
        (&b"\xabKTX 20\xbb\r\n\x1a\n...."[..], "KTX", "not KTX2"),
        (b"RIFF\x04\0\0\0WEBPVP8 ", "WebP", "untick WebP"),
        (b"\0\0\0\x1cftypavif", "AVIF", "not AVIF"),
        (b"DDS |\0\0\0", "DDS", "not DDS"),
    ] {
        let mut file = File::triangle().with_uvs();
        let view = file.view(bytes);
        file.json["images"] = json!([{"bufferView": view}]);
        file.json["textures"] = json!([{"source": 0}]);
        let info = json!({"baseColorTexture": {"index": 0}});
        let file = file.with_material(json!({"pbrMetallicRoughness": info}));
        refused(&file, &format!("images[0]: the image is {format}, which is not read"), help);
    }
}

#[test]
fn counts_and_offsets_that_lie_are_refused_before_memory_is_taken() {
    let cases = [
        (
            "/accessors/0/count",
            json!(4_000_000_000u64),
            "accessors[0]: 4000000000 elements; the file's buffers have 36 bytes together",
        ),
        (
            "/accessors/0/count",
            json!(4),
            "accessors[0]: 4 elements of 12 bytes, 12 bytes apart from byte 0 on, do not fit into a buffer view of 36 bytes",
        ),
        (
            "/accessors/0/byteOffset",
            json!(u64::MAX),
            "accessors[0]: 3 elements of 12 bytes, 12 bytes apart from byte 18446744073709551615 on, do not fit into a buffer view of 36 bytes",
        ),
        (
            "/accessors/0/count",
            json!(-1),
            "accessors[0].count: expected a whole number, found a number",
        ),
        (
            "/accessors/0/count",
            json!("3"),
            "accessors[0].count: expected a whole number, found a text",
        ),
        (
            "/accessors/0/componentType",
            json!(5124),
            "accessors[0].componentType: 5124 is no type of a component",
        ),
        (
            "/accessors/0/type",
            json!("MAT3"),
            "accessors[0].type: expected SCALAR, VEC2, VEC3, VEC4 or MAT4",
        ),
        (
            "/accessors/0/type",
            json!("VEC2"),
            "accessors[0]: elements of 2 components where 3 are needed",
        ),
        (
            "/accessors/0/bufferView",
            json!(7),
            "accessors[0].bufferView: there is no buffer view 7 (from 0): the file has 1",
        ),
        (
            "/bufferViews/0/byteOffset",
            json!(8),
            "bufferViews[0]: 36 bytes from byte 8 on, of a buffer of 36 bytes",
        ),
        (
            "/bufferViews/0/byteLength",
            json!(u64::MAX),
            "bufferViews[0]: 18446744073709551615 bytes from byte 0 on, of a buffer of 36 bytes",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(4),
            "accessors[0]: elements of 12 bytes that lie 4 bytes apart",
        ),
        (
            "/bufferViews/0/buffer",
            json!(1),
            "bufferViews[0].buffer: there is no buffer 1 (from 0): the file has 1",
        ),
        (
            "/meshes/0/primitives/0/mode",
            json!(9),
            "meshes[0].primitives[0]: 9 is no mode of a primitive",
        ),
        (
            "/meshes/0/primitives/0/material",
            json!(0),
            "meshes[0].primitives[0].material: there is no material 0 (from 0): the file has 0",
        ),
        ("/nodes/0/mesh", json!(3), "nodes[0].mesh: there is no mesh 3 (from 0): the file has 1"),
        (
            "/nodes/0/matrix",
            json!([1, 2]),
            "nodes[0].matrix: expected an array of 16 numbers, found another",
        ),
        (
            "/nodes/0/translation",
            json!({}),
            "nodes[0].translation: expected an array of 3 numbers, found an object",
        ),
        ("/scene", json!(2), "scene: there is no scene 2 (from 0): the file has 0"),
    ];
    for (pointer, value, expected) in cases {
        assert_eq!(changed(pointer, value), expected, "{pointer}");
    }
}

#[test]
fn trees_that_are_none_are_refused() {
    let nodes = |nodes: Value| changed("/nodes", nodes);
    assert_eq!(
        nodes(json!([{"children": [1]}, {"children": [0]}])),
        "nodes[0]: the node is among its own children's children"
    );
    assert_eq!(
        nodes(json!([{"mesh": 0}, {"children": [1]}])),
        "nodes[1]: the node is among its own children's children"
    );
    assert_eq!(
        nodes(json!([{"children": [2]}, {"children": [2]}, {}])),
        "nodes[1].children[0]: node 2 has two parents: nodes 0 and 1"
    );
    let mut file = File::triangle();
    file.json["nodes"] = json!([{"children": [1]}, {}]);
    assert_eq!(
        changed_in(file.clone(), "/scenes", json!([{"nodes": [1]}])),
        "scenes[0].nodes[0]: node 1 is no root: its parent is node 0"
    );
    assert_eq!(
        changed_in(file, "/scenes", json!([{"nodes": [0, 0]}])),
        "scenes[0].nodes[1]: node 0 is there twice"
    );
}

#[test]
fn a_deep_tree_takes_no_stack() {
    let mut file = File::triangle();
    let depth = 20_000;
    let node = |at: usize| {
        if at < depth {
            json!({"children": [at + 1], "translation": [0, 1, 0]})
        } else {
            json!({"mesh": 0})
        }
    };
    file.json["nodes"] = (0..=depth).map(node).collect();
    let model = file.model();
    assert_eq!(model.world.meshes[0].positions[0].y, depth as f64);
}

#[test]
fn copies_that_multiply_are_refused_before_they_are_made() {
    let mut file = File::triangle();
    let indices = vec![0u16; 30_000];
    let indices = file.indices(&indices);
    file.primitive()["indices"] = json!(indices);
    file.json["nodes"] = (0..10_001).map(|_| json!({"mesh": 0})).collect();
    let refused = refusal("test.glb", &file.glb());
    let expected = "nodes[10000]: with this node the scene has 30003 vertices and 100010000 triangles; 100000000 of each can be placed\n  help: each copy of a mesh takes memory of its own: leave some out";
    assert_eq!(refused, expected);
    // One node with as many instances as its file has bytes, nearly.
    let mut file = File::triangle();
    let indices = vec![0u16; 60_000];
    let indices = file.indices(&indices);
    file.primitive()["indices"] = json!(indices);
    let places = file.accessor("VEC3", U8, 20_000, &[0; 60_000]);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    let refused = refusal("test.glb", &file.glb());
    assert!(
        refused.starts_with(
            "nodes[0]: with this node the scene has 60000 vertices and 400000000 triangles"
        ),
        "{refused}"
    );
}

#[test]
fn attributes_that_do_not_fit_are_refused() {
    let mut file = File::triangle();
    let two = file.floats("VEC3", &[0.; 6]);
    assert_eq!(
        changed_in(file.clone(), "/meshes/0/primitives/0/attributes/NORMAL", json!(two)),
        "meshes[0].primitives[0].attributes.NORMAL: an attribute of 2 elements for 3 vertices"
    );
    let far = file.indices(&[0, 1, 3]);
    assert_eq!(
        changed_in(file.clone(), "/meshes/0/primitives/0/indices", json!(far)),
        "meshes[0].primitives[0].indices: there is no vertex 3 (from 0), of 3"
    );
    assert_eq!(
        changed_in(file.clone(), "/meshes/0/primitives/0/indices", json!(0)),
        "accessors[0]: elements of 3 components where 1 are needed"
    );
    let fractions = file.floats("SCALAR", &[0., 1., 2.]);
    assert_eq!(
        changed_in(file.clone(), "/meshes/0/primitives/0/indices", json!(fractions)),
        format!(
            "accessors[{fractions}]: numbers that may be negative or fractions, where indices are needed"
        )
    );
    let wild = file.floats("VEC3", &[0., 0., f32::NAN, 1., 0., 0., 0., 1., 0.]);
    assert_eq!(
        changed_in(file, "/meshes/0/primitives/0/attributes/POSITION", json!(wild)),
        format!("accessors[{wild}]: element 0 (from 0) is not a finite number")
    );
}

#[test]
fn sparse_accessors_that_lie_are_refused() {
    let mut file = File::triangle();
    let (indices, values) = (file.view(&[9]), file.view(&[0; 12]));
    let sparse = |count: u64, index: u32| json!({"count": count, "indices": {"bufferView": indices, "componentType": index}, "values": {"bufferView": values}});
    let with = |sparse: Value| changed_in(file.clone(), "/accessors/0/sparse", sparse);
    assert_eq!(with(sparse(1, U8)), "accessors[0]: the sparse index 9 is beyond the 3 elements");
    assert_eq!(
        with(sparse(5_000_000_000, U8)),
        "accessors[0].sparse: 5000000000 changed elements of 3"
    );
    assert_eq!(
        with(sparse(1, F32)),
        "accessors[0].sparse.indices: sparse indices are whole numbers that are not negative"
    );
    assert_eq!(
        with(sparse(2, U8)),
        "accessors[0].sparse.indices: 2 elements of 1 bytes, 1 bytes apart from byte 0 on, do not fit into a buffer view of 1 bytes"
    );
}

#[test]
fn extensions_that_are_required_and_not_read_are_refused_with_what_to_do() {
    for (name, help) in [
        ("KHR_draco_mesh_compression", "untick Compression"),
        ("EXT_meshopt_compression", "without -c"),
        ("KHR_texture_basisu", "not KTX2"),
        ("EXT_texture_webp", "untick WebP"),
        ("ACME_cloud", "without this extension"),
    ] {
        let refused = changed("/extensionsRequired", json!([name]));
        let start = format!(
            "extensionsRequired[0]: the file requires the extension `{name}`, which is not read\n  help: "
        );
        assert!(refused.starts_with(&start) && refused.contains(help), "{refused}");
    }
}

#[test]
fn buffers_and_images_that_are_not_there_are_refused() {
    let buffers = |buffers: Value| {
        let mut json = File::triangle().json;
        json["buffers"] = buffers;
        refusal("test.gltf", json.to_string().as_bytes())
    };
    assert_eq!(
        buffers(json!([{"byteLength": 36}])),
        "buffers[0]: the buffer has no `uri`, and the file no binary chunk"
    );
    let short = "data:;base64,AAAA";
    assert_eq!(
        buffers(json!([{"byteLength": 36, "uri": short}])),
        "buffers[0]: the buffer says 36 bytes and has 3"
    );
    assert_eq!(
        buffers(json!([{"byteLength": 36, "uri": "data:,x"}])),
        "buffers[0]: a data URI that is not base64"
    );
    assert!(
        buffers(json!([{"byteLength": 3, "uri": "data:;base64,A*"}]))
            .starts_with("buffers[0]: the data URI of `;base64` is damaged")
    );
    let remote = buffers(json!([{"byteLength": 36, "uri": "https://a.b/c.bin"}]));
    assert!(
        remote.starts_with("buffers[0]: `https://a.b/c.bin` is an address (https), not a file"),
        "{remote}"
    );
    assert!(
        buffers(json!([{"byteLength": 36, "uri": "none.bin"}]))
            .starts_with("buffers[0]: cannot read ")
    );
    let mut file = File::triangle().with_uvs();
    let view = file.view(b"no image");
    file.json["images"] = json!([{"bufferView": view}, {}]);
    file.json["textures"] = json!([{"source": 0}, {"source": 1}, {"extensions": {"EXT_texture_webp": {"source": 0}}}, {}]);
    let of = |texture: usize| {
        let info = json!({"baseColorTexture": {"index": texture}});
        refusal(
            "test.glb",
            &file.clone().with_material(json!({"pbrMetallicRoughness": info})).glb(),
        )
    };
    assert!(of(0).starts_with("images[0]: not a readable image"), "{}", of(0));
    assert_eq!(of(1), "images[1]: the image has neither `uri` nor `bufferView`");
    assert!(of(2).starts_with("textures[2]: `EXT_texture_webp` is not read"), "{}", of(2));
    assert!(of(3).starts_with("textures[3]: the texture has no `source`"), "{}", of(3));
}

#[test]
fn animations_and_lenses_that_make_no_sense_are_refused() {
    let mut file = File::triangle();
    file.add("cameras", json!({"type": "perspective", "perspective": {"yfov": 1}}));
    file.json["nodes"][0]["camera"] = json!(0);
    let (late, order) = (file.floats("SCALAR", &[0., 1e30]), file.floats("SCALAR", &[1., 0.]));
    let (two, three) = (file.floats("VEC3", &[0.; 6]), file.floats("VEC3", &[0.; 9]));
    let animated = |input: usize, output: usize| {
        let animation = json!({
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": input, "output": output}],
        });
        changed_in(file.clone(), "/animations", json!([animation]))
    };
    assert!(
        animated(late, two).starts_with("the camera's animation has "),
        "{}",
        animated(late, two)
    );
    assert_eq!(
        animated(order, two),
        format!("accessors[{order}]: times of keys: none, or not in order")
    );
    assert_eq!(
        animated(late, three),
        format!("accessors[{three}]: 9 numbers for 2 keys, which take 3 each")
    );
    let lens = |yfov: Value| changed_in(file.clone(), "/cameras/0/perspective/yfov", yfov);
    assert_eq!(
        lens(json!(4)),
        "the camera `camera 0` cannot be rendered: cameras[0].perspective.yfov: \
         a vertical field of view lies between 0 and pi, radians"
    );
    let mut flat = file.clone();
    flat.json["nodes"][0]["scale"] = json!([1, 1, 0]);
    assert_eq!(
        refusal("test.glb", &flat.glb()),
        "cameras[0]: on node `node 0` the camera has no place or direction"
    );
}

#[test]
fn lights_materials_and_skins_that_make_no_sense_are_refused() {
    let mut file = File::triangle();
    let light = |light: Value| {
        let mut file = file.clone();
        file.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
        changed_in(file, "/extensions", json!({"KHR_lights_punctual": {"lights": [light]}}))
    };
    let at = "extensions.KHR_lights_punctual.lights[0]";
    assert_eq!(
        light(json!({"type": "area"})),
        format!("{at}.type: a light is `point`, `spot` or `directional`")
    );
    assert_eq!(
        light(json!({"type": "point", "intensity": -1})),
        format!("{at}.intensity: -1 is out of range; it is from 0 to 1e30")
    );
    let cone = json!({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}});
    assert_eq!(
        light(cone),
        format!("{at}.spot: the inner angle 1 is larger than the outer one 0.5")
    );
    let material =
        |material: Value| refusal("test.glb", &File::triangle().with_material(material).glb());
    assert_eq!(
        material(json!({"alphaMode": "X"})),
        "materials[0]: `alphaMode` is OPAQUE, MASK or BLEND"
    );
    assert_eq!(
        material(json!({"emissiveFactor": 1})),
        "materials[0].emissiveFactor: expected an array of 3 numbers, found a number"
    );
    let joints = file.accessor("VEC4", U8, 3, &[0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0]);
    let weights = file.floats("VEC4", &[1.; 12]);
    file.primitive()["attributes"]["JOINTS_0"] = json!(joints);
    file.primitive()["attributes"]["WEIGHTS_0"] = json!(weights);
    file.json["nodes"][0]["skin"] = json!(0);
    assert_eq!(
        changed_in(file.clone(), "/skins", json!([{"joints": [0]}])),
        "meshes[0].primitives[0]: there is no joint 7 (from 0): the skin has 1"
    );
    assert_eq!(
        changed_in(file, "/skins", json!([{"joints": [5]}])),
        "skins[0].joints[0]: there is no node 5 (from 0): the file has 1"
    );
}

#[test]
fn what_takes_time_again_and_again_is_counted_too() {
    let mut file = File::triangle();
    let points = json!({"attributes": {"POSITION": 0}, "mode": 0});
    file.json["meshes"][0]["primitives"] = (0..2_001).map(|_| points.clone()).collect();
    file.json["nodes"] = (0..2_000).map(|_| json!({"mesh": 0})).collect();
    let refused = refusal("test.glb", &file.glb());
    let start = "nodes[1999]: with this node the scene has 4002000 primitives and morph targets; 4000000 can be placed";
    assert!(refused.starts_with(start), "{refused}");
    // Many samplers of the same bytes.
    let mut file = File::triangle();
    let (times, values) = (file.floats("SCALAR", &[0.; 100]), file.floats("VEC3", &[1.; 300]));
    let count = 40;
    file.json["nodes"] = (0..count).map(|_| json!({})).collect();
    let channel = |at: usize| json!({"sampler": at, "target": {"node": at, "path": "translation"}});
    file.json["animations"] = json!([{
        "channels": (0..count).map(channel).collect::<Vec<_>>(),
        "samplers": (0..count).map(|_| json!({"input": times, "output": values})).collect::<Vec<_>>(),
    }]);
    let refused = refusal("test.glb", &file.glb());
    assert!(
        refused
            .starts_with("animations[0].samplers[16]: animations of 6800 numbers, of buffers of "),
        "{refused}"
    );
}

#[test]
fn places_beyond_what_can_be_rendered_are_refused() {
    for place in [1e31, 1e300] {
        let refused = changed("/nodes/0/translation", json!([place, 0, 0]));
        assert_eq!(
            refused,
            "meshes[0].primitives[0]: a vertex lies beyond 1e30 in the world, or nowhere"
        );
    }
    assert!(changed("/nodes/0/scale", json!([1e300, 1e300, 1e300])).starts_with("meshes[0]"));
}
