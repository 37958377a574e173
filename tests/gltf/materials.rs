//! What glTF says of surfaces, as the numbers of materials.

use super::build::{File, Written, warns};
use serde_json::{Value, json};
use tweenray::import::Model;
use tweenray::math::{DAffine2, DVec2, Rgb, srgb_decode};
use tweenray::scene::{Fresnel, Glass, Light, Material, TextureMap, Wrap};

fn material(value: Value) -> (Material, Model) {
    let model = File::triangle().with_uvs().with_material(value).model();
    let id = model.world.meshes[0].material;
    (model.world.materials[id as usize].clone(), model)
}

#[test]
fn factors_and_their_defaults_are_those_of_the_format() {
    let (white, model) = material(json!({}));
    let plain = Fresnel { metallic: 1.0, ..Fresnel::PLASTIC };
    assert_eq!((white.diffuse, white.roughness, white.fresnel), (Rgb::ONE, 1.0, Some(plain)));
    assert_eq!(white.mirror, Rgb::splat(0.04));
    assert!(!white.emits_back && white.emission == Rgb::ZERO && model.warnings.is_empty());
    let (plastic, _) = material(json!({
        "name": "plastic",
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 1], "metallicFactor": 0, "roughnessFactor": 0.3},
        "extensions": {
            "KHR_materials_ior": {"ior": 2},
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0.5, 20]},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.75, "clearcoatRoughnessFactor": 0.125},
        },
    }));
    assert_eq!((plastic.name.as_str(), plastic.roughness), ("plastic", 0.3));
    assert_eq!(plastic.diffuse, Rgb::new(0.5, 0.25, 0.0));
    // ((2 - 1) / (2 + 1))² by colour, at most 1, by the factor.
    let expected = [1.0 / 9.0, 0.5 / 9.0, 1.0].map(|r: f64| (0.5 * r) as f32);
    assert!((plastic.mirror - Rgb::from_array(expected)).abs().max_element() < 1e-7);
    let fresnel = plastic.fresnel.expect("layers");
    assert_eq!((fresnel.grazing, fresnel.metallic), (0.5, 0.0));
    assert_eq!((fresnel.clearcoat, fresnel.clearcoat_roughness), (0.75, 0.125));
}

#[test]
fn images_serve_as_colour_roughness_metal_and_normals() {
    let mut file = File::triangle().with_uvs();
    let sampler = json!({"wrapS": 33071, "wrapT": 33648, "magFilter": 9728});
    let texture = file.image(2, &[[255, 10, 20, 255], [128, 51, 204, 255]], sampler);
    let info = json!({"index": texture});
    let file = file.with_material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": info, "metallicRoughnessTexture": info, "roughnessFactor": 0.5,
        },
        "normalTexture": {"index": texture, "scale": 0.25},
    }));
    let model = file.model();
    let material = &model.world.materials[0];
    let texel = |map: &TextureMap| model.world.textures[map.image as usize].levels()[0].texel(1, 0);
    assert_eq!(texel(&material.roughness_map.expect("roughness")).x, 0.2);
    let metal = material.fresnel.and_then(|f| f.metallic_map).expect("metal");
    assert_eq!(texel(&metal).x, 0.8);
    // Colours are sRGB codes, normals as they stand.
    let colour = texel(&material.texture.expect("colour")).x;
    assert!((colour - 0.215_86).abs() < 1e-4, "{colour}");
    let normals = material.normal_map.expect("normals");
    assert_eq!((texel(&normals.image).x, normals.strength), (128.0 / 255.0, 0.25));
    assert_eq!(metal.wrap, [Wrap::Clamp, Wrap::Mirror]);
    assert!(warns(&model.warnings, "the filter NEAREST of a texture is read as LINEAR"));
    assert_eq!(model.world.textures.len(), 4);
}

