//! Texture coordinates of the shapes, in closed form, what is said of meshes without, and cut-outs.

use super::*;
use crate::math::{DVec2, DVec3, Rgb, Vec2};
use crate::scene::{Glass, TextureMap, WorldMesh, Wrap};

/// A job whose one mesh is `mesh`, of a material with a texture.
fn textured(mesh: &str) -> Loaded {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("white.ppm"), b"P6 1 1 255\n\xff\xff\xff").expect("written");
    std::fs::write(at("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").expect("written");
    let part =
        "v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\nf 2 4 3\n";
    std::fs::write(at("part.obj"), part).expect("written");
    let text = format!(
        "sky.radiance = 1\n[material.paper]\ntexture = 'white.ppm'\n[[mesh]]\nmaterial = 'paper'\n{mesh}\n"
    );
    std::fs::write(at("scene.toml"), text).expect("written");
    load(&at("scene.toml"), &LoadOptions::default()).expect("a scene")
}

/// Calls `check(position, uv, outward normal)` for each corner of each triangle, and sees to it that
/// no image is mirrored.
fn each_corner(mesh: &WorldMesh, mut check: impl FnMut(DVec3, Vec2, DVec3)) {
    let uvs = mesh.uvs.as_ref().expect("texture coordinates");
    for (prim, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.map(|i| mesh.positions[i as usize]);
        let at = uvs.get(prim, *triangle);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let (e1, e2) = (at[1] - at[0], at[2] - at[0]);
        assert!(e1.x * e2.y - e1.y * e2.x > 0.0, "triangle {prim} shows a mirrored image: {at:?}");
        for (p, uv) in corners.into_iter().zip(at) {
            check(p, uv, normal);
        }
    }
}

fn assert_near(uv: Vec2, u: f64, v: f64, at: DVec3) {
    // The image repeats.
    let off = (f64::from(uv.x) - u + 0.5).rem_euclid(1.0) - 0.5;
    assert!(off.abs() < 1e-6 && (f64::from(uv.y) - v).abs() < 1e-6, "{uv} at {at}, not {u}, {v}");
}

#[test]
fn a_quad_shows_the_image_once_along_its_edges() {
    let loaded = textured("quad = { corner = [1, 2, 3], edges = [[4, 0, 0], [1, 2, 0]] }");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    each_corner(&loaded.world.meshes[0], |p, uv, _| {
        let v = (p.y - 2.0) / 2.0;
        assert_near(uv, (p.x - 1.0 - v) / 4.0, v, p);
        assert!((0.0..=1.0).contains(&uv.x));
    });
}

#[test]
fn a_box_shows_the_image_upright_on_each_side() {
    let loaded = textured("box = { min = [-1, 0, 2], max = [1, 4, 5] }");
    let (mut sides, middle) = ([0; 3], DVec3::new(0.0, 2.0, 3.5));
    each_corner(&loaded.world.meshes[0], |p, uv, n| {
        let share = (p - DVec3::new(-1.0, 0.0, 2.0)) / DVec3::new(2.0, 4.0, 3.0);
        let axis = n.abs().max_position();
        sides[axis] += 1;
        // Right and up as a viewer before the face has them; on top and below up is -z and +z.
        let up = if axis == 1 { DVec3::Z * -n.y } else { DVec3::Y };
        let right = up.cross(n);
        let along = |way: DVec3| 0.5 + (share - 0.5).dot(way);
        assert_near(uv, along(right), along(up), p);
        assert!((p - middle).dot(n) > 0.0);
    });
    assert_eq!(sides, [12; 3]);
}

#[test]
fn a_sphere_shows_longitude_and_latitude() {
    for (meridians, bands) in [(12, 6), (7, 5), (3, 2)] {
        let ball = format!(
            "uv_sphere = {{ centre = [1, 2, 3], radius = 2, meridians = {meridians}, bands = {bands} }}"
        );
        let loaded = textured(&ball);
        each_corner(&loaded.world.meshes[0], |p, uv, _| {
            let n = (p - DVec3::new(1.0, 2.0, 3.0)) / 2.0;
            let v = 1.0 - n.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
            // Every longitude is the pole's.
            let at_pole = n.y.abs() > 1.0 - 1e-9;
            let u = 0.75 - n.z.atan2(n.x) / std::f64::consts::TAU;
            let u = if at_pole { uv.x.into() } else { u };
            // Positions are rounded to six decimals.
            let off = (f64::from(uv.x) - u + 0.5).rem_euclid(1.0) - 0.5;
            assert!(off.abs() < 2e-6 && (f64::from(uv.y) - v).abs() < 2e-6, "{uv} at {n}");
        });
    }
}

