//! Material libraries. tobj 4.0.5 panics on some of these when it meets them bare.

use super::{Expect, Expect::*, check, load_bytes};
use tweenray::error::Diagnostic;
use tweenray::math::DVec2;
use tweenray::scene::{Material, TextureMap, World, Wrap};

const OBJ: &[u8] = b"mtllib bad.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

const CASES: &[(&str, Expect)] = &[
    ("newmtl a\nKd 1 1 1\n", Fine),
    ("newmtl a\nKd 0.5\n", Fine),
    ("newmtl a\nKa 1 1 1\nKs 1 1 1\nNs 100\nillum 2\nd 1\nNi 1.45\n", Fine),
    ("newmtl a\nd -halo 0.5\nNi 1.5\n", Fine),
    ("newmtl a\nillum 6\nNi 1.5\nTf 0.9 1 1\n", Fine),
    ("# only this\n", Warns(2, "no material `a`")),
    ("newmtl\n", Line(1, "`newmtl` without a name")),
    ("Kd 1 1 1\n", Line(1, "`Kd` before the first `newmtl`")),
    ("newmtl a\nKd 0.1 0.2\n", Line(2, "`Kd` … three … `0.1 0.2`")),
    ("newmtl a\nKd\n", Line(2, "`Kd` … three")),
    ("newmtl a\nKd 1 1 1 1\n", Line(2, "`Kd` … three")),
    ("newmtl a\nKd red\n", Line(2, "`red` is not a number")),
    ("newmtl a\nKd nan 0 0\n", Line(2, "not a finite number")),
    ("newmtl a\nKd inf 0 0\n", Line(2, "not a finite number")),
    ("newmtl a\nKd 1e300 0 0\n", Line(2, "`Kd")),
    ("newmtl a\nKd -0.1 0 0\n", Line(2, "holds -0.1")),
    ("newmtl a\nKd spectral file.rfl\n", Line(2, "only RGB can be read")),
    ("newmtl a\nKd xyz 1 1 1\n", Line(2, "only RGB can be read")),
    ("newmtl a\nKs 0.1 0.2\n", Line(2, "`Ks` … three")),
    ("newmtl a\nKe 1 2\n", Line(2, "`Ke` … three")),
    ("newmtl a\nKa x\n", Line(2, "`x` is not a number")),
    ("newmtl a\nTf 1 1 2\n", Line(2, "holds 2")),
    ("newmtl a\nNi\n", Line(2, "`Ni` without a number")),
    ("newmtl a\nNi 0\n", Line(2, "`Ni 0`: from 0.001 to 1000")),
    ("newmtl a\nNi -1.5\n", Line(2, "`Ni -1.5`")),
    ("newmtl a\nNi 1.5 1.5\n", Line(2, "`Ni` … one number")),
    ("newmtl a\nNs abc\n", Line(2, "`abc` is not a number")),
    ("newmtl a\nd 1.5\n", Line(2, "`d 1.5`: from 0 to 1")),
    ("newmtl a\nd -halo\n", Line(2, "`d` without a number")),
    ("newmtl a\nTr 2\n", Line(2, "`Tr 2`")),
    ("newmtl a\nillum x\n", Line(2, "`x` is not a number")),
    ("newmtl a\nillum 11\n", Line(2, "`illum 11`")),
    ("newmtl a\nillum 2.5\n", Line(2, "0 to 10")),
    ("newmtl a\nmap_Kd\n", Line(2, "`map_Kd` without a file name")),
    ("newmtl a\nmap_Kd -bm 1\n", Line(2, "`map_Kd` without a file name")),
    ("newmtl a\n\u{1b}[31m\n", Line(2, "MTL")),
    ("newmtl a\nKd 1 1 \0\n", Line(2, "zero byte")),
    ("newmtl a\nmap_Kd gone.png\n", Warns(1, "gone.png")),
    ("newmtl a\nmap_Kd -o 1 1 -clamp on no image.png\n", Warns(1, "no image.png")),
    ("newmtl a\nmap_Kd -o 1 1 -cc on no image.png\n", Warns(2, "texture option `-cc`")),
    ("newmtl a\nmap_Kd -s\n", Line(2, "option `-s` lacks a value")),
    ("newmtl a\nmap_Kd -s image.png\n", Line(2, "`-s` … `image.png` is not a number")),
    ("newmtl a\nmap_Kd -s 0 1 image.png\n", Line(2, "`-s` holds 0.0")),
    ("newmtl a\nmap_Kd -s 1 -0 image.png\n", Line(2, "`-s` holds -0.0")),
    ("newmtl a\nmap_d -s 1 1 1e31 image.png\n", Line(2, "`map_d`: … `-s` holds 1e31")),
    ("newmtl a\nmap_Kd -s 1 nan image.png\n", Line(2, "not a finite number")),
    ("newmtl a\nmap_Kd -o inf image.png\n", Line(2, "not a finite number")),
    ("newmtl a\nmap_Kd -o -2e30 image.png\n", Line(2, "`-o` holds -2e30")),
    ("newmtl a\nmap_Kd -o 1 2 3\n", Line(2, "`map_Kd` without a file name")),
    ("newmtl a\nmap_Kd -clamp yes image.png\n", Line(2, "`-clamp` is `on` or `off`, not `yes`")),
    ("newmtl a\nmap_Kd -clamp\n", Line(2, "option `-clamp` lacks a value")),
    ("newmtl a\nmap_Kd bad.mtl\n", Warns(1, "bad.mtl")),
    ("newmtl a\nmap_d\n", Line(2, "`map_d` without a file name")),
    ("newmtl a\nmap_d gone.png\n", Warns(1, "cut-outs left out")),
    ("newmtl a\nmap_d -imfchan m bad.mtl\n", Warns(2, "texture option `-imfchan`")),
    ("newmtl a\nillum 7\nNi 1.5\nmap_d x.png\n", Warns(1, "glass has none")),
    ("newmtl a\nillum 7\nNi 1.5\nmap_Kd x.png\n", Warns(1, "`map_Kd` is ignored")),
    ("newmtl a\nd 0.9\nNi 1.5\n", Warns(1, "by less than half")),
    ("newmtl a\nKd 1 0 0\nnewmtl a\nKd 0 1 0\n", Warns(3, "defined again")),
    ("newmtl a\nd 0.5\n", Warns(1, "rendered opaque")),
    ("newmtl a\nillum 7\n", Warns(1, "glass without `Ni`")),
    ("newmtl a\nKd 0.8 0.8 0.8\nKs 0.8 0.8 0.8\nillum 3\n", Warns(1, "to 1")),
    ("newmtl a\nbump gone.png\n", Warns(1, "normal map left out")),
    ("newmtl a\nmap_Bump -bm 0.5 gone.png\n", Warns(1, "normal map left out")),
    ("newmtl a\nmap_Bump -bm 0.5\n", Line(2, "`map_Bump` without a file name")),
    ("newmtl a\nmap_Bump -bm x a.png\n", Line(2, "`x` is not a number")),
    ("newmtl a\nmap_Bump -bm -1 gone.png\n", Warns(1, "normal map left out")),
    ("newmtl a\nnorm -bm\n", Line(2, "option `-bm` lacks a value")),
    ("newmtl a\nbump -bm 1e31 a.png\n", Line(2, "`-bm` holds 1e31")),
    ("newmtl a\nnorm -imfchan r gone.png\n", Warns(2, "texture option `-imfchan`")),
    ("newmtl a\nnorm -s 0 a.png\n", Line(2, "`norm`: … `-s` holds 0.0")),
    ("newmtl a\nbump -clamp maybe a.png\n", Line(2, "`-clamp` is `on` or `off`")),
    ("newmtl a\nillum 7\nNi 1.5\nnorm gone.png\n", Warns(1, "glass has no normal map")),
    ("newmtl a\nmap_Bump bad.mtl\n", Warns(1, "normal map left out")),
    ("newmtl a\nPr 0.5\n", Fine),
    ("newmtl a\nPm 1\nPr .2\nPc 1\nPcr .03\nPs 0\naniso 0\nanisor 0\n", Fine),
    ("newmtl a\nPm x\n", Line(2, "`x` is not a number")),
    ("newmtl a\nPc -1\n", Line(2, "`Pc -1`: at least 0")),
    ("newmtl a\nmap_Pr gone.png\n", Warns(1, "roughness map left out")),
    ("newmtl a\nPm 1\nmap_Pm gone.png\n", Warns(1, "metallic map left out")),
    ("newmtl a\nPr -0.5\n", Line(2, "`Pr -0.5`: at least 0")),
    ("newmtl a\nillum 3\nKs .5 .5 .5\nPr 1.5\nKd 0 0 0\n", Fine),
    ("newmtl a\nPr nan\n", Line(2, "not a finite number")),
    ("newmtl a\nmap_Pr\n", Line(2, "`map_Pr` without a file name")),
    ("newmtl a\nmap_Pr -imfchan x a.png\n", Line(2, "takes r, g, b, m, l or z, not `x`")),
    ("newmtl a\nmap_Pr -imfchan\n", Line(2, "option `-imfchan` lacks a value")),
    ("newmtl a\nmap_Pr -o 1 inf a.png\n", Line(2, "`map_Pr`: … not a finite number")),
    ("newmtl a\nillum 3\nKs .5 .5 .5\nPr 0.5\nKd 0 0 0\n", Fine),
    ("newmtl a\nillum 3\nKs .5 .5 .5\nmap_Pr gone.png\n", Warns(1, "roughness map left out")),
    (
        "newmtl a\nillum 3\nKs .5 .5 .5\nmap_Pr -imfchan r bad.mtl\n",
        Warns(1, "roughness map left out"),
    ),
];