#[test]
fn images_of_coat_transmission_and_specular_are_taken_by_their_channels() {
    let mut file = File::triangle().with_uvs();
    let texture = file.image(1, &[[51, 102, 153, 204]], json!({}));
    let info = json!({"index": texture});
    let with = |coat: f64| {
        json!({
            "KHR_materials_clearcoat": {
                "clearcoatFactor": coat, "clearcoatTexture": info,
                "clearcoatRoughnessFactor": 0.5, "clearcoatRoughnessTexture": info,
            },
            "KHR_materials_transmission": {"transmissionFactor": 0.5, "transmissionTexture": info},
            "KHR_materials_specular": {"specularTexture": info, "specularColorTexture": info},
        })
    };
    let file = file.with_material(json!({"extensions": with(0.75)}));
    let model = file.model();
    let material = &model.world.materials[0];
    let fresnel = material.fresnel.expect("layers");
    let texel = |map: &Option<TextureMap>| {
        let image = map.map(|map| &model.world.textures[map.image as usize]);
        image.map(|image| image.levels()[0].texel(0, 0).x)
    };
    let shares = fresnel.maps().map(|(name, map)| (name, texel(map)));
    let expected = [
        ("metallic", None),
        ("specular", Some(0.8)),
        // An sRGB code.
        ("specular_colour", Some(srgb_decode(0.2) as f32)),
        ("clearcoat", Some(0.2)),
        ("clearcoat_roughness", Some(0.4)),
        ("transmission", Some(0.2)),
    ];
    assert_eq!(shares, expected);
    assert_eq!((fresnel.clearcoat, fresnel.clearcoat_roughness), (0.75, 0.5));
    assert_eq!((fresnel.transmission, material.glass.is_some()), (0.5, true));
    assert!(model.warnings.is_empty() && model.world.into_scene(true).is_ok());
    // An image times nothing is not read.
    let mut plain = File::triangle().with_uvs();
    plain.image(1, &[[51, 102, 153, 204]], json!({}));
    let none = plain.with_material(json!({"extensions": with(0.0)})).model();
    let fresnel = none.world.materials[0].fresnel.expect("layers");
    assert_eq!((fresnel.clearcoat_map, fresnel.clearcoat_roughness_map), (None, None));
}

#[test]
fn a_coat_has_normals_of_its_own() {
    let mut file = File::triangle().with_uvs();
    let texture = file.image(1, &[[51, 102, 153, 204]], json!({}));
    let coat = |factor: f64| {
        let normals = json!({"index": texture, "scale": 0.5});
        json!({"extensions": {"KHR_materials_clearcoat": {
            "clearcoatFactor": factor, "clearcoatNormalTexture": normals,
        }}})
    };
    let model = file.with_material(coat(1.0)).model();
    let material = &model.world.materials[0];
    let normals = material.fresnel.and_then(|f| f.clearcoat_normal_map).expect("normals");
    let texel = model.world.textures[normals.image.image as usize].levels()[0].texel(0, 0);
    assert_eq!((texel.x, normals.strength, material.normal_map), (0.2, 0.5, None));
    assert!(model.warnings.is_empty() && model.world.into_scene(true).is_ok());
    // Glass has no normals of an image, and none is read for it.
    let mut clear = File::triangle().with_uvs();
    clear.image(1, &[[51, 102, 153, 204]], json!({}));
    let mut glass = coat(1.0);
    glass["extensions"]["KHR_materials_transmission"] = json!({"transmissionFactor": 0.5});
    let glass = clear.with_material(glass).model();
    let fresnel = glass.world.materials[0].fresnel.expect("layers");
    assert_eq!((fresnel.clearcoat_normal_map, glass.world.textures.len()), (None, 0));
    assert!(warns(&glass.warnings, "shown without its normal maps"));
    let mut plain = File::triangle().with_uvs();
    plain.image(1, &[[51, 102, 153, 204]], json!({}));
    let none = plain.with_material(coat(0.0)).model();
    assert_eq!(none.world.materials[0].fresnel.and_then(|f| f.clearcoat_normal_map), None);
}

