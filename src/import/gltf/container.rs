//! The two containers: `.glb`, a header and chunks of bytes; and `.gltf`, bare JSON.

use crate::error::{Diagnostic, Result};
use std::path::Path;

/// The first four bytes of a `.glb`.
const MAGIC: &[u8] = b"glTF";
/// Bytes of a `.glb`'s header, and of a chunk's.
const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
/// Kinds of chunks.
const JSON: &[u8] = b"JSON";
const BIN: &[u8] = b"BIN\0";
/// Most bytes of JSON: parsed, it takes up to sixteen times as much memory.
const MAX_JSON: usize = 512 << 20;

/// The parts of a file.
#[derive(Debug, PartialEq)]
pub(super) struct Container<'a> {
    /// The JSON text.
    pub json: &'a [u8],
    /// The binary chunk.
    pub bin: Option<&'a [u8]>,
}

/// Takes a file apart; the content decides which container it is.
///
/// Errors: a `.glb` of another version than 2, lengths that lie, a first chunk that is no JSON, more JSON than
/// [`MAX_JSON`].
pub(super) fn open<'a>(file: &Path, bytes: &'a [u8]) -> Result<Container<'a>> {
    if bytes.is_empty() {
        return Err(Diagnostic::new(file, "the file is empty").into());
    }
    let container = if bytes.starts_with(MAGIC) {
        glb(file, bytes)?
    } else {
        // Some editors write a byte order mark.
        Container { json: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), bin: None }
    };
    let length = container.json.len();
    if length > MAX_JSON {
        let message = format!("{length} bytes of JSON; {MAX_JSON} can be read");
        let help = "keep geometry and images in a .glb or in files beside, not as data URIs";
        return Err(Diagnostic::new(file, message).help(help).into());
    }
    Ok(container)
}

fn glb<'a>(file: &Path, bytes: &'a [u8]) -> Result<Container<'a>> {
    let fault = |message: String| Err(Diagnostic::new(file, message).into());
    if bytes.len() < HEADER {
        return fault(format!("a .glb of {} bytes: its header alone has {HEADER}", bytes.len()));
    }
    let (version, length) = (word(bytes, 4), word(bytes, 8) as usize);
    if version != 2 {
        return fault(format!("a .glb of version {version}; version 2 can be read"));
    }
    let Some(bytes) = bytes.get(..length).filter(|all| all.len() >= HEADER) else {
        let is = bytes.len();
        return fault(format!(
            "the header says {length} bytes, the file has {is}: it is cut off or damaged"
        ));
    };
    let (mut json, mut bin, mut at) = (None, None, HEADER);
    while at < bytes.len() {
        let Some((kind, data)) = chunk(bytes, at) else {
            return fault(format!("the chunk at byte {at} goes beyond the end of the file"));
        };
        match kind {
            JSON if json.is_none() && at == HEADER => json = Some(data),
            BIN if bin.is_none() => bin = Some(data),
            // Chunks of other kinds are to be ignored.
            _ => {}
        }
        // Chunks are padded to four bytes; a file that ends without padding is whole.
        at += CHUNK_HEADER + data.len().next_multiple_of(4);
    }
    match json {
        Some(json) => Ok(Container { json, bin }),
        None => fault("the first chunk of the .glb is not JSON".into()),
    }
}

/// The kind and data of the chunk at byte `at`; `None` where it is not whole.
fn chunk(bytes: &[u8], at: usize) -> Option<(&[u8], &[u8])> {
    let header = bytes.get(at..)?.get(..CHUNK_HEADER)?;
    let data = bytes.get(at + CHUNK_HEADER..)?.get(..word(header, 0) as usize)?;
    Some((&header[4..], data))
}

/// The little-endian word at byte `at`, which must be there.
fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}
