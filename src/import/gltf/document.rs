//! The file as a whole: its JSON, its buffers, and the extensions that it asks for.

use super::container::Container;
use super::extensions;
use super::json::Json;
use super::uri::{self, Resource};
use crate::error::{Diagnostic, Error, Result};
use crate::import::source;
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A parsed file with its buffers.
pub(super) struct Document<'a> {
    /// The file's path, as the user named it.
    pub file: &'a Path,
    /// The top of the JSON.
    pub top: Json<'a>,
    pub accessors: Vec<Json<'a>>,
    pub views: Vec<Json<'a>>,
    pub meshes: Vec<Json<'a>>,
    pub materials: Vec<Json<'a>>,
    pub cameras: Vec<Json<'a>>,
    pub nodes: Vec<Json<'a>>,
    pub skins: Vec<Json<'a>>,
    /// Of KHR_lights_punctual.
    pub lights: Vec<Json<'a>>,
    buffers: Vec<Buffer<'a>>,
    /// Bytes of all buffers, those of one file counted once.
    bytes: usize,
}

/// The bytes of a buffer, which are as many as it says.
enum Buffer<'a> {
    Inside(&'a [u8]),
    /// Data, or a file, which several buffers may name; and how many bytes of it count.
    Beside(Arc<Vec<u8>>, usize),
}

/// The JSON of a file.
///
/// Errors: what is no JSON, with its line and column; deep nesting.
pub(super) fn parse(file: &Path, container: &Container<'_>) -> Result<Value> {
    serde_json::from_slice(container.json).map_err(|error| {
        let message = format!("the JSON of the file is damaged: {error}");
        let message = message.split(" at line").next().unwrap_or_default().to_owned();
        let place = Diagnostic::new(file, message);
        // In a .glb lines are those of its JSON, which no editor shows.
        let place = if container.bin.is_some() || error.line() == 0 {
            place
        } else {
            place.at(error.line(), error.column().max(1))
        };
        place.help("export the file again, or check it with a glTF validator").into()
    })
}

impl<'a> Document<'a> {
    /// The document of the JSON `value`, with all its buffers; names of files read are added to `files`.
    ///
    /// Errors: another version than 2, extensions that are required and unknown, buffers that are shorter than they say.
    pub fn open(
        file: &'a Path,
        value: &'a Value,
        bin: Option<&'a [u8]>,
        files: &mut Vec<PathBuf>,
    ) -> Result<Self> {
        let top = Json::top(file, value);
        if !value.is_object() {
            return Err(top.fault("the JSON is no object: this is not a glTF file").into());
        }
        check_version(&top)?;
        extensions::check_required(&top)?;
        let mut document = Self {
            file,
            accessors: top.list("accessors")?,
            views: top.list("bufferViews")?,
            meshes: top.list("meshes")?,
            materials: top.list("materials")?,
            cameras: top.list("cameras")?,
            nodes: top.list("nodes")?,
            skins: top.list("skins")?,
            lights: match top.extension("KHR_lights_punctual") {
                Some(json) => json.list("lights")?,
                None => Vec::new(),
            },
            buffers: Vec::new(),
            bytes: 0,
            top,
        };
        let mut known = HashMap::new();
        for (at, json) in document.top.list("buffers")?.iter().enumerate() {
            let buffer = read_buffer(file, json, bin.filter(|_| at == 0), &mut known)?;
            document.bytes += match &buffer {
                Buffer::Beside(bytes, _) if Arc::strong_count(bytes) > 2 => 0,
                buffer => buffer.bytes().len(),
            };
            document.buffers.push(buffer);
        }
        let mut names: Vec<PathBuf> = known.into_keys().collect();
        names.sort();
        files.extend(names);
        Ok(document)
    }