/// Where the coordinates of the file, with v downwards, lead in an image with v downwards.
fn leads(transform: &DAffine2, uv: [f64; 2]) -> [f64; 2] {
    let to = transform.transform_point2(DVec2::new(uv[0], 1.0 - uv[1]));
    [to.x, 1.0 - to.y]
}

#[test]
fn images_are_moved_turned_and_scaled_as_the_extension_has_it() {
    let mut file = File::triangle().with_uvs();
    let texture = file.image(1, &[[9; 4]], json!({}));
    let file = file.with_material(json!({"pbrMetallicRoughness": {"baseColorTexture": {
        "index": texture, "texCoord": 3, "extensions": {"KHR_texture_transform": {
            "offset": [0.25, 0.5], "rotation": 0.5, "scale": [2, 3], "texCoord": 0,
        }},
    }}}));
    let map = file.model().world.materials[0].texture.expect("a texture");
    let (sin, cos) = (0.5f64.sin(), 0.5f64.cos());
    for uv in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.3, 0.7]] {
        let [u, v] = [2.0 * uv[0], 3.0 * uv[1]];
        let expected = [u * cos + v * sin + 0.25, v * cos - u * sin + 0.5];
        let found = leads(&map.transform, uv);
        assert!((0..2).all(|k| (found[k] - expected[k]).abs() < 1e-12), "{found:?} {expected:?}");
    }
}

#[test]
fn alpha_is_cut_at_the_cutoff() {
    let masked = |alpha: Value, texels: [u8; 3]| {
        let mut file = File::triangle().with_uvs();
        let texels = texels.map(|a| [200, 200, 200, a]);
        let texture = file.image(3, &texels, json!({}));
        let mut value = json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}});
        for (key, part) in alpha.as_object().expect("keys") {
            match key.as_str() {
                "factor" => {
                    value["pbrMetallicRoughness"]["baseColorFactor"] = json!([1, 1, 1, part])
                }
                key => value[key] = part.clone(),
            }
        }
        file.with_material(value).model()
    };
    let there = |model: &Model| -> Option<Vec<bool>> {
        model.world.materials[0].alpha.map(|map| {
            let mask = &model.world.masks[map.image as usize];
            mask.texels.iter().map(|t| *t >= 128).collect()
        })
    };
    // 0.2 and 0.8 are codes 51 and 204.
    let at = |cutoff: f64| {
        there(&masked(json!({"alphaMode": "MASK", "alphaCutoff": cutoff}), [50, 51, 204]))
    };
    assert_eq!(at(0.5), Some(vec![false, false, true]));
    assert_eq!(at(0.2), Some(vec![false, true, true]));
    assert_eq!(at(0.801), Some(vec![false; 3]));
    assert_eq!((at(0.0), at(0.19)), (None, None));
    let half = json!({"alphaMode": "MASK", "alphaCutoff": 0.4, "factor": 0.5});
    assert_eq!(there(&masked(half, [50, 203, 204])), Some(vec![false, false, true]));
    let blend = masked(json!({"alphaMode": "BLEND"}), [0, 127, 128]);
    assert_eq!(there(&blend), Some(vec![false, false, true]));
    assert!(warns(&blend.warnings, "alphaMode BLEND is read as cut-outs"));
    let opaque = masked(json!({}), [0, 0, 0]);
    assert!(there(&opaque).is_none() && opaque.warnings.is_empty());
}

#[test]
fn a_sheet_that_is_half_there_all_over_is_opaque_with_a_warning() {
    let sheet = |alpha: f64| {
        let base = json!({"baseColorFactor": [1, 1, 1, alpha]});
        material(json!({"pbrMetallicRoughness": base, "alphaMode": "BLEND"}))
    };
    let (half, model) = sheet(0.7);
    assert!(half.alpha.is_none() && model.world.meshes.len() == 1);
    assert!(warns(&model.warnings, "alphaMode BLEND is read as cut-outs"));
    assert!(sheet(1.0).1.warnings.is_empty());
}

#[test]
fn what_is_transparent_all_over_is_left_out() {
    let clear =
        json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.3]}, "alphaMode": "BLEND"});
    let model = File::triangle().with_material(clear).model();
    assert!(model.world.meshes.is_empty());
    assert!(warns(&model.warnings, "alpha is below its cutoff"));
}