#[test]
fn a_terrain_shows_the_image_once_over_its_extent() {
    let loaded = textured("terrain = { vertices = 9, size = 8 }");
    each_corner(&loaded.world.meshes[0], |p, uv, _| {
        assert_near(uv, (p.x + 4.0) / 8.0, (4.0 - p.z) / 8.0, p);
        assert!((0.0..=1.0).contains(&uv.x));
    });
}

#[test]
fn shapes_without_a_texture_hold_no_coordinates() {
    let loaded = good(
        "[[mesh]]\nquad = { centre = [0, 0, 0], normal = 'y', size = [1, 1] }\n\
         [[mesh]]\nbox = { min = [0, 0, 0], max = [1, 1, 1] }\n",
    );
    assert!(loaded.world.meshes.iter().all(|mesh| mesh.uvs.is_none()));
}

#[test]
fn a_mesh_without_texture_coordinates_is_named_with_its_material() {
    let loaded = textured("file = 't.obj'\nname = 'wing'");
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.message.contains("`wing`") && warning.message.contains("`paper`"), "{warning}");
    assert_eq!(warning.line, Some(4));
}

#[test]
fn a_mesh_with_coordinates_for_some_faces_alone_is_named() {
    let loaded = textured("file = 'part.obj'\nname = 'wing'");
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.message.starts_with("1 of 2 triangles of the mesh `wing` has no"), "{warning}");
    assert!(warning.message.contains("`paper`"), "{warning}");
}

#[test]
fn a_texture_may_be_scaled_turned_moved_and_wrapped() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("white.ppm"), b"P6 1 1 255\n\xff\xff\xff").expect("written");
    let text = "[material.a]\ntexture = 'white.ppm'\n[material.b]\ntexture = { file = 'white.ppm', \
                wrap = 'mirror', scale = [2, 3], rotate = 90, offset = [0.5, 0], uv_set = 2 }\n\
                [[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n";
    std::fs::write(at("scene.toml"), text).expect("written");
    let world = load(&at("scene.toml"), &LoadOptions::default()).expect("a scene").world;
    let map = |name: &str| {
        let material = world.materials.iter().find(|m| m.name == name).expect("a material");
        material.texture.expect("a texture")
    };
    assert_eq!(map("a"), TextureMap::of(0));
    assert_eq!((map("b").image, map("b").wrap, map("b").uv_set), (0, [Wrap::Mirror; 2], 2));
    // Scaled to (2, 6), turned to (-6, 2), moved.
    let moved = map("b").transform.transform_point2(DVec2::new(1.0, 2.0));
    assert!((moved - DVec2::new(-5.5, 2.0)).length() < 1e-12, "{moved}");
}

#[test]
fn one_number_scales_both_axes() {
    let scaled = |scale: &str| {
        let text = format!(
            "[material.leaf]\ntexture = {{ file = 'leaf.pgm', scale = {scale} }}\n\
             alpha = {{ file = 'leaf.pgm', scale = {scale} }}\nmirror = 0.5\ndiffuse = 0.5\n\
             roughness = {{ file = 'leaf.pgm', scale = {scale} }}\n\
             normal_map = {{ file = 'leaf.pgm', scale = {scale} }}\n\
             [[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'leaf'\n"
        );
        let material = cut(&text).expect("a scene").world.materials[0].clone();
        let normals = material.normal_map.map(|map| map.image);
        let maps = [material.texture, material.alpha, material.roughness_map, normals];
        let [first, others @ ..] = maps.map(|map| map.expect("an image").transform);
        assert_eq!(others, [first; 3]);
        first
    };
    assert_eq!(scaled("2"), scaled("[2, 2]"));
    assert_eq!(scaled("-0.5"), scaled("[-0.5, -0.5]"));
    let refused = |scale: &str| {
        let text = format!("[material.leaf]\ntexture = {{ file = 'leaf.pgm', scale = {scale} }}\n");
        let Err(Error::Input(fault)) = cut(&text) else { panic!("{scale}") };
        assert_eq!(fault.line, Some(3));
        fault.message
    };
    assert!(refused("0").contains("found 0"));
    assert!(refused("[1, 2, 3]").contains("array of 2 values"));
    assert!(refused("'x'").contains("a number or an array of 2 numbers"));
}