#[test]
fn malformed_material_libraries_are_errors_with_lines() {
    for (text, expect) in CASES {
        check(text, load_bytes("obj", OBJ, &[("bad.mtl", text.as_bytes())]), expect);
    }
}

#[test]
fn mtl_statements_become_materials() {
    let mtl = "newmtl mirror\nillum 3\nKs 1 1 1\nnewmtl glass\nillum 7\nNi 1.33\nTf .9 1 .8\n\
               newmtl red #25 \nKd .6 .08 .06\nKs 1 1 1\nillum 2\nnewmtl lamp\nKe 3 2 1\n\
               newmtl window\nd 0.2\nNi 1.5\nnewmtl max\nillum 4\nd 1\nTr 1\nKd .5 .5 .5\nNi 1.5\n\
               newmtl bare\n";
    let names = ["mirror", "glass", "red #25", "lamp", "window", "max", "bare"];
    let mut obj = "mtllib all of them.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for name in names {
        obj += &format!("usemtl {name}\nf 1 2 3\n");
    }
    obj += "usemtl mirror\nf 1 3 2\n";
    let model =
        load_bytes("obj", obj.as_bytes(), &[("all of them.mtl", mtl.as_bytes())]).expect("read");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    assert_eq!(model.files.len(), 2);
    let world = &model.world;
    let found: Vec<_> = world.meshes.iter().map(|m| (&m.name[..], m.triangles.len())).collect();
    // The lamp's triangle became a light.
    assert_eq!(world.lights.len(), 1);
    let names = ["mirror", "glass", "red #25", "window", "max", "bare"];
    let expected: Vec<_> = names.iter().map(|n| (*n, if *n == "mirror" { 2 } else { 1 })).collect();
    assert_eq!(found, expected);
    let material = |i: usize| &world.materials[world.meshes[i].material as usize];
    let grey = |x: f32| tweenray::math::Rgb::splat(x);
    assert_eq!((material(0).mirror, material(0).diffuse), (grey(1.0), grey(0.0)));
    let glass = material(1).glass.expect("glass");
    assert_eq!((glass.ior, glass.tint), (1.33, tweenray::math::Rgb::new(0.9, 1.0, 0.8)));
    assert_eq!(material(2).diffuse, tweenray::math::Rgb::new(0.6, 0.08, 0.06));
    assert_eq!(material(2).mirror, grey(0.0));
    let lamp = world.materials.iter().find(|m| m.name == "lamp").expect("the lamp");
    assert_eq!(lamp.emission, tweenray::math::Rgb::new(3.0, 2.0, 1.0));
    assert!(material(3).glass.is_some() && material(4).glass.is_none());
    assert_eq!(material(4).diffuse, grey(0.5));
    assert_eq!(material(5).diffuse, tweenray::import::DEFAULT_ALBEDO);
}