#[test]
fn transmission_is_a_pane_or_with_a_thickness_a_body_that_absorbs() {
    let glass = |extensions: Value| {
        let base =
            json!({"baseColorFactor": [0.5, 1, 1, 1], "roughnessFactor": 0, "metallicFactor": 0});
        material(json!({"pbrMetallicRoughness": base, "extensions": extensions}))
    };
    let full = json!({"transmissionFactor": 1});
    let (pane, model) = glass(json!({"KHR_materials_transmission": full}));
    let tint = Rgb::new(0.5, 1.0, 1.0);
    assert_eq!(pane.glass, Some(Glass { tint, thin: true, ..Glass::clear(1.5) }));
    assert!(model.warnings.is_empty() && model.world.into_scene(true).is_ok());
    let (body, _) = glass(json!({
        "KHR_materials_transmission": full, "KHR_materials_ior": {"ior": 1.33},
        "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0.25]},
    }));
    let glass_body = body.glass.expect("glass");
    assert!(!glass_body.thin && glass_body.ior == 1.33);
    // A half is left after 2, a quarter too: twice as fast.
    let expected = Rgb::new(0.0, 0.5 * 2f32.ln(), 2f32.ln());
    assert!((glass_body.absorption - expected).abs().max_element() < 1e-6);
    let quarter = json!({"transmissionFactor": 0.25});
    let (part, model) = glass(json!({"KHR_materials_transmission": quarter}));
    assert_eq!(part.glass, Some(Glass { tint, thin: true, ..Glass::clear(1.5) }));
    assert_eq!(part.fresnel.map(|fresnel| fresnel.transmission), Some(0.25));
    assert_eq!(part.diffuse, tint);
    let (neon, _) = material(json!({
        "emissiveFactor": [1, 0, 0], "pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_transmission": full},
    }));
    assert_eq!((neon.emission, neon.glass.is_some()), (Rgb::X, true));
    assert!(model.warnings.is_empty() && model.world.into_scene(true).is_ok());
}

#[test]
fn emission_is_radiance_and_lights_the_scene() {
    let (lamp, _) = material(json!({
        "emissiveFactor": [1, 0.5, 0], "doubleSided": true,
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
    }));
    assert_eq!((lamp.emission, lamp.emits_back), (Rgb::new(4.0, 2.0, 0.0), true));
    let file = File::triangle().with_material(json!({"emissiveFactor": [1, 1, 1]}));
    let lights = file.loaded().world.into_scene(true).unwrap().lights;
    let count = |is: fn(&&Light) -> bool| lights.iter().filter(is).count();
    // The quad is the studio's; what emits reflects, too.
    assert_eq!(count(|light| matches!(light, Light::Face(_))), 1);
    assert_eq!(count(|light| matches!(light, Light::Quad(_))), 1);
}

