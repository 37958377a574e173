//! OBJ files and files in the course's dialect.

use super::{Expect, Expect::*, check, load_bytes};

/// A triangle's vertices: three lines before what is tried.
const V: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// What follows [`V`], and what must come of it.
const AFTER_A_TRIANGLES_VERTICES: &[(&str, Expect)] = &[
    ("f 1 2 3", Fine),
    ("f 1 2 3 # a comment\n\n# f 9 9 9\n", Fine),
    ("f 1 2 \\\n3", Fine),
    ("f -3 -2 -1", Fine),
    ("f 1/ 2/ 3/", Fine),
    ("f 1// 2// 3//", Fine),
    ("o a\ng b c\ns off\ns 1\nusemtl\nf 1 2 3", Fine),
    ("f 0 1 2", Line(4, "vertex index 0")),
    ("f 1 2 4", Line(4, "vertex index 4 … 3")),
    ("f 1 2 -4", Line(4, "vertex index -4 … 3")),
    ("f 1 2 99999999999999999", Line(4, "vertex index … 3")),
    ("f 1 2 -99999999999999999999999", Line(4, "whole number")),
    ("f 1 2 9223372036854775808", Line(4, "whole number")),
    ("f 1 2 3.0", Line(4, "`3.0` is no vertex index")),
    ("f 1 2 x", Line(4, "`x` is no vertex index")),
    ("f 1 2 --3", Line(4, "is no vertex index")),
    ("f /1 2 3", Line(4, "`` is no vertex index")),
    ("f 1/1 2/1 3/1", Line(4, "texture coordinate index 1 … 0")),
    ("f 1//1 2//1 3//1", Line(4, "normal index 1 … 0")),
    ("vt 0 0\nf 1/1 2/0 3/1", Line(5, "texture coordinate index 0")),
    ("vn 0 0 1\nf 1//1 2//-2 3//1", Line(5, "normal index -2 … 1")),
    ("f 1/1/1/1 2 3", Line(4, "texture coordinate index 1")),
    ("vt 0 0\nvn 0 0 1\nf 1/1/1/1 2 3", Line(6, "vertex/texture/normal")),
    ("f 1 2", Line(4, "a face with 2 corners")),
    ("f", Line(4, "a face with 0 corners")),
    ("f 1 2 #3", Line(4, "a face with 2 corners")),
    ("v 1 2", Line(4, "`v` takes x y z")),
    ("v", Line(4, "`v` takes x y z")),
    ("v 1 2 3 4 5", Line(4, "`v` takes x y z")),
    ("v 1 2 3 4 5 6 7 8 9", Line(4, "at most 8 numbers")),
    ("v nan 0 0", Line(4, "`nan` is not a finite number")),
    ("v 0 inf 0", Line(4, "`inf` is not a finite number")),
    ("v 0 0 -1e999", Line(4, "not a finite number")),
    ("v 0 0 1,5", Line(4, "`1,5` is not a number")),
    ("v 0 0 0x10", Line(4, "`0x10` is not a number")),
    ("v 0 0 1.0D3", Line(4, "is not a number")),
    ("v 1 2 3 0", Line(4, "lies at infinity")),
    ("vt", Line(4, "`vt` takes u v")),
    ("vt 0 0 0 0", Line(4, "one to three numbers")),
    ("vt nan 0", Line(4, "not a finite number")),
    ("vt 1e99 0", Line(4, "is too large")),
    ("vn 0 0", Line(4, "`vn` takes x y z")),
    ("vn 0 0 1 0", Line(4, "three numbers")),
    ("vn 0 0 up", Line(4, "`up` is not a number")),
    ("mtllib", Line(4, "`mtllib` without a file name")),
    ("mtllib gone.mtl\nf 1 2 3", Warns(4, "gone.mtl")),
    ("usemtl gone\nf 1 2 3", Warns(4, "no material `gone`")),
    ("vn 0 0 0\nf 1//1 2//1 3//1", Warns(4, "a normal has no length")),
    ("vn nan nan nan\nf 1//1 2//1 3//1", Warns(4, "a normal has no length")),
    ("v 1 1 1 0.5 0.5 0.5\nf 1 2 4", Fine),
    ("v 1 1 1 0.5 0.5 0.5 1\nf 1 2 4", Warns(4, "the alpha of vertex colours was ignored")),
    ("v 1 1 1 1 0.5 0.5 0.5 1\nf 1 2 4", Warns(4, "vertex colours beside a weight were ignored")),
    ("v 1 1 1 0.5 0.5\nf 1 2 3", Line(4, "x y z r g b")),
    ("v 1 1 1 0.5 nan 0.5\nf 1 2 3", Line(4, "`nan` is not a finite number")),
    ("v 1 1 1 0.5 1e99 0.5\nf 1 2 3", Line(4, "too large a number")),
    ("v 1 1 1 255 0 128\nf 1 2 4", Warns(4, "vertex colours outside of 0 to 1")),
    ("v 1 1 1 0 0 -0.1\nf 1 2 4", Warns(4, "vertex colours outside of 0 to 1")),
    ("f 1 2 3\nl 1 2\np 1\n", Warns(5, "lines and points … 2 times")),
    ("f 1 2 3\ncurv 0 1 1 2\n", Warns(5, "statements `curv` were left out")),
    ("f 1 2 3\n\u{7f}ELF\u{1}\n", Line(5, "is not a statement of an OBJ file")),
    ("f 1 2 3\nzürich\n", Line(5, "is not a statement of an OBJ file")),
    ("f 1 2 3\n<html>\n", Line(5, "is not a statement of an OBJ file")),
];

