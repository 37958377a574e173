//! Random damage to good files: whatever comes of it, no panic and no unsound mesh.

use super::{load_bytes, sound};
use proptest::prelude::*;

const OBJ: &[u8] = b"mtllib bad.mtl\no a\nv 0 0 0 1\nv 1 0 0\nv 1 1 0\nv 0 1e0 0\nv .2 .3 0\n\
    vt 0 0\nvt 1 0\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3//1 4 -1\nf 1 2 3\nusemtl b\nl 1 2\n\
    f -5//-1 -4//-1 \\\n -3//-1\n";
const MTL: &[u8] = b"newmtl a\nKd .1 .2 .3\nKs 1 1 1\nillum 3\nmap_Kd -s 1 1 1 x.ppm\nnewmtl b\n\
    Ni 1.5\nd 0.5\nTf 1 1 1\nKe 1 1 1\nNs 10\n";
const PPM: &[u8] = b"P6 2 1 255\n\x00\x80\xff\xff\x00\x00";
const COURSE: &[u8] = b"material\ndiffuse 0 0 0\nemitted 2 2 2\nroughness 0\n\nmaterial\n\
    texture_file x.ppm\nreflective .8 0 0\n\nm 0\nv -6 10 6\nv -6 10 4\nvt 0 0\nv -4 10 4\n\
    v -4 10 6\nf 1 2 3 4\nm 1\nf 1 2 3\ns 0 0 0 1\n";
const PLY: &[u8] = b"ply\nformat ascii 1.0\ncomment x\nelement vertex 5\nproperty float x\n\
    property double y\nproperty int z\nproperty float nx\nproperty float ny\nproperty float nz\n\
    property list uchar int l\nelement face 2\nproperty uchar c\n\
    property list uchar uint vertex_index\nelement tristrips 1\n\
    property list int int vertex_indices\nend_header\n0 0 0 0 0 1 0\n1 0 0 0 0 1 1 7\n\
    1 1 0 0 0 1 0\n0 1 0 0 0 1 0\n.5 .2 0 0 0 1 0\n9 3 0 1 2\n9 5 0 1 2 3 4\n7 0 1 2 3 -1 0 1\n";

fn binary_ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nproperty float s\nproperty float t\nelement face 2\n\
        property list uchar int vertex_indices\nelement tristrips 1\n\
        property list int int vertex_indices\nend_header\n"
        .to_vec();
    for v in
        [[0f32, 0., 0., 0., 0.], [1., 0., 0., 1., 0.], [0., 1., 0., 0., 1.], [1., 1., 1., 1., 1.]]
    {
        bytes.extend(v.iter().flat_map(|x| x.to_be_bytes()));
    }
    for face in [[0i32, 1, 2], [1, 3, 2]] {
        bytes.push(3);
        bytes.extend(face.iter().flat_map(|i| i.to_be_bytes()));
    }
    for i in [6i32, 0, 1, 2, 3, -1, 0] {
        bytes.extend(i.to_be_bytes());
    }
    bytes
}

/// Words that parsers trip over.
const WORDS: [&str; 12] = [
    "nan",
    "-1",
    "0",
    "4294967296",
    "1e400",
    "\\\n",
    "\0",
    "/",
    " ",
    "\n",
    "f ",
    "99999999999999999999",
];

fn damage(bytes: &[u8], changes: &[(usize, u8, u8)]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for (at, kind, value) in changes {
        let at = at % (bytes.len() + 1);
        match kind % 5 {
            0 if at < bytes.len() => bytes[at] = *value,
            1 if at < bytes.len() => bytes[at] ^= 1 << (value % 8),
            2 if at < bytes.len() => drop(bytes.remove(at)),
            3 => drop(bytes.splice(at..at, WORDS[*value as usize % WORDS.len()].bytes())),
            _ => {
                let end = (at + *value as usize % 12).min(bytes.len());
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

fn try_out(ending: &str, bytes: &[u8], mtl: &[u8]) {
    let others: &[(&str, &[u8])] = &[("bad.mtl", mtl), ("x.ppm", PPM)];
    if let Ok(model) = load_bytes(ending, bytes, others) {
        sound(&model);
    }
}

#[test]
fn the_undamaged_files_are_good() {
    for (ending, bytes) in [("obj", OBJ), ("obj", COURSE), ("ply", PLY), ("ply", &binary_ply())] {
        let others: &[(&str, &[u8])] = &[("bad.mtl", MTL), ("x.ppm", PPM)];
        let model = load_bytes(ending, bytes, others);
        sound(&model.unwrap_or_else(|e| panic!("{ending}: {e}")));
    }
}

/// 2000 cases, or more where the variable PROPTEST_CASES asks for it.
fn config() -> ProptestConfig {
    let asked = ProptestConfig::default();
    ProptestConfig { cases: asked.cases.max(2000), failure_persistence: None, ..asked }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn damaged_files_never_panic(
        which in 0..5,
        changes in prop::collection::vec((any::<usize>(), any::<u8>(), any::<u8>()), 1..6),
    ) {
        match which {
            0 => try_out("obj", &damage(OBJ, &changes), MTL),
            1 => try_out("obj", OBJ, &damage(MTL, &changes)),
            2 => try_out("obj", &damage(COURSE, &changes), MTL),
            3 => try_out("ply", &damage(PLY, &changes), MTL),
            _ => try_out("ply", &damage(&binary_ply(), &changes), MTL),
        }
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        try_out("obj", &bytes, &bytes);
        try_out("obj", OBJ, &bytes);
        let header = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n\
            property float y\nproperty float z\nelement face 3\nproperty list int int vertex_index\n\
            end_header\n";
        try_out("ply", &[header, &bytes[..]].concat(), MTL);
    }
}