#[test]
fn an_image_of_emission_lights_where_it_is_bright() {
    // The left half of the image is black, the right one green.
    let mut file = File::new();
    let positions = [0., 0., 0., 1., 0., 0., 1., 1., 0., 2., 0., 0., 3., 0., 0., 3., 1., 0.];
    let positions = file.floats("VEC3", &positions);
    let uvs = [0.05, 0.1, 0.4, 0.1, 0.4, 0.9, 0.55, 0.1, 0.9, 0.1, 0.9, 0.9];
    let uvs = file.floats("VEC2", &uvs);
    let attributes = json!({"POSITION": positions, "TEXCOORD_0": uvs});
    file.add("meshes", json!({"primitives": [{"attributes": attributes}]}));
    file.add("nodes", json!({"mesh": 0}));
    let (black, green) = ([0, 0, 0, 255], [0, 255, 0, 255]);
    let texels: Vec<[u8; 4]> = (0..64).map(|at| if at % 8 < 4 { black } else { green }).collect();
    let texture = file.image(8, &texels, json!({}));
    let emissive = |factor: f64| {
        let lit = json!({"emissiveFactor": [factor, factor, factor], "emissiveTexture": {"index": texture}});
        file.clone().with_material(lit).model()
    };
    let model = emissive(1.0);
    let [mesh] = &model.world.meshes[..] else { panic!("{:?}", model.world.meshes) };
    let material = &model.world.materials[mesh.material as usize];
    assert!(material.emission == Rgb::ONE && material.emission_map.is_some());
    assert_eq!(model.warnings, []);
    for factor in [1.0, 0.25] {
        let lights = emissive(factor).world.into_scene(true).unwrap().lights;
        let [Light::Face(face)] = &lights[..] else { panic!("{lights:?}") };
        assert!((face.part.radiance - Rgb::Y * factor as f32).length() < 1e-6);
        let nearest = face.triangle.iter().map(|corner| corner.x).fold(f64::MAX, f64::min);
        let furthest = face.triangle.iter().map(|corner| corner.x).fold(f64::MIN, f64::max);
        // The second triangle is the last third of the model.
        assert!(nearest > 0.0 && furthest > nearest, "{face:?}");
    }
}

#[test]
fn an_image_of_emission_lies_by_its_own_set() {
    // Dark by the first set, bright by the second.
    let mut file = File::triangle();
    for (set, u) in [(0, 0.3f32), (1, 0.8)] {
        let uvs = file.floats("VEC2", &[u, 0.1, u, 0.5, u, 0.9]);
        file.primitive()["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
    }
    let texture = file.image(2, &[[0, 0, 0, 255], [0, 255, 0, 255]], json!({}));
    let emission = |set: usize| {
        let model = file.clone().with_material(json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}},
            "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": texture, "texCoord": set},
        }));
        let lights = model.model().world.into_scene(true).unwrap().lights;
        lights[0].emission()
    };
    // A tenth of a texel beside the middle of the dark one, and of the bright one.
    let (dark, bright) = (emission(0), emission(1));
    assert!((dark - Rgb::Y * 0.1).length() < 1e-5, "{dark}");
    assert!((bright - Rgb::Y * 0.9).length() < 1e-5, "{bright}");
}

#[test]
fn unlit_surfaces_are_matte_by_name() {
    let (matte, model) = material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0, 0, 1]}, "extensions": {"KHR_materials_unlit": {}},
    }));
    assert_eq!((matte.diffuse, matte.fresnel), (Rgb::X * 0.5, None));
    assert!(warns(&model.warnings, "KHR_materials_unlit"));
}

#[test]
fn extensions_that_are_not_read_are_named_once_each() {
    let materials = |extensions: serde_json::Value| {
        let mut file = File::triangle().with_material(json!({"extensions": extensions}));
        // What the list says and no object has is no loss.
        file.json["extensionsUsed"] = json!(["KHR_materials_iridescence", "KHR_materials_ior"]);
        file.json["extras"] = json!({"extensions": {"ACME_notes": {}}});
        file.json["nodes"][0]["extensions"] = json!({"KHR_interactivity": {}, "KHR_xmp": {}});
        let warnings = file.model().warnings;
        warnings.into_iter().map(|warning| warning.message).collect::<Vec<_>>()
    };
    assert_eq!(materials(json!({"KHR_materials_ior": {}, "EXT_texture_webp": {}})), [""; 0]);
    assert_eq!(
        materials(json!({"KHR_materials_sheen": {}, "ACME_cloud": {}})),
        [
            "the extension `ACME_cloud` is not read: the picture may differ",
            "the extension `KHR_materials_sheen` is not read: the picture may differ"
        ]
    );
    let [gloss] = &materials(json!({"KHR_materials_pbrSpecularGlossiness": {}}))[..] else {
        panic!("one")
    };
    assert!(gloss.contains("convert the file to metallic-roughness"), "{gloss}");
}

#[test]
fn blend_beside_transmission_hides_nothing() {
    let (glass, model) = material(json!({
        "alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.3]},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}},
    }));
    assert!(glass.glass.is_some() && glass.alpha.is_none() && model.world.meshes.len() == 1);
}