/// Loads a scene file with `text` beside a mask of two texels, `leaf.pgm`, and a triangle without coordinates.
fn cut(text: &str) -> Result<Loaded> {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("leaf.pgm"), b"P5 2 1 255\n\x00\xff").expect("written");
    std::fs::write(at("t.obj"), "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n").expect("written");
    std::fs::write(at("scene.toml"), format!("sky.radiance = 1\n{text}")).expect("written");
    load(&at("scene.toml"), &LoadOptions::default())
}

#[test]
fn of_several_images_that_are_not_to_be_had_the_first_in_the_file_is_named() {
    for (text, name) in [
        ("[material.z]\nalpha = 'no.png'\n[material.a]\ntexture = 'none.png'\n", "no.png"),
        ("[material.z]\ntexture = 'none.png'\n[material.a]\nalpha = 'no.png'\n", "none.png"),
        ("[material.a]\nalpha = 'no.png'\ntexture = 'none.png'\n", "no.png"),
        ("[material.a]\nalpha = 'scene.toml'\ntexture = 'none.png'\n", "scene.toml"),
        ("[material.z]\nroughness = 'no.png'\nmirror = 1\ntexture = 'none.png'\n", "no.png"),
        ("[material.z]\nnormal_map = 'no.png'\n[material.a]\ntexture = 'none.png'\n", "no.png"),
    ] {
        let Err(Error::Input(fault)) = cut(text) else { panic!("{text}") };
        // The first line is the sky's.
        assert_eq!(fault.line, Some(3), "{text}: {fault}");
        assert!(fault.message.contains(name), "{text}: {fault}");
    }
}

#[test]
fn one_image_may_be_texture_and_mask() {
    let loaded = cut("[material.leaf]\ntexture = 'leaf.pgm'\nalpha = 'leaf.pgm'\n\
         [[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'leaf'\n");
    let loaded = loaded.expect("a scene");
    assert_eq!((loaded.world.textures.len(), loaded.world.masks.len()), (1, 1));
    assert_eq!(loaded.files.len(), 2);
}

const LEAF: &str = "[material.leaf]\ndiffuse = 0.5\nalpha = 'leaf.pgm'\n";

#[test]
fn alpha_is_a_mask_that_materials_share_and_shapes_have_coordinates_for() {
    let quad = "[[mesh]]\nquad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }\n";
    let text = format!(
        "{LEAF}[material.frond]\nmirror = 0.5\nalpha = 'leaf.pgm'\n{quad}material = 'leaf'\n\
         {quad}material = 'frond'\n[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'leaf'\n"
    );
    let loaded = cut(&text).expect("a scene");
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let world = &loaded.world;
    let [mask] = &world.masks[..] else { panic!("one mask") };
    assert_eq!((mask.width, mask.height, &mask.texels[..]), (2, 1, &[0, 255][..]));
    assert!(
        world.materials.iter().all(|m| m.alpha == Some(TextureMap::of(0)) && m.texture.is_none())
    );
    assert!(world.meshes.iter().all(|mesh| mesh.uvs.is_some()));
    assert_eq!(loaded.files.len(), 2);
}

#[test]
fn a_mesh_without_coordinates_for_its_alpha_is_named() {
    let loaded =
        cut(&format!("{LEAF}[[mesh]]\nfile = 't.obj'\nname = 'wing'\nmaterial = 'leaf'\n"));
    let loaded = loaded.expect("a scene");
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.message.contains("`wing`") && warning.message.contains("nothing"), "{warning}");
}

#[test]
fn a_sphere_that_emits_and_has_cut_outs_is_no_light() {
    let text = "[material.glow]\nemission = 3\nalpha = 'leaf.pgm'\n[[sphere]]\ncentre = [3, 0, 0]\n\
                radius = 1\nmaterial = 'glow'\n[[mesh]]\nmaterial = 'glow'\n\
                quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }\n";
    let loaded = cut(text).expect("a scene");
    let world = &loaded.world;
    assert_eq!((world.lights.len(), world.meshes.len(), world.spheres.len()), (0, 1, 1));
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.message.contains("sphere that emits and has cut-outs"), "{warning}");
}

