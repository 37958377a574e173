//! PLY files.

use super::{Expect, Expect::*, check, load_bytes};

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const LIST: &str = "property list uchar int vertex_indices\n";
const POINTS: &str = "0 0 0\n1 0 0\n0 1 0\n";

/// `HEAD`, `XYZ`, `LIST` and `POINTS` stand for the usual lines.
const ASCII: &[(&str, Expect)] = &[
    ("HEADelement vertex 3\nXYZelement face 1\nLISTend_header\nPOINTS3 0 1 2\n", Fine),
    ("HEADelement vertex 3\nXYZelement face 1\nLISTend_header\nPOINTS\n\n3 0 1 2", Fine),
    ("HEADelement face 1\nLISTelement vertex 3\nXYZend_header\n3 0 1 2\nPOINTS", Fine),
    ("HEADelement vertex 3\nXYZelement tristrips 1\nLISTend_header\nPOINTS4 0 1 2 -1\n", Fine),
    ("", Line(1, "the header does not end")),
    ("ply", Line(1, "the header does not end")),
    ("plyformat\n", Line(1, "the first line is not `ply`")),
    ("ply\nend_header\n", Line(1, "no `format` line")),
    ("ply\nformat text 1.0\n", Line(2, "format `text` is unknown")),
    ("ply\nformat ascii 2.0\n", Line(2, "version `2.0`")),
    ("ply\nformat ascii\n", Line(2, "version ``")),
    ("HEAD", Line(3, "the header does not end")),
    ("HEADelement vertex\n", Line(3, "a name and a count")),
    ("HEADelement vertex -1\n", Line(3, "`-1` is no count")),
    ("HEADelement vertex 1e9\n", Line(3, "`1e9` is no count")),
    ("HEADelement vertex 99999999999999999999999\n", Line(3, "is no count")),
    ("HEADelement vertex 3\nelement vertex 3\n", Line(4, "element `vertex` occurs twice")),
    ("HEADproperty float x\n", Line(3, "before the first `element`")),
    ("HEADelement vertex 3\nproperty float\n", Line(4, "takes a type and a name")),
    ("HEADelement vertex 3\nproperty half x\n", Line(4, "`half` is no type")),
    ("HEADelement vertex 3\nproperty list uchar x\n", Line(4, "takes a type and a name")),
    ("HEADelement face 1\nproperty list float int vertex_indices\n", Line(4, "by a fraction")),
    ("HEADelement vertex 3\nproperty float x\nproperty int x\n", Line(5, "`x` occurs twice")),
    ("HEADgarbage\n", Line(3, "`garbage` is no header line")),
    ("HEADelement vertex 3\nXYZend_header\nPOINTS", File("a point cloud: 3 vertices")),
    ("HEADelement vertex 3\nXYZelement face 0\nLISTend_header\nPOINTS", File("a point cloud")),
    ("HEADelement vertex 1000000000\nXYZend_header\n0 0 0\n", Line(3, "bytes follow the header")),
    ("HEADelement vertex 18446744073709551615\nXYZend_header\n", Line(3, "follow the header")),
    ("HEADelement vertex 3\nend_header\nPOINTS", Line(3, "`vertex` has no properties")),
    (
        "HEADelement vertex 3\nproperty float x\nproperty float y\nend_header\n0 0\n1 0\n0 1\n",
        Line(3, "no x, y and z"),
    ),
    (
        "HEADelement vertex 3\nXYZelement face 1\nproperty int vertex_indices\nend_header\nPOINTS3\n",
        Line(8, "no list of whole numbers"),
    ),
    (
        "HEADelement vertex 3\nXYZelement face 1\nproperty list uchar float vertex_indices\n\
         end_header\nPOINTS3 0 1 2\n",
        Line(8, "no list of whole numbers"),
    ),
    (
        "HEADelement vertex 3\nXYZelement face 1\nproperty list uchar int corners\nend_header\n\
         POINTS3 0 1 2\n",
        Line(7, "has no list `vertex_indices`"),
    ),
    ("TRIANGLE3 0 1 3\n", Line(13, "vertex index 3 … 3")),
    ("TRIANGLE3 0 1 -1\n", Line(13, "vertex index -1")),
    ("TRIANGLE3 0 1 1.5\n", Line(13, "1.5 is no vertex index")),
    ("TRIANGLE3 0 1\n", Line(13, "a list of 3 items, more than the file holds")),
    ("TRIANGLE3 0 1 2 3\n", Line(13, "`3` is one value too many")),
    ("TRIANGLE2 0 1        \n", Line(13, "a face with 2 corners")),
    ("TRIANGLE-3 0 1 2\n", Line(13, "a list of -3 items")),
    ("TRIANGLE1000000000 0\n", Line(13, "a list of 1000000000 items")),
    ("TRIANGLE3 0 x 2\n", Line(13, "`x` is not a number")),
    ("TRIANGLE\n\n\n\n\n", Line(18, "the file ends too early")),
    (
        "HEADelement vertex 3\nXYZelement face 1\nLISTend_header\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n",
        Line(11, "the position of vertex 1 (from 0) is not a finite number"),
    ),
    (
        "HEADelement vertex 3\nXYZelement face 1\nLISTend_header\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n",
        Line(11, "too few values"),
    ),
    (
        "HEADelement vertex 3\nXYZelement tristrips 1\nLISTend_header\nPOINTS3 0 1 -2\n",
        Line(13, "vertex index -2"),
    ),
    (
        "HEADelement vertex 3\nXYZproperty uchar red\nelement face 1\nLISTend_header\n\
         0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n",
        Warns(3, "vertex colours without `green` were ignored"),
    ),
    ("COLOURED uchar0 0 0 1 2 3\n1 0 0 4 5 6\n0 1 0 7 8 9\n3 0 1 2\n", Fine),
    (
        "COLOURED uchar0 0 0 1 2 3\n1 0 0 4 nan 6\n0 1 0 7 8 9\n3 0 1 2\n",
        Line(14, "the colour of vertex 1 (from 0) is not a finite number"),
    ),
    (
        "COLOURED float0 0 0 1 1 1\n1 0 0 0 0 0\n0 1 0 0 inf 0\n3 0 1 2\n",
        Line(15, "the colour of vertex 2 (from 0) is not a finite number"),
    ),
    ("COLOURED float0 0 0 1 1 1\n1 0 0 0 0 0\n0 1 0 0 0\n3 0 1 2\n", Line(15, "too few values")),
    (
        "HEADelement vertex 3\nXYZelement edge 1\nproperty int a\nelement face 1\nLISTend_header\n\
         POINTS7\n3 0 1 2\n",
        Warns(7, "element `edge` was skipped"),
    ),
];