#[test]
fn variants_of_materials_are_named() {
    let mut file = File::triangle();
    let names = json!([{"name": "red"}, {"name": "blue"}]);
    file.json["extensions"] = json!({"KHR_materials_variants": {"variants": names}});
    file.json["extensionsRequired"] = json!(["KHR_materials_variants", "KHR_audio_emitter"]);
    assert!(warns(&file.model().warnings, "materials have variants (red, blue)"));
}

/// A triangle whose base colour, emission and specular colour are the Radiance image `sky.hdr` of (2, 1, 0.5).
fn bright() -> Model {
    let mut file = File::triangle().with_uvs();
    let source = file.add("images", json!({"uri": "sky.hdr"}));
    let info = json!({"index": file.add("textures", json!({"source": source}))});
    let file = file.with_material(json!({
        "name": "snow",
        "pbrMetallicRoughness": {"baseColorTexture": info},
        "emissiveTexture": info,
        "emissiveFactor": [1, 1, 1],
        "extensions": {"KHR_materials_specular": {"specularColorTexture": info}},
    }));
    let written = Written::of("test.glb", &file.glb());
    let picture = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x40\x20\x82";
    written.beside("sky.hdr", picture);
    written.model().expect("a model")
}

#[test]
fn base_colours_above_one_are_cut_with_a_warning_and_factors_and_emission_are_not() {
    let model = bright();
    let material = &model.world.materials[0];
    let texel = |map: Option<TextureMap>| {
        model.world.textures[map.expect("an image").image as usize].levels()[0].texel(0, 0)
    };
    assert_eq!(texel(material.texture), Rgb::new(1.0, 1.0, 0.5));
    assert_eq!(texel(material.emission_map), Rgb::new(2.0, 1.0, 0.5));
    let specular = material.fresnel.and_then(|fresnel| fresnel.specular_colour_map);
    assert_eq!(texel(specular), Rgb::new(2.0, 1.0, 0.5));
    let [warning] = &model.warnings[..] else { panic!("{:?}", model.warnings) };
    assert!(warning.message.starts_with("material `snow`: baseColorTexture "), "{warning}");
    let end =
        "sky.hdr: colours above 1 are cut to 1: no surface reflects more light than it receives";
    assert!(warning.message.ends_with(end), "{warning}");
}

#[test]
fn an_image_of_codes_that_is_base_colour_and_emission_is_one_texture() {
    let mut file = File::triangle().with_uvs();
    let info = json!({"index": file.image(1, &[[51, 102, 153, 255]], json!({}))});
    let file = file.with_material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": info},
        "emissiveTexture": info,
        "emissiveFactor": [1, 1, 1],
    }));
    let model = file.model();
    assert!(model.world.textures.len() == 1 && model.warnings.is_empty());
}

#[test]
fn thin_glass_has_the_cut_outs_of_a_mask_and_a_body_has_none() {
    let of = |mode: &str, thickness: f64| {
        let mut file = File::triangle().with_uvs();
        let texels = [[255, 255, 255, 255], [255, 255, 255, 0]];
        let info = json!({"index": file.image(2, &texels, json!({}))});
        let model = file.with_material(json!({
            "alphaMode": mode,
            "pbrMetallicRoughness": {"baseColorTexture": info, "metallicFactor": 0},
            "extensions": {
                "KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_volume": {"thicknessFactor": thickness},
            },
        }));
        let model = model.model();
        let material = &model.world.materials[0];
        let is_cut = (material.glass.is_some_and(|glass| glass.thin), material.alpha.is_some());
        let says = warns(&model.warnings, "a body of glass has no cut-outs");
        assert!(model.world.into_scene(true).is_ok());
        (is_cut, says)
    };
    assert_eq!(of("MASK", 0.0), ((true, true), false));
    assert_eq!(of("BLEND", 0.0), ((true, false), false));
    assert_eq!(of("MASK", 1.0), ((false, false), true));
}