    /// Bytes of all buffers. No list of the file has more elements than these, or it would be made up.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The bytes of the buffer view that `key` of `json` names, and its stride.
    ///
    /// Errors: no such view, or one that goes beyond its buffer.
    pub fn view(&self, json: &Json<'_>, key: &str) -> Result<Option<(&[u8], Option<usize>)>> {
        let Some(at) = json.index(key, self.views.len(), "buffer view")? else { return Ok(None) };
        let view = &self.views[at];
        let buffer = view.required("buffer")?.as_index(self.buffers.len(), "buffer")?;
        let buffer = self.buffers[buffer].bytes();
        let offset = view.whole("byteOffset")?.unwrap_or(0);
        let length = view.whole("byteLength")?.unwrap_or(0);
        let bytes = buffer.get(offset..).and_then(|rest| rest.get(..length));
        let Some(bytes) = bytes else {
            let has = buffer.len();
            let message =
                format!("{length} bytes from byte {offset} on, of a buffer of {has} bytes");
            return Err(view.fault(message).into());
        };
        Ok(Some((bytes, view.whole("byteStride")?)))
    }
}

/// Most minor version of glTF 2 that is read.
const MINOR: u32 = 0;

fn check_version(top: &Json<'_>) -> Result<()> {
    let help = "export or convert it to glTF 2.0";
    let Some(asset) = top.get("asset") else {
        return Err(top.fault("`asset` is missing: this is no glTF 2.0").help(help).into());
    };
    let (version, least) = (asset.text("version")?, asset.text("minVersion")?);
    let Some(version) = least.or(version) else {
        return Err(asset.fault("`version` is missing").help(help).into());
    };
    let mut parts = version.split('.').map(|part| part.parse::<u32>().ok());
    let (major, minor) = (parts.next().flatten(), parts.next().flatten());
    // What is of a later 2.x can be read as 2.0 unless it says that it needs more.
    if major == Some(2) && (least.is_none() || minor <= Some(MINOR)) {
        return Ok(());
    }
    let message =
        format!("glTF of version `{}`; version 2.{MINOR} can be read", uri::shortened(version));
    Err(asset.fault(message).help(help).into())
}

impl Buffer<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Inside(bytes) => bytes,
            Self::Beside(bytes, length) => &bytes[..*length],
        }
    }
}

/// Reads a buffer; files that are `known` are not read again.
fn read_buffer<'a>(
    file: &Path,
    json: &Json<'_>,
    bin: Option<&'a [u8]>,
    known: &mut HashMap<PathBuf, Arc<Vec<u8>>>,
) -> Result<Buffer<'a>> {
    let length = json.required("byteLength")?.as_whole()?;
    let (bytes, has): (Option<Arc<Vec<u8>>>, usize) = match json.text("uri")? {
        Some(uri) => {
            let bytes = match uri::resolve(json, uri, file)? {
                Resource::Data(bytes) => Arc::new(bytes),
                Resource::File(path) => match known.get(&path) {
                    Some(bytes) => bytes.clone(),
                    None => {
                        let bytes = Arc::new(read_beside(json, &path)?);
                        known.entry(path).or_insert(bytes).clone()
                    }
                },
            };
            let has = bytes.len();
            (Some(bytes), has)
        }
        None => (None, bin.map_or(0, <[u8]>::len)),
    };
    if bytes.is_none() && bin.is_none() {
        let message = "the buffer has no `uri`, and the file no binary chunk";
        return Err(extensions::packed(json).unwrap_or_else(|| json.fault(message)).into());
    }
    if has < length {
        return Err(json.fault(format!("the buffer says {length} bytes and has {has}")).into());
    }
    // A chunk is padded.
    Ok(match bytes {
        Some(bytes) => Buffer::Beside(bytes, length),
        None => Buffer::Inside(&bin.unwrap_or_default()[..length]),
    })
}

/// Reads a file that `json` names.
///
/// Errors: those of [`source::read`], at `json`.
pub(super) fn read_beside(json: &Json<'_>, path: &Path) -> Result<Vec<u8>> {
    source::read(path).map_err(|error| match error {
        Error::Io { source, .. } => {
            let help = "a .gltf needs the files beside it that it names; a .glb holds them all";
            json.fault(format!("cannot read {}: {source}", path.display())).help(help).into()
        }
        other => other,
    })
}