fn expand(text: &str) -> String {
    let coloured = |t: &str| {
        let colours = ["red", "green", "blue"].map(|c| format!("property {t} {c}\n")).concat();
        format!("HEADelement vertex 3\nXYZ{colours}element face 1\nLISTend_header\n")
    };
    text.replace("COLOURED uchar", &coloured("uchar"))
        .replace("COLOURED float", &coloured("float"))
        .replace("TRIANGLE", "HEADelement vertex 3\nXYZelement face 1\nLISTend_header\nPOINTS")
        .replace("HEAD", "ply\nformat ascii 1.0\n")
        .replace("XYZ", XYZ)
        .replace("LIST", LIST)
        .replace("POINTS", POINTS)
}

#[test]
fn malformed_ascii_files_are_errors_with_lines() {
    for (text, expect) in ASCII {
        check(text, load_bytes("ply", expand(text).as_bytes(), &[]), expect);
    }
}

fn binary(vertices: usize, faces: usize, body: &[u8]) -> Vec<u8> {
    let text = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{XYZ}\
         element face {faces}\n{LIST}end_header\n"
    );
    [text.as_bytes(), body].concat()
}

fn body(third: [i32; 3]) -> Vec<u8> {
    let points = [0f32, 0., 0., 1., 0., 0., 0., 1., 0.];
    let points = points.iter().flat_map(|x| x.to_le_bytes());
    points.chain([3]).chain(third.iter().flat_map(|i| i.to_le_bytes())).collect()
}

#[test]
fn malformed_binary_files_are_errors_with_byte_offsets() {
    let good = binary(3, 1, &body([0, 1, 2]));
    check("good", load_bytes("ply", &good, &[]), &Fine);
    let start = good.len() - body([0, 1, 2]).len();
    assert_eq!(start, 169, "the offsets below count from here");
    let mut two_corners = body([0, 1, 2]);
    two_corners[36] = 2;
    let mut long_list = body([0, 1, 2]);
    long_list[36] = 255;
    let mut not_finite = body([0, 1, 2]);
    not_finite[12..16].copy_from_slice(&f32::NAN.to_le_bytes());
    let cases: Vec<(Vec<u8>, Expect)> = vec![
        (binary(3, 1, &body([0, 1, 3])), File("at byte 205: vertex index 3")),
        (binary(3, 1, &body([0, -1, 2])), File("at byte 205: vertex index -1")),
        (binary(3, 1, &body([0, i32::MIN, 2])), File("vertex index -2147483648")),
        (binary(3, 1, &two_corners), File("a face with 2 corners")),
        (binary(3, 1, &long_list), File("at byte 205: a list of 255 items")),
        (binary(3, 1, &not_finite), File("the position of vertex 1 (from 0)")),
        (binary(3, 1, &body([0, 1, 2])[..40]), File("a list of 3 items")),
        (binary(3, 1, &body([0, 1, 2])[..20]), Line(3, "bytes follow the header")),
        (binary(3, 1_000_000_000, &body([0, 1, 2])), Line(7, "1000000000 of `face`, but only 49")),
        (binary(1_000_000_000, 1, &body([0, 1, 2])), Line(3, "1000000000 of `vertex`")),
        (binary(usize::MAX, 1, &body([0, 1, 2])), Line(3, "follow the header")),
        (binary(3, 2, &body([0, 1, 2])), File("the file ends too early")),
        (binary(0, 1, &body([0, 0, 0])[36..]), File("but the file has only 0")),
    ];
    for (number, (bytes, expect)) in cases.into_iter().enumerate() {
        check(&format!("binary case {number}"), load_bytes("ply", &bytes, &[]), &expect);
    }
}

#[test]
fn every_truncation_is_an_error() {
    let good = binary(3, 1, &body([0, 1, 2]));
    for length in 0..good.len() {
        load_bytes("ply", &good[..length], &[]).expect_err("too short");
    }
    let text = expand("TRIANGLE3 0 1 2");
    for length in 0..text.len() {
        load_bytes("ply", &text.as_bytes()[..length], &[]).expect_err("too short");
    }
}