#[test]
fn alpha_is_refused_at_the_key_of_a_body_of_glass_and_taken_of_a_thin_pane() {
    let of = |glass: &str| cut(&format!("[material.pane]\n{glass}\nalpha = 'leaf.pgm'\n"));
    for (body, line) in [("glass = {}", 4), ("principled = { transmission = 1 }", 3)] {
        let Err(Error::Input(fault)) = of(body) else { panic!("{body} is taken") };
        assert_eq!(fault.line, Some(line));
        assert!(fault.message.contains("no cut-outs: its body is closed"), "{fault}");
    }
    for pane in ["glass = { thin = true }", "principled = { transmission = 1, thin = true }"] {
        let loaded = of(pane).unwrap_or_else(|error| panic!("{error}"));
        assert!(loaded.world.materials.iter().any(|m| m.glass.is_some() && m.alpha.is_some()));
    }
}

/// Loads a scene file with `text` beside images of one pixel: `grey.pgm`, of 16 bits, `rgba.png` and the normal `blue.png`.
fn data(text: &str) -> Result<Loaded> {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("grey.pgm"), b"P5 1 1 65535\n\x80\x00").expect("written");
    let rgba = image::RgbaImage::from_pixel(1, 1, image::Rgba([10, 128, 30, 40]));
    rgba.save(at("rgba.png")).expect("written");
    let blue = image::RgbImage::from_pixel(1, 1, image::Rgb([128, 128, 255]));
    blue.save(at("blue.png")).expect("written");
    let text =
        format!("[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'm'\n[material.m]\n{text}");
    std::fs::write(at("scene.toml"), format!("sky.radiance = 1\n{text}")).expect("written");
    load(&at("scene.toml"), &LoadOptions::default())
}

#[test]
fn a_roughness_is_a_number_or_a_channel_of_an_image_as_it_stands() {
    let of = |roughness: &str| {
        let mirror = format!("mirror = 0.5\nroughness = {roughness}\n");
        let glass = format!("glass = {{ roughness = {roughness} }}\n");
        let [mirror, glass] = [mirror, glass].map(|keys| {
            let loaded = data(&keys).expect("a scene");
            let material = &loaded.world.materials[0];
            let map = material.roughness_map;
            let texel =
                map.map(|map| loaded.world.textures[map.image as usize].levels()[0].texel(0, 0).x);
            (material.glass.map_or(material.roughness, |glass| glass.roughness), texel)
        });
        assert_eq!(mirror, glass);
        mirror
    };
    assert_eq!(of("0.25"), (0.25, None));
    assert_eq!(of("1"), (1.0, None));
    for (roughness, code) in [
        ("'rgba.png'", 128.0),
        ("{ file = 'rgba.png', wrap = 'clamp' }", 128.0),
        ("{ file = 'rgba.png', channel = 'r' }", 10.0),
        ("{ file = 'rgba.png', channel = 'b' }", 30.0),
        ("{ file = 'rgba.png', channel = 'a' }", 40.0),
    ] {
        assert_eq!(of(roughness), (1.0, Some(code / 255.0)), "{roughness}");
    }
    assert_eq!(of("'grey.pgm'"), (1.0, Some(f32::from(0x8000u16) / 65_535.0)));
}

#[test]
fn colours_above_one_are_cut_where_they_are_reflected_and_not_where_they_are_emitted() {
    let load = |keys: &str| {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let bright = image::Rgb32FImage::from_pixel(1, 1, image::Rgb([3.0_f32, 0.5, 0.5]));
        bright.save(at("bright.exr")).expect("written");
        let text = format!(
            "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = 'm'\n[material.m]\n{keys}\n"
        );
        std::fs::write(at("scene.toml"), format!("sky.radiance = 1\n{text}")).expect("written");
        let loaded = load(&at("scene.toml"), &LoadOptions::default()).expect("a scene");
        let told = loaded.warnings.iter().any(|w| w.message.contains("colours above 1 are cut"));
        (loaded.world.textures[0].levels()[0].texel(0, 0).x, told)
    };
    assert_eq!(load("texture = 'bright.exr'"), (1.0, true));
    assert_eq!(load("principled = { base_texture = 'bright.exr' }"), (1.0, true));
    assert_eq!(load("emission_texture = 'bright.exr'"), (3.0, false));
}