#[test]
fn textures_are_linear_and_shared() {
    let ppm = b"P6 2 1 255\n\x00\x80\xff\xff\x00\x00";
    let mtl = b"newmtl a\nmap_Kd my image.ppm\nnewmtl b\nKd .5 .5 .5\nmap_Kd my image.ppm\n";
    let obj = "mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
               usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 2/2\n";
    let others: &[(&str, &[u8])] = &[("x.mtl", mtl), ("my image.ppm", ppm)];
    let model = load_bytes("obj", obj.as_bytes(), others).expect("read");
    assert!(model.warnings.is_empty(), "{:?}", model.warnings);
    let [texture] = &model.world.textures[..] else { panic!("one texture") };
    let first = texture.levels()[0].texel(0, 0);
    // sRGB 128 of 255 is 0.21586 (IEC 61966-2-1).
    assert_eq!((first.x, first.z), (0.0, 1.0));
    assert!((first.y - 0.215_861).abs() < 1e-6);
    let factors: Vec<f32> = model.world.materials.iter().map(|m| m.diffuse.x).collect();
    assert_eq!(factors, [1.0, 0.5]);
    assert_eq!(model.files.len(), 3);
}

/// A face of each of the materials `names` of a library `mtl`, which lies beside the `image` of one pixel: red 16, green 128, blue 48.
fn faces_of(mtl: &str, names: &[&str], image: &str) -> World {
    let faces: String = names.iter().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect();
    let obj = format!("mtllib bad.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}");
    let pixel: &[u8] = b"P6 1 1 255\n\x10\x80\x30";
    let others = [("bad.mtl", mtl.as_bytes()), (image, pixel)];
    load_bytes("obj", obj.as_bytes(), &others).expect("a good file").world
}

