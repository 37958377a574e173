use super::*;
use crate::math::Vec2;

/// A file in one of the three formats, from values as text.
fn encode(format: &str, header: &str, records: &[&str]) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {format} 1.0\n{header}end_header\n").into_bytes();
    for record in records {
        if format == "ascii" {
            bytes.extend(
                record
                    .split(' ')
                    .filter_map(|w| w.split(':').next())
                    .flat_map(|w| [w, " "].concat().into_bytes()),
            );
            bytes.push(b'\n');
            continue;
        }
        for (value, t) in record.split(' ').filter_map(|w| w.split_once(':')) {
            let mut number = match t {
                "f4" => value.parse::<f32>().expect("a float").to_be_bytes().to_vec(),
                "f8" => value.parse::<f64>().expect("a double").to_be_bytes().to_vec(),
                "i1" => value.parse::<i8>().expect("a char").to_be_bytes().to_vec(),
                "u1" => value.parse::<u8>().expect("a uchar").to_be_bytes().to_vec(),
                "i2" => value.parse::<i16>().expect("a short").to_be_bytes().to_vec(),
                "u2" => value.parse::<u16>().expect("a ushort").to_be_bytes().to_vec(),
                "i4" => value.parse::<i32>().expect("an int").to_be_bytes().to_vec(),
                _ => value.parse::<u32>().expect("a uint").to_be_bytes().to_vec(),
            };
            if format.contains("little") {
                number.reverse();
            }
            bytes.extend(number);
        }
    }
    bytes
}

/// The mesh, by the fast and the general way, which must agree.
fn read_both(bytes: &[u8]) -> WorldMesh {
    let read = |fast| {
        let model = read_by(Path::new("test.ply"), bytes, fast).expect("a good file");
        (model.world.meshes[0].clone(), model.warnings)
    };
    let (a, b) = (read(true), read(false));
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
    a.0
}

const FORMATS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

#[test]
fn every_type_and_order_reads_alike_in_every_format() {
    let header = "comment a\nobj_info b\nelement camera 1\nproperty list uint short who\n\
        property double f\nelement vertex 5\nproperty int8 weight\nproperty double z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty list uchar uint16 tags\n\
        property float32 y\nproperty int16 x\nproperty float texture_u\nproperty float texture_v\n\
        element face 2\nproperty ushort flags\nproperty list uint16 int16 vertex_index\n\
        property list uchar float texcoord\nelement edge 1\nproperty int a\n";
    let records = [
        "2:u4 7:i2 -8:i2 0.5:f8",
        "-1:i1 0:f8 0:f4 0:f4 2:f4 1:u1 9:u2 0:f4 0:i2 0:f4 0:f4",
        "-1:i1 0:f8 0:f4 0:f4 2:f4 0:u1 0:f4 4:i2 1:f4 0:f4",
        "-1:i1 0:f8 0:f4 0:f4 0:f4 2:u1 9:u2 8:u2 4:f4 4:i2 1:f4 1:f4",
        "-1:i1 0:f8 0:f4 0:f4 2:f4 0:u1 1:f4 3:i2 0.25:f4 0.25:f4",
        "-1:i1 0.125:f8 0:f4 0:f4 2:f4 0:u1 4:f4 0:i2 0:f4 1:f4",
        "1:u2 3:u2 0:i2 1:i2 2:i2 2:u1 0.5:f4 0.5:f4",
        "1:u2 4:u2 0:i2 3:i2 2:i2 4:i2 0:u1",
        "3:i4",
    ];
    for format in FORMATS {
        let bytes = encode(format, header, &records);
        let mesh = read_both(&bytes);
        assert_eq!(mesh.positions[4], DVec3::new(0.0, 4.0, 0.125), "{format}");
        // The second face is convex; its fan starts at its first corner.
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 3, 2], [0, 2, 4]], "{format}");
        let normals = &mesh.normals.as_ref().expect("normals").values;
        assert_eq!((normals[0], normals[2]), (Vec3::Z, Vec3::ZERO), "{format}");
        assert_eq!(mesh.uvs.expect("uvs").values[3], Vec2::splat(0.25), "{format}");
    }
}

#[test]
fn sets_of_texture_coordinates_have_numbers() {
    // The number 3 follows nothing; of an unused vertex no set keeps anything.
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property float t1\nproperty float s1\nproperty float s\nproperty float t\n\
        property float s3\nproperty float t3\nelement face 1\nproperty list uchar int vertex_indices\n";
    let records = [
        "9:f4 9:f4 9:f4 9:f4 9:f4 9:f4 9:f4 9:f4 9:f4",
        "0:f4 0:f4 0:f4 0.5:f4 0.25:f4 0:f4 0:f4 9:f4 9:f4",
        "1:f4 0:f4 0:f4 1:f4 0.25:f4 1:f4 0:f4 9:f4 9:f4",
        "0:f4 1:f4 0:f4 0.5:f4 0.75:f4 0:f4 1:f4 9:f4 9:f4",
        "3:u1 1:i4 2:i4 3:i4",
    ];
    for format in FORMATS {
        let mesh = read_both(&encode(format, header, &records));
        let values = |set| mesh.uv_set(set).map(|uvs| uvs.values.clone());
        assert_eq!(values(0), Some(vec![Vec2::ZERO, Vec2::X, Vec2::Y]), "{format}");
        let second = [(0.25, 0.5), (0.25, 1.0), (0.75, 0.5)].map(|(u, v)| Vec2::new(u, v));
        assert_eq!(values(1), Some(second.to_vec()), "{format}");
        assert_eq!((values(2), mesh.more_uvs.len()), (None, 1), "{format}");
    }
}