#[test]
fn principled_parameters_are_numbers_or_images() {
    let of = |keys: &str| {
        let loaded = data(&format!("principled = {{ {keys} }}\n")).expect("a scene");
        let material = loaded.world.materials[0].clone();
        let texel = |map: Option<TextureMap>| {
            map.map(|map| loaded.world.textures[map.image as usize].levels()[0].texel(0, 0).x)
        };
        let fresnel = material.fresnel.expect("principled");
        let maps = [material.texture, material.roughness_map, fresnel.metallic_map].map(texel);
        (material, fresnel, maps)
    };
    let (plain, fresnel, maps) = of("");
    assert_eq!((plain.diffuse, plain.mirror), (Rgb::splat(0.8), Rgb::splat(0.04)));
    assert_eq!((plain.roughness, fresnel.grazing, fresnel.metallic), (0.5, 1.0, 0.0));
    assert_eq!((fresnel.clearcoat, fresnel.clearcoat_roughness, maps), (0.0, 0.03, [None; 3]));
    let (half, fresnel, _) = of("specular = 0.5, ior = 3, metallic = 0.25, roughness = 0");
    assert_eq!((half.mirror, half.roughness), (Rgb::splat(0.125), 0.0));
    assert_eq!((fresnel.grazing, fresnel.metallic), (0.5, 0.25));
    // Of one image glTF has the roughness in green and the metal in blue.
    let (mapped, fresnel, [base, roughness, metal]) =
        of("base_texture = 'rgba.png', metallic = { file = 'rgba.png', factor = 0.5 }, \
         roughness = 'rgba.png', clearcoat = 1, clearcoat_roughness = 0.2");
    assert_eq!((mapped.diffuse, mapped.roughness, fresnel.metallic), (Rgb::ONE, 1.0, 0.5));
    assert_eq!((roughness, metal), (Some(128.0 / 255.0), Some(30.0 / 255.0)));
    assert!(base.is_some_and(|red| (red - 0.003).abs() < 1e-4), "sRGB code 10: {base:?}");
    assert_eq!((fresnel.clearcoat, fresnel.clearcoat_roughness), (1.0, 0.2));
    let (_, fresnel, _) =
        of("specular = { file = 'rgba.png', channel = 'a' }, clearcoat = 'rgba.png', \
         clearcoat_roughness = { file = 'rgba.png', factor = 0.5 }, transmission = 'rgba.png'");
    assert_eq!((fresnel.grazing, fresnel.clearcoat, fresnel.clearcoat_roughness), (1.0, 1.0, 0.5));
    assert_eq!(fresnel.transmission, 1.0);
    assert_eq!(
        fresnel.maps().map(|(_, map)| map.is_some()),
        [false, true, false, true, true, true]
    );
    let (shiny, fresnel, _) = of("specular_colour = [1, 0.5, 0], specular_texture = 'rgba.png', \
         clearcoat = 1, clearcoat_normal_map = { file = 'rgba.png', strength = 0.5 }");
    assert_eq!(shiny.mirror, Rgb::new(0.04, 0.02, 0.0));
    let colours = fresnel.specular_colour_map.map(|map| map.image);
    let normals = fresnel.clearcoat_normal_map.expect("normals");
    assert!(shiny.normal_map.is_none() && normals.strength == 0.5);
    assert!(colours.is_some_and(|image| image != normals.image.image));
}

#[test]
fn a_transmission_makes_a_share_glass_and_all_of_it_glass_alone() {
    let of = |material: &str| {
        let loaded = data(material).expect("a scene");
        let made = loaded.world.materials[0].clone();
        loaded.world.into_scene(true).expect("a valid scene");
        made
    };
    let part =
        of("principled = { transmission = 0.25, base_colour = [1, 0.5, 0], roughness = 0.3 }\n");
    let tint = Rgb::new(1.0, 0.5, 0.0);
    let glass = Glass { roughness: 0.3, tint, ..Glass::clear(1.5) };
    assert_eq!((part.glass, part.diffuse), (Some(glass), tint));
    assert_eq!(part.fresnel.map(|fresnel| fresnel.transmission), Some(0.25));
    let keys = "roughness = 0.3, ior = 1.33, tint = 0.5, thin = true";
    let all = of(&format!("principled = {{ transmission = 1, {keys} }}\n"));
    assert_eq!(all, of(&format!("glass = {{ {keys} }}\n")));
    let coated = of(&format!("principled = {{ transmission = 1, clearcoat = 1, {keys} }}\n"));
    assert_eq!((coated.fresnel.map(|f| f.clearcoat), coated.glass), (Some(1.0), all.glass));
}