#[test]
fn map_pr_is_one_channel_as_it_stands() {
    let mtl = "newmtl a\nillum 3\nKd 0 0 0\nKs 1 1 1\nPr 0.25\nmap_Pr -imfchan b rough.ppm\n\
               newmtl b\nillum 3\nKd 0 0 0\nKs 1 1 1\nmap_Pr rough.ppm\nnewmtl c\nillum 5\nKd 0 0 0\n\
               Ks 1 1 1\nPr 0.25\n";
    let world = faces_of(mtl, &["a", "b", "c"], "rough.ppm");
    let rough = world.materials.iter().map(|material| {
        let texel = |map: TextureMap| world.textures[map.image as usize].levels()[0].texel(0, 0).x;
        (material.roughness, material.roughness_map.map(texel))
    });
    let expected = [(1.0, Some(48.0 / 255.0)), (1.0, Some(128.0 / 255.0)), (0.25, None)];
    assert_eq!(rough.collect::<Vec<_>>(), expected);
}

#[test]
fn what_has_an_image_reflects_no_more_than_all_light() {
    let mtl = "newmtl a\nillum 3\nKs .8 .8 .8\nmap_Kd C:\\elsewhere\\image.ppm\n\
               newmtl b\nillum 3\nKd .8 .8 .8\nKs .8 .8 .8\nmap_Kd image.ppm\n\
               newmtl c\nillum 4\nd 0.5\nNi 1.5\nKd 0 0 0\nmap_Kd image.ppm\n";
    let world = faces_of(mtl, &["a", "b", "c"], "image.ppm");
    let of = |k: usize| &world.materials[k];
    assert!(of(0).texture.is_some() && of(1).texture.is_some() && of(2).texture.is_none());
    assert_eq!((of(1).diffuse.x, of(1).mirror.x), (0.5, 0.5));
    assert!(
        (of(0).diffuse.x - 1.0 / 1.8).abs() < 1e-6 && (of(0).mirror.x - 0.8 / 1.8).abs() < 1e-6
    );
    assert!(of(2).glass.is_some());
    assert_eq!(of(2).diffuse.x, 0.0);
}

