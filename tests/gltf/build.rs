//! Small glTF files, built in code.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tweenray::error::Result;
use tweenray::import::{LoadOptions, Loaded, Model, load, load_model};
use tweenray::scene::NormalPolicy;

/// Types of components.
pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A file in the making: JSON, and the bytes of its one buffer.
#[derive(Clone)]
pub struct File {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl File {
    /// A file without anything.
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "meshes": [], "nodes": [],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A file of one triangle in the plane z = 0, from (0, 0) to (1, 0) and (0, 1), as mesh 0 of node 0.
    pub fn triangle() -> Self {
        let mut file = Self::new();
        let positions = file.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
        file.add("meshes", json!({"primitives": [{"attributes": {"POSITION": positions}}]}));
        file.add("nodes", json!({"mesh": 0}));
        file
    }

    /// Adds an element to a list of the top; its number.
    pub fn add(&mut self, list: &str, value: Value) -> usize {
        if self.json.get(list).is_none() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().expect("a list");
        list.push(value);
        list.len() - 1
    }

    /// Adds bytes as a buffer view; its number.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.bytes.len().next_multiple_of(4);
        self.bytes.resize(offset, 0);
        self.bytes.extend_from_slice(bytes);
        self.add(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}),
        )
    }

    /// Adds an accessor of packed elements; its number.
    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.add(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    /// Adds an accessor of floats; its number.
    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "MAT4" => 16,
            vector => vector[3..].parse().expect("VEC2, VEC3 or VEC4"),
        };
        self.accessor(kind, F32, values.len() / width, &bytes_of(values))
    }

    /// Adds an accessor of indices of 16 bits; its number.
    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor("SCALAR", U16, values.len(), &bytes)
    }

    /// The first primitive of mesh 0.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    /// Gives the triangle texture coordinates: those of the image's whole, with v downwards.
    pub fn with_uvs(mut self) -> Self {
        let uvs = self.floats("VEC2", &[0., 1., 1., 1., 0., 0.]);
        self.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
        self
    }

    /// Gives the triangle a material.
    pub fn with_material(mut self, material: Value) -> Self {
        let material = self.add("materials", material);
        self.primitive()["material"] = json!(material);
        self
    }

    /// Adds a png of `width` texels a row as image, texture and sampler; the number of the texture.
    pub fn image(&mut self, width: u32, texels: &[[u8; 4]], sampler: Value) -> usize {
        let view = self.view(&png(width, texels));
        let source = self.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.add("samplers", sampler);
        self.add("textures", json!({"source": source, "sampler": sampler}))
    }

    /// The `.glb`.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        glb_of(json.to_string().as_bytes(), &self.bytes)
    }

    /// Written as a `.glb` in a folder of its own.
    pub fn written(&self) -> Written {
        Written::of("test.glb", &self.glb())
    }

    /// The model of the `.glb`.
    pub fn model(&self) -> Model {
        self.try_model().unwrap_or_else(|e| panic!("{e}"))
    }

    pub fn try_model(&self) -> Result<Model> {
        self.written().model()
    }

    /// The job of the `.glb`, for an image of 64 x 48 pixels.
    pub fn loaded(&self) -> Loaded {
        self.loaded_with(&LoadOptions::default())
    }

    pub fn loaded_with(&self, options: &LoadOptions) -> Loaded {
        self.written().load(options).unwrap_or_else(|e| panic!("{e}"))
    }
}

/// The bytes of floats.
pub fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A `.glb` of two chunks.
pub fn glb_of(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bin)] {
        glb.extend((chunk.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(chunk);
    }
    glb
}

/// A png of 8 bits with alpha.
pub fn png(width: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, texels.len() as u32 / width);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&texels.concat()).expect("written");
    drop(writer);
    bytes
}

/// A file in a folder of its own.
pub struct Written {
    folder: TempDir,
    pub path: PathBuf,
}

impl Written {
    pub fn of(name: &str, content: &[u8]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        Self { folder, path }
    }

    /// Puts a file beside.
    pub fn beside(&self, name: &str, content: &[u8]) {
        std::fs::write(self.folder.path().join(name), content).expect("written");
    }

    pub fn model(&self) -> Result<Model> {
        model(&self.path)
    }

    pub fn load(&self, options: &LoadOptions) -> Result<Loaded> {
        load(&self.path, options)
    }
}

pub fn model(path: &Path) -> Result<Model> {
    load_model(path, NormalPolicy::Auto { crease_degrees: 30.0 })
}

/// Whether any warning of `model` says `part`.
pub fn warns(warnings: &[tweenray::error::Diagnostic], part: &str) -> bool {
    warnings.iter().any(|w| w.message.contains(part))
}