/// Whole files.
const WHOLE: &[(&[u8], Expect)] = &[
    (b"", File("no faces")),
    (b"# nothing\n", File("no faces")),
    (b"v 0 0 0\n", File("no faces: the file holds 1 vertices")),
    (b"f 1 2 3", Line(1, "vertex index 1 … 0")),
    (b"\xff\xfev\0 \0", Line(1, "UTF-16")),
    (b"v 0 0 0\nv 0\0 0 0\n", Line(2, "zero byte")),
    (b"\xef\xbb\xbfv 0 0 0\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3", Fine),
    (b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0", Fine),
    (b"v 0 0 0\nv 1 0 0\nv \xff 0 0\n", Line(3, "is not a number")),
    (b"\\\n\\\n\\\n", File("no faces")),
];

/// Files in the course's dialect; `material` makes them so.
const COURSE: &[(&str, Expect)] = &[
    ("material\nv 0 0 0\n", File("no faces and no spheres")),
    ("material\ns 0 0 0 1", Fine),
    ("material\nm 0\ns 0 0 0 1", Fine),
    ("material\ns 0 0 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Fine),
    ("material\ndiffuse 1 1\n", Line(2, "`diffuse` takes 3 numbers")),
    ("material\ndiffuse 1 1 nan\n", Line(2, "not a finite number")),
    ("material\ndiffuse 1 1 2\n", Line(2, "`diffuse` outside of 0 to 1")),
    ("material\nemitted -1 0 0\n", Line(2, "`emitted` outside of 0")),
    ("material\nroughness -1\n", Line(2, "is negative")),
    ("material\ntexture_file\n", Line(2, "without a name")),
    ("material\nm -1\n", Line(2, "materials count 0, 1, 2")),
    ("material\nm 0.5\n", Line(2, "materials count 0, 1, 2")),
    ("material\nm 1\ns 0 0 0 1\n", Line(3, "material 1 … 1")),
    ("material\nv 0 0 0\nf 1 1 2\n", Line(3, "vertex index 2 … 1")),
    ("material\nf 1 2 3 4 5\n", Line(2, "a face with 5 corners")),
    ("material\nf 0 1 2\n", Line(2, "indices count 1, 2, 3")),
    ("material\ns 0 0 0 0\n", Line(2, "a sphere of radius 0")),
    ("material\nvt 0 0\n", Line(2, "`vt` before the first `v`")),
    ("material\nm 0\ndiffuse 1 1 1\n", Line(3, "outside of a `material`")),
    ("material\nvn 0 0 1\n", Line(2, "not a statement of the course's dialect")),
    (
        "material\nreflective 1 1 1\nroughness 0.3\nm 0\ns 0 0 0 1",
        Warns(3, "a rough mirror is rendered as a perfect one"),
    ),
    ("material\ntexture_file gone.ppm\nm 0\ns 0 0 0 1", Warns(2, "texture left out")),
];

#[test]
fn malformed_obj_files_are_errors_with_lines() {
    for (text, expect) in AFTER_A_TRIANGLES_VERTICES {
        check(text, load_bytes("obj", format!("{V}{text}").as_bytes(), &[]), expect);
        let dos = format!("{V}{text}").replace('\n', "\r\n");
        check(text, load_bytes("obj", dos.as_bytes(), &[]), expect);
    }
    for (bytes, expect) in WHOLE {
        check(&String::from_utf8_lossy(bytes), load_bytes("obj", bytes, &[]), expect);
    }
}

#[test]
fn malformed_course_files_are_errors_with_lines() {
    for (text, expect) in COURSE {
        check(text, load_bytes("obj", text.as_bytes(), &[]), expect);
    }
}

#[test]
fn degenerate_faces_are_dropped_with_one_warning() {
    let text = format!("{V}v 2 0 0\nf 1 2 3\nf 1 1 2\nf 1 2 4\nf 3 3 3 3 3\n");
    let model = load_bytes("obj", text.as_bytes(), &[]).expect("one good face");
    assert_eq!(model.world.meshes[0].triangles, [[0, 1, 2]]);
    assert_eq!(model.world.meshes[0].positions.len(), 3);
    let messages: Vec<_> = model.warnings.iter().map(|w| &w.message).collect();
    assert_eq!(messages, ["5 triangles without area dropped"]);
}

#[test]
fn a_file_of_degenerate_faces_is_an_empty_world_with_warnings() {
    let model = load_bytes("obj", format!("{V}f 1 1 2\n").as_bytes(), &[]).expect("read");
    assert!(model.world.meshes.is_empty());
    assert_eq!(model.warnings.len(), 2);
}

#[test]
fn a_face_that_would_take_minutes_to_cut_is_an_error() {
    let corners = 20_001;
    let mut text: String = (0..corners).map(|i| format!("v {i} {} 0\n", i % 2)).collect();
    text += "f";
    (1..=corners).for_each(|i| text += &format!(" {i}"));
    let expect = Line(corners + 1, "a concave face with 20001 corners; 20000 is the most");
    check("comb", load_bytes("obj", text.as_bytes(), &[]), &expect);
}