#[test]
fn glass_has_the_roughness_of_pr_or_map_pr() {
    let mtl = "newmtl a\nillum 7\nNi 1.5\nPr 0.25\nnewmtl b\nillum 7\nNi 1.5\nPr 0.25\nmap_Pr rough.ppm\n\
               newmtl c\nillum 7\nNi 1.5\n";
    let world = faces_of(mtl, &["a", "b", "c"], "rough.ppm");
    let rough = world.materials.iter().map(|material| {
        let glass = material.glass.expect("glass");
        (glass.roughness, material.roughness_map.is_some())
    });
    assert_eq!(rough.collect::<Vec<_>>(), [(0.25, false), (1.0, true), (0.0, false)]);
}

#[test]
fn what_has_metal_a_coat_or_a_roughness_alone_is_principled() {
    let mtl = "newmtl metal\nillum 3\nKs 1 1 1\nKd .9 .8 .3\nPm 1\nPr .2\nNi 1\n\
               newmtl coated\nKd .5 .5 .5\nPc .5\nPcr .1\nNi 2\n\
               newmtl matte\nKd .5 .5 .5\nPr 3\nmap_Pm -imfchan r metal.ppm\n\
               newmtl plain\nKd .5 .5 .5\nPc 0\n";
    let world = faces_of(mtl, &["metal", "coated", "matte", "plain"], "metal.ppm");
    let seen = |material: &Material| {
        let fresnel = material.fresnel?;
        let texel = |map: TextureMap| world.textures[map.image as usize].levels()[0].texel(0, 0).x;
        let coat = (fresnel.clearcoat, fresnel.clearcoat_roughness);
        let metal = (fresnel.metallic, fresnel.metallic_map.map(texel));
        Some((material.roughness, (material.mirror.x * 900.0).round(), metal, coat))
    };
    let found: Vec<_> = world.materials.iter().map(seen).collect();
    let expected = [
        Some((0.2, 36.0, (1.0, None), (0.0, 0.0))),
        Some((0.5, 100.0, (0.0, None), (0.5, 0.1))),
        Some((1.0, 36.0, (1.0, Some(16.0 / 255.0)), (0.0, 0.0))),
        None,
    ];
    assert_eq!(found, expected);
}

#[test]
fn norm_is_a_normal_map_and_map_bump_only_if_it_looks_like_one() {
    let mtl = "newmtl a\nnorm grey.ppm\nnewmtl b\nmap_Bump -bm 0.5 blue.ppm\nnewmtl c\nmap_Bump grey.ppm\n\
               newmtl d\nbump grey.ppm\nnorm blue.ppm\nnewmtl e\nmap_Kd blue.ppm\n";
    let obj =
        ["a", "b", "c", "d", "e"].map(|name| format!("usemtl {name}\nf 1/1 2/2 3/3\n")).concat();
    let obj = format!("mtllib bad.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n{obj}");
    let (grey, blue): (&[u8], &[u8]) = (b"P6 1 1 255\n\x80\x80\x80", b"P6 1 1 255\n\x80\x80\xff");
    let others = [("bad.mtl", mtl.as_bytes()), ("grey.ppm", grey), ("blue.ppm", blue)];
    let model = load_bytes("obj", obj.as_bytes(), &others).expect("a good file");
    let of = |material: &Material| {
        let map = material.normal_map?;
        let texture = &model.world.textures[map.image.image as usize];
        Some((texture.levels()[0].texel(0, 0).z == 1.0, map.strength))
    };
    let found: Vec<_> = model.world.materials.iter().map(of).collect();
    assert_eq!(found, [Some((false, 1.0)), Some((true, 0.5)), None, Some((true, 1.0)), None]);
    let [doubt, warning, colour] = &model.warnings[..] else { panic!("{:?}", model.warnings) };
    assert!(doubt.message.contains("grey.ppm of line 2: this does not look like"), "{doubt}");
    assert!(colour.message.contains("`map_Kd` blue.ppm: this looks like a normal map"), "{colour}");
    assert!(warning.message.contains("grey.ppm of line 6 holds heights"), "{warning}");
}