#[test]
fn strips_alternate_and_restart() {
    let header = "element vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 2\nproperty list int int vertex_indices\n";
    let records = [
        "0:f4 0:f4 0:f4",
        "0:f4 1:f4 0:f4",
        "1:f4 0:f4 0:f4",
        "1:f4 1:f4 0:f4",
        "2:f4 0:f4 0:f4",
        "2:f4 1:f4 0:f4",
        // Four triangles; a restart and one more; a join by repeated vertices keeps the beat.
        "10:i4 1:i4 0:i4 3:i4 2:i4 5:i4 4:i4 -1:i4 1:i4 0:i4 3:i4",
        "8:i4 1:i4 0:i4 3:i4 3:i4 3:i4 2:i4 5:i4 -1:i4",
    ];
    for format in FORMATS {
        let mesh = read_both(&encode(format, header, &records));
        let first = [[1, 0, 3], [3, 0, 2], [3, 2, 5], [5, 2, 4]];
        assert_eq!(mesh.triangles[..4], first, "{format}");
        assert_eq!(mesh.triangles[4..], [[1, 0, 3], [1, 0, 3], [3, 2, 5]], "{format}");
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "{t:?}");
        }
    }
}

#[test]
fn a_concave_face_is_cut_inside() {
    let header = "element vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
        element face 1\nproperty list uchar uchar vertex_indices\n";
    let records = [
        "0:f8 0:f8 0:f8",
        "2:f8 -1:f8 0:f8",
        "0.5:f8 0:f8 0:f8",
        "2:f8 1:f8 0:f8",
        "4:u1 1:u1 2:u1 3:u1 0:u1",
    ];
    for format in FORMATS {
        let mesh = read_both(&encode(format, header, &records));
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            assert!((b - a).cross(c - a).z > 0.0, "{t:?}");
        }
    }
}

#[test]
fn the_usual_layout_takes_the_fast_way() {
    for (format, index) in [("binary_little_endian", "int"), ("binary_big_endian", "uint")] {
        let header = format!(
            "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
             element face 2\nproperty list uchar {index} vertex_indices\n"
        );
        let records = [
            "0:f4 0:f4 0:f4",
            "1:f4 0:f4 0:f4",
            "0:f4 1:f4 0:f4",
            "0:f4 0:f4 1:f4",
            "3:u1 0:i4 1:i4 2:i4",
            "3:u1 2:i4 1:i4 3:i4",
        ];
        let bytes = encode(format, &header, &records);
        assert_eq!(read_both(&bytes).triangles, [[0, 1, 2], [2, 1, 3]]);
        let header = header::read(&bytes).expect("a header");
        let path = Path::new("test.ply");
        let body = Body { path, bytes: &bytes, header: &header, fast: true };
        let contents = body.contents().expect("contents");
        assert!(matches!(contents.faces, Faces::Triangles(t) if t.len() == 2));
    }
}

#[test]
fn several_face_elements_join() {
    let header = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\n\
        element tristrips 1\nproperty list int int vertex_indices\n";
    let records = [
        "0:f4 0:f4 0:f4",
        "1:f4 0:f4 0:f4",
        "0:f4 1:f4 0:f4",
        "0:f4 0:f4 1:f4",
        "3:u1 0:i4 1:i4 2:i4",
        "3:i4 2:i4 1:i4 3:i4",
    ];
    for format in FORMATS {
        let mesh = read_both(&encode(format, header, &records));
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    }
}

#[test]
fn colours_of_every_type_read_alike_in_every_format() {
    let header = |t: &str| {
        format!(
            "element vertex 3\nproperty float x\nproperty {t} diffuse_red\nproperty {t} diffuse_green\n\
             property float y\nproperty float z\nproperty {t} diffuse_blue\n\
             element face 1\nproperty list uchar int vertex_indices\n"
        )
    };
    for (t, short, full) in [
        ("uchar", "u1", 255.0),
        ("ushort", "u2", 65_535.0),
        ("int", "i4", 255.0),
        ("double", "f8", 1.0),
    ] {
        let record = |p: [u32; 3], c: [f64; 3]| {
            let [r, g, b] = c.map(|c| format!("{}:{short}", c * full));
            format!("{}:f4 {r} {g} {}:f4 {}:f4 {b}", p[0], p[1], p[2])
        };
        let colours = [[1.0, 0.0, 0.2], [0.4, 1.0, 0.0], [0.6, 0.8, 1.0]];
        let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
        let records: Vec<String> =
            corners.iter().zip(colours).map(|(p, c)| record(*p, c)).collect();
        let mut records: Vec<&str> = records.iter().map(String::as_str).collect();
        records.push("3:u1 0:i4 1:i4 2:i4");
        for format in FORMATS {
            let mesh = read_both(&encode(format, &header(t), &records));
            let found = mesh.colours.expect("colours");
            let expected = colours.map(|c| c.map(|c| (c * 255.0).round() as u8));
            assert_eq!(found.codes(), Some(&expected[..]), "{t} {format}");
        }
    }
}