#[test]
fn glass_emits_by_no_image() {
    let refused = data("emission_texture = 'rgba.png'\nglass = {}\n").expect_err("glass alone");
    assert!(refused.to_string().contains("glass stands alone"), "{refused}");
}

#[test]
fn one_file_as_colour_and_as_data_is_two_images() {
    let text = "diffuse = 0.5\ntexture = 'rgba.png'\nmirror = 0.5\nroughness = 'rgba.png'\n\
                [material.n]\nmirror = 0.5\nroughness = { file = 'rgba.png', scale = 2 }\n";
    let loaded = data(text).expect("a scene");
    let [colour, rough] = &loaded.world.textures[..] else { panic!("two images") };
    assert!(colour.levels()[0].texel(0, 0).y < 0.22 && rough.levels()[0].texel(0, 0).y > 0.5);
    assert_eq!(loaded.files.len(), 2, "the scene file and the image");
}

#[test]
fn an_image_that_two_materials_misuse_is_doubted_once_where_the_file_first_names_it() {
    let text = "normal_map = 'rgba.png'\n[material.a]\nnormal_map = 'rgba.png'\n";
    let loaded = data(text).expect("a scene");
    let doubts =
        loaded.warnings.iter().filter(|w| w.message.contains("not look like a normal map"));
    // Lines 1 to 6 are the sky's, the sphere's and the material's name.
    assert_eq!(doubts.map(|doubt| doubt.line).collect::<Vec<_>>(), [Some(7)]);
}

#[test]
fn roughness_from_what_is_no_image_of_it_is_refused_at_its_place() {
    for (roughness, expected) in [
        ("{ file = 'grey.pgm', channel = 'a' }", "no alpha channel"),
        ("{ file = 'rgba.png', channel = 'luma' }", "luma"),
        ("{ file = 'gone.png' }", "gone.png"),
        ("{ channel = 'r' }", "file"),
        ("1.5", "a number from 0 to 1"),
        ("-1", "a number from 0 to 1"),
        ("true", "a number from 0 to 1, a file name or a table"),
    ] {
        let error = data(&format!("mirror = 0.5\nroughness = {roughness}\n")).expect_err("refused");
        assert!(error.to_string().contains(expected), "{roughness}: {error}");
    }
    let error = data("diffuse = 0.5\nroughness = 'rgba.png'\n").expect_err("refused");
    assert!(error.to_string().contains("needs `mirror`"), "{error}");
}

#[test]
fn a_normal_map_has_a_strength_and_is_doubted_if_it_holds_no_normals() {
    let of = |map: &str| {
        let loaded = data(&format!("diffuse = 0.5\nnormal_map = {map}\n")).expect("a scene");
        let strength = loaded.world.materials[0].normal_map.expect("a normal map").strength;
        let warnings: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
        (strength, warnings.join(" "))
    };
    assert_eq!(of("'blue.png'"), (1.0, String::new()));
    assert_eq!(of("{ file = 'blue.png', strength = 0.25, scale = [2, 2] }"), (0.25, String::new()));
    let (_, warnings) = of("'rgba.png'");
    assert!(warnings.contains("does not look like a normal map"), "{warnings}");
    let shown = data("texture = 'blue.png'\n").expect("a scene");
    assert!(shown.warnings[0].message.contains("looks like a normal map"), "{:?}", shown.warnings);
    for (text, expected) in [
        ("diffuse = 0.5\nnormal_map = { file = 'blue.png', strength = -1 }\n", "from 0 to 1e30"),
        ("diffuse = 0.5\nnormal_map = 3\n", "a file name or a table"),
        ("glass = {}\nnormal_map = 'blue.png'\n", "glass has no normal map"),
        (
            "principled = { transmission = 0.5, clearcoat = 1, clearcoat_normal_map = 'blue.png' }\n",
            "what has a `transmission` has no normal map",
        ),
        ("principled = { clearcoat_normal_map = 'blue.png' }\n", "it needs a `clearcoat` above 0"),
        (
            "principled = { transmission = 0.5 }\nnormal_map = 'blue.png'\n",
            "a `transmission` has no normal map",
        ),
        ("principled = { transmission = 1 }\nalpha = 'rgba.png'\n", "has no cut-outs"),
    ] {
        let error = data(text).expect_err("refused").to_string();
        assert!(error.contains(expected), "{text}: {error}");
    }
}