#[test]
fn what_glass_has_no_place_for_is_named() {
    let mtl = b"newmtl a\nKd .8 .6 .2\nPm 1\nPc 1\nd .3\nNi 1.5\n";
    let obj = "mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let model = load_bytes("obj", obj.as_bytes(), &[("x.mtl", mtl)]).expect("read");
    assert!(model.world.materials[0].glass.is_some());
    let named = |keyword| model.warnings.iter().any(|w| w.message.contains(keyword));
    assert!(named("`Pm` is ignored") && named("`Pc` is ignored"), "{:?}", model.warnings);
    let negative: &[(&str, &[u8])] = &[("x.mtl", b"newmtl a\nPm -1\n")];
    let error = load_bytes("obj", obj.as_bytes(), negative).expect_err("refused").to_string();
    assert!(error.contains("`Pm -1`: at least 0 is possible"), "{error}");
}

#[test]
fn map_d_cuts_holes_and_is_shared() {
    let pgm = b"P5 2 1 255\n\x00\xff";
    let mtl = b"newmtl a\nillum 4\nmap_d leaf.pgm\nnewmtl b\nKd .5 .5 .5\nmap_d leaf.pgm\n\
                newmtl c\nKe 1 1 1\nmap_d leaf.pgm\n";
    let obj = "mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
               usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 2/2\nusemtl c\nf 2/2 3/3 1/1\n";
    let others: &[(&str, &[u8])] = &[("x.mtl", mtl), ("leaf.pgm", pgm)];
    let model = load_bytes("obj", obj.as_bytes(), others).expect("read");
    let [mask] = &model.world.masks[..] else { panic!("one mask") };
    assert_eq!(mask.texels, [0, 255]);
    assert!(
        model
            .world
            .materials
            .iter()
            .all(|m| m.alpha == Some(TextureMap::of(0)) && m.glass.is_none())
    );
    assert_eq!(model.files.len(), 3);
    // A glowing leaf stays a mesh, and the scene has a light of its face.
    assert_eq!((model.world.meshes.len(), model.world.lights.len()), (3, 0));
    assert_eq!(model.warnings, []);
    // The quarter of it that the mask leaves.
    assert_eq!(model.world.into_scene(true).expect("a scene").lights.len(), 1);
}

#[test]
fn options_say_how_images_lie() {
    let ppm = b"P6 1 1 255\n\x80\x80\xff";
    let options =
        ["-s 2", "-s 2 3 -o 0.5", "-o 1 -2 7 -s -2 3 4 -clamp on -clamp off", "-clamp on"];
    let (mut mtl, mut obj) = (String::new(), "mtllib x.mtl\n".to_owned());
    obj += "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
    for (k, options) in options.iter().enumerate() {
        // Those of the last statement count.
        mtl += &format!("newmtl {k}\nmap_Kd -s 9 1.ppm\nmap_Kd {options} 1.ppm\nmap_d 1.ppm\n");
        mtl += &format!("newmtl mask {k}\nKd 0 0 0\nKs 1 1 1\nillum 3\nmap_d {options} 1.ppm\n");
        mtl += &format!("map_Pr -imfchan r {options} 1.ppm\nbump {options} -bm 0.5 1.ppm\n");
        obj += &format!("usemtl {k}\nf 1/1 2/2 3/3\nusemtl mask {k}\nf 1/1 3/3 2/2\n");
    }
    let others: &[(&str, &[u8])] = &[("x.mtl", mtl.as_bytes()), ("1.ppm", ppm)];
    let model = load_bytes("obj", obj.as_bytes(), others).expect("read");
    // The image is of normals, and is shown as a colour too.
    let is_doubt =
        |w: &Diagnostic| w.message.contains("`map_Kd` 1.ppm: this looks like a normal map");
    assert!(model.warnings.iter().all(is_doubt), "{:?}", model.warnings);
    let expected = [
        ([2.0, 1.0], [0.0, 0.0], Wrap::Repeat),
        ([2.0, 3.0], [0.5, 0.0], Wrap::Repeat),
        ([-2.0, 3.0], [1.0, -2.0], Wrap::Repeat),
        ([1.0, 1.0], [0.0, 0.0], Wrap::Clamp),
    ];
    for (materials, (scale, offset, wrap)) in model.world.materials.chunks(2).zip(expected) {
        let [shown, masked] = materials else { panic!("two materials") };
        let map = shown.texture.expect("a texture");
        assert_eq!((map.image, map.wrap), (0, [wrap; 2]));
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.3, -0.7)] {
            let at = map.transform.transform_point2(DVec2::new(x, y));
            let wanted = DVec2::new(x * scale[0] + offset[0], y * scale[1] + offset[1]);
            assert!((at - wanted).length() < 1e-15, "{at} {wanted}");
        }
        assert_eq!((masked.alpha, shown.alpha), (Some(map), Some(TextureMap::of(0))));
        assert_eq!(masked.roughness_map, Some(TextureMap { image: 1, ..map }));
        let normals = masked.normal_map.expect("a normal map");
        assert_eq!((normals.image, normals.strength), (TextureMap { image: 2, ..map }, 0.5));
    }
    assert_eq!((model.world.textures.len(), model.world.masks.len()), (3, 1));
    assert_eq!(model.files.len(), 3);
}

#[test]
fn images_come_in_the_order_in_which_faces_ask_for_them() {
    let pgm = |texel: u8| [&b"P5 1 1 255\n"[..], &[texel]].concat();
    let mtl = b"newmtl a\nmap_Kd 1.pgm\nmap_d 2.pgm\nnewmtl b\nmap_Kd 2.pgm\nmap_d gone.pgm\n\
                newmtl c\nmap_Kd gone.pgm\nmap_d 1.pgm\nnewmtl unused\nmap_Kd gone too.pgm\n";
    let obj = "mtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
               usemtl c\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 2/2\nusemtl a\nf 2/2 3/3 1/1\n";
    let (one, two) = (pgm(1), pgm(2));
    let others: &[(&str, &[u8])] = &[("x.mtl", mtl), ("1.pgm", &one), ("2.pgm", &two)];
    let model = load_bytes("obj", obj.as_bytes(), others).expect("read");
    let world = &model.world;
    assert_eq!(world.masks.iter().map(|mask| mask.texels[0]).collect::<Vec<_>>(), [1, 2]);
    let codes = world.textures.iter().map(|t| t.image_bytes()[0]);
    assert_eq!(codes.collect::<Vec<_>>(), [2, 1]);
    let warnings: Vec<_> = model.warnings.iter().map(|warning| &warning.message[..]).collect();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("`c`: texture left out") && warnings[0].contains("gone.pgm"));
    assert!(warnings[1].contains("`b`: cut-outs left out") && warnings[1].contains("gone.pgm"));
}

#[test]
fn image_bombs_are_refused() {
    let bombs: [&[u8]; 3] = [
        b"P6 65000 65000 255\n\0",
        b"P6 4294967295 4294967295 255\n\0",
        // A png header of 2^31 − 1 squared, checksum and all.
        b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0\xb8\x13\xc5\x96",
    ];
    for bomb in bombs {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("bomb.png");
        std::fs::write(&path, bomb).expect("written");
        let error = tweenray::import::load_texture(&path).expect_err("refused");
        assert!(matches!(error, tweenray::error::Error::Input(_)), "{error}");
    }
}
