//! OpenEXR: any number of named channels of one size, in one part of scanlines, ZIP-compressed in
//! blocks of 16 rows. (Multi-part and tiled files break viewers.)
//!
//! A film's channels are `R G B`, and of its AOVs those that are asked for: `Z` (distance along the view axis, infinity
//! where nothing is hit), `P.X P.Y P.Z` (position), `N.X N.Y N.Z` (normal), `albedo.R albedo.G
//! albedo.B`, `backward.u backward.v` (motion, pixels), all f32, and `mesh_id` (u32, 0 where nothing
//! is hit). World units throughout. [`maps`](super::maps) adds its own. A later AOV is another [`ExrChannel`] in the list.
//!
//! The files hold at most one attribute that the crate `exr` keeps in a hash map, whose order differs
//! from run to run: the same film is the same bytes.

use super::format::SOFTWARE;
use super::path_kind::{Regular, check_memory};
use crate::error::{Error, Result};
use crate::film::Film;
use crate::math::Vec3;
use crate::scene::{Aov, Aovs};
use exr::block::writer::ChunksWriter;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::layers::{LayersWriter, WritableLayers};
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, ReadChannels, ReadLayers, Text, Vec2,
};
use rayon::prelude::*;
use std::io::{BufRead, Cursor, Seek};
use std::path::Path;

/// Type of the program's own attribute, which other programs ignore.
const OPAQUE: &str = "tweenray";
/// Most bytes that deflate makes one of.
const MOST_DEFLATED: u64 = 1032;
/// Bytes of a frame's pixel before it is deflated: `R G B`, AOVs left out.
const FRAME_PIXEL: u64 = 12;

/// One channel of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrChannel {
    /// `R`, or with a layer's name before a dot, `albedo.R`.
    pub name: String,
    /// The pixels, row by row from the top.
    pub samples: ExrSamples,
}

/// A channel's pixels.
#[derive(Debug, Clone, PartialEq)]
pub enum ExrSamples {
    /// Numbers. Half floats in files of other programs become these.
    F32(Vec<f32>),
    /// Identifiers.
    U32(Vec<u32>),
}

impl ExrSamples {
    /// Number of pixels.
    fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::U32(v) => v.len(),
        }
    }
}

/// The content of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ExrChannels {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The channels, sorted by name.
    pub list: Vec<ExrChannel>,
}

impl ExrChannels {
    /// The samples of the f32 channel `name`.
    pub fn f32(&self, name: &str) -> Option<&[f32]> {
        self.list.iter().find(|c| c.name == name).and_then(|c| match &c.samples {
            ExrSamples::F32(v) => Some(v.as_slice()),
            ExrSamples::U32(_) => None,
        })
    }
}

/// The film's colour, and what it has of the first hits among `aovs`.
pub fn channels_of(film: &Film, aovs: &Aovs) -> Vec<ExrChannel> {
    let mut channels = Vec::new();
    push_vectors(&mut channels, ["R", "G", "B"], &film.rgb);
    let Some(g) = &film.gbuffer else { return channels };
    if aovs.has(Aov::Depth) {
        channels.push(ExrChannel { name: "Z".into(), samples: ExrSamples::F32(g.depth.clone()) });
    }
    for (aov, names, vectors) in [
        (Aov::Position, ["P.X", "P.Y", "P.Z"], &g.position),
        (Aov::Normal, ["N.X", "N.Y", "N.Z"], &g.normal),
        (Aov::Albedo, ["albedo.R", "albedo.G", "albedo.B"], &g.albedo),
    ] {
        if aovs.has(aov) {
            push_vectors(&mut channels, names, vectors);
        }
    }
    if aovs.has(Aov::MeshId) {
        let ids = ExrSamples::U32(g.mesh_id.clone());
        channels.push(ExrChannel { name: "mesh_id".into(), samples: ids });
    }
    if aovs.has(Aov::Motion) {
        for (i, name) in ["backward.u", "backward.v"].into_iter().enumerate() {
            let samples = ExrSamples::F32(g.motion.iter().map(|m| m[i]).collect());
            channels.push(ExrChannel { name: name.into(), samples });
        }
    }
    channels
}

/// Appends the three components of `vectors` as channels.
pub fn push_vectors(channels: &mut Vec<ExrChannel>, names: [&str; 3], vectors: &[Vec3]) {
    for (i, name) in names.into_iter().enumerate() {
        let samples = ExrSamples::F32(vectors.iter().map(|v| v[i]).collect());
        channels.push(ExrChannel { name: name.into(), samples });
    }
}

/// The bytes of a file of these channels. `comment` goes to the metadata.
///
/// # Errors
/// [`Error::Usage`] if a channel does not have `width · height` samples; [`Error::Failed`] if the
/// format cannot hold them (no channel, two of one name).
pub fn encode(width: u32, height: u32, channels: &[ExrChannel], comment: &str) -> Result<Vec<u8>> {
    encode_with(width, height, channels, comment, None)
}

/// Like [`encode()`], with one attribute of the program's own: name and bytes.
///
/// # Errors
/// As [`encode()`].
pub fn encode_with(
    width: u32,
    height: u32,
    channels: &[ExrChannel],
    comment: &str,
    attribute: Option<(&str, &[u8])>,
) -> Result<Vec<u8>> {
    let pixels = width as usize * height as usize;
    if let Some(c) = channels.iter().find(|c| c.samples.len() != pixels) {
        let (name, n) = (&c.name, c.samples.len());
        return Err(Error::Usage(format!(
            "channel {name} has {n} samples, an image of {width}x{height} needs {pixels}"
        )));
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let attributes = LayerAttributes {
        software_name: Some(Text::from(SOFTWARE)),
        comments: (!comment.is_empty()).then(|| Text::new_or_none(comment)).flatten(),
        other: attribute.map(own_attribute).into_iter().collect(),
        ..LayerAttributes::default()
    };
    let list = AnyChannels::sort(channels.iter().map(to_exr).collect());
    let size = Vec2(width as usize, height as usize);
    let layer = Layer::new(size, attributes, encoding, list);
    compress(&Image::from_layer(layer))
        .map_err(|e| Error::Failed(format!("cannot encode exr: {e}")))
}

fn own_attribute((name, bytes): (&str, &[u8])) -> (Text, AttributeValue) {
    let (name, kind) = (Text::from(name), Text::from(OPAQUE));
    (name, AttributeValue::Custom { kind, bytes: bytes.into() })
}

/// An attribute that [`encode_with`] wrote.
pub struct OwnAttribute {
    /// Its value.
    pub bytes: Vec<u8>,
    /// Most pixels that a frame in a file of that length can have.
    pub most_pixels: u64,
}

/// The attribute `name` that [`encode_with`] wrote into the file at `path`, if it has it.
///
/// # Errors
/// [`Error::Io`] when the file cannot be read; [`Error::Input`] when it is no exr file or larger than
/// `limit` bytes.
pub fn read_attribute(path: &Path, name: &str, limit: u64) -> Result<Option<OwnAttribute>> {
    let Regular { source, bytes } = Regular::at(path)?;
    check_memory(path, bytes, limit)?;
    let meta = MetaData::read_from_buffered(source, false);
    let meta = meta.map_err(|e| Error::input(path, format!("not a readable exr file: {e}")))?;
    let all = meta.headers.into_iter().flat_map(|header| header.own_attributes.other);
    let most_pixels = bytes.saturating_mul(MOST_DEFLATED) / FRAME_PIXEL;
    let found = all.filter_map(|(own, value)| match value {
        AttributeValue::Custom { bytes, .. } if own.eq(name) => {
            Some(OwnAttribute { bytes: bytes.into_vec(), most_pixels })
        }
        _ => None,
    });
    Ok({ found }.next())
}

/// Compresses the blocks on this thread's rayon pool and writes them in order. (The crate's own
/// parallel writer starts a pool of its own for each file, whatever number of threads was asked.)
fn compress(image: &Image<Layer<AnyChannels<FlatSamples>>>) -> exr::error::Result<Vec<u8>> {
    let headers = image.layer_data.infer_headers(&image.attributes);
    let layers = image.layer_data.create_writer(&headers);
    let mut bytes = Cursor::new(Vec::new());
    exr::block::write(&mut bytes, headers, true, |meta, writer| {
        let indices: Vec<_> = meta.enumerate_ordered_header_block_indices().collect();
        let chunk = |(place, index): (usize, BlockIndex)| {
            let data = layers.extract_uncompressed_block(&meta.headers, index);
            let block = UncompressedBlock { index, data };
            block.compress_to_chunk(&meta.headers).map(|chunk| (place, chunk))
        };
        let chunks: Vec<_> = indices.into_par_iter().map(chunk).collect();
        for chunk in chunks {
            let (place, chunk) = chunk?;
            writer.write_chunk(place, chunk)?;
        }
        Ok(())
    })?;
    Ok(bytes.into_inner())
}

fn to_exr(channel: &ExrChannel) -> AnyChannel<FlatSamples> {
    let samples = match &channel.samples {
        ExrSamples::F32(v) => FlatSamples::F32(v.clone()),
        ExrSamples::U32(v) => FlatSamples::U32(v.clone()),
    };
    AnyChannel::new(channel.name.as_str(), samples)
}

/// Reads the first part of a file, from `source`; `path` is for messages. Tiled files, half floats
/// and every compression that the crate `exr` knows are read; of several resolutions the full one.
///
/// # Errors
/// [`Error::Input`] when the bytes are no exr file, hold deep or subsampled data, or would take
/// more than `limit` bytes of memory.
pub fn decode(path: &Path, source: impl BufRead + Seek, limit: u64) -> Result<ExrChannels> {
    let refuse = |e: exr::error::Error| Error::input(path, format!("not a readable exr file: {e}"));
    let chunks = exr::block::read(source, false).map_err(refuse)?;
    for header in chunks.headers() {
        let pixels = (header.layer_size.0 as u64).saturating_mul(header.layer_size.1 as u64);
        let needed = pixels.saturating_mul(header.channels.list.len() as u64 * 4);
        check_memory(path, needed, limit)?;
        if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
            return Err(Error::input(path, "subsampled exr channels are not supported"));
        }
    }
    let read = exr::image::read::read().no_deep_data().largest_resolution_level();
    let read = read.all_channels().first_valid_layer().all_attributes().non_parallel();
    let layer = read.from_chunks(chunks).map_err(refuse)?.layer_data;
    let from_exr = |channel: AnyChannel<FlatSamples>| ExrChannel {
        name: channel.name.to_string(),
        samples: match channel.sample_data {
            FlatSamples::F16(v) => ExrSamples::F32(v.into_iter().map(|h| h.to_f32()).collect()),
            FlatSamples::F32(v) => ExrSamples::F32(v),
            FlatSamples::U32(v) => ExrSamples::U32(v),
        },
    };
    let list = layer.channel_data.list.into_iter().map(from_exr).collect();
    Ok(ExrChannels { width: layer.size.0 as u32, height: layer.size.1 as u32, list })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{GBuffer, GPixel};
    use crate::math::Rgb;

    const LIMIT: u64 = 1 << 28;

    fn film() -> Film {
        let mut film = Film::new(35, 19, true);
        let mut gbuffer = GBuffer::new(film.rgb.len());
        for i in 0..film.rgb.len() {
            let x = i as f32;
            film.rgb[i] = Rgb::new(x / 7.0, 1e-20 * x, 3e30);
            if i % 3 > 0 {
                let normal = Vec3::new(0.0, 0.6, -0.8);
                let position = Vec3::new(x, -x / 3.0, 1e6 + x);
                let albedo = Rgb::splat(x / 1000.0);
                let mesh_id = 16_777_217 + i as u32;
                gbuffer.set(i, &GPixel { depth: x / 3.0, position, normal, albedo, mesh_id });
                gbuffer.motion[i] = crate::math::Vec2::new(-x, 0.25 * x);
            }
        }
        film.gbuffer = Some(gbuffer);
        film
    }

    fn sorted(mut channels: Vec<ExrChannel>) -> Vec<ExrChannel> {
        channels.sort_by(|a, b| a.name.cmp(&b.name));
        channels
    }

    #[test]
    fn every_channel_comes_back_bit_for_bit() {
        let channels = channels_of(&film(), &Aovs::All);
        assert_eq!(channels.len(), 3 + 1 + 3 + 3 + 3 + 1 + 2);
        let bytes = encode(35, 19, &channels, "spp 4").expect("encoded");
        let back = decode(Path::new("x.exr"), Cursor::new(&bytes), LIMIT).expect("decoded");
        assert_eq!((back.width, back.height), (35, 19));
        assert_eq!(back.list, sorted(channels));
        assert_eq!(back.f32("Z").map(|z| z[0]), Some(f32::INFINITY));
        assert_eq!(back.f32("mesh_id"), None);
    }

    #[test]
    fn a_file_holds_the_channels_that_are_asked_for() {
        let film = film();
        let names = |list: &str| {
            let aovs = Aovs::parse(list).expect("a list");
            let channels = channels_of(&film, &aovs).into_iter().map(|channel| channel.name);
            channels.collect::<Vec<_>>().join(" ")
        };
        for (list, more) in [
            ("none", ""),
            ("depth", " Z"),
            ("position", " P.X P.Y P.Z"),
            ("motion,normal", " N.X N.Y N.Z backward.u backward.v"),
            ("albedo,mesh-id", " albedo.R albedo.G albedo.B mesh_id"),
            ("reference", ""),
        ] {
            assert_eq!(names(list), format!("R G B{more}"), "{list}");
        }
        assert_eq!(channels_of(&Film::new(2, 1, false), &Aovs::All).len(), 3);
    }

    #[test]
    fn one_part_of_scanlines() {
        let bytes =
            encode(35, 19, &channels_of(&film(), &Aovs::All), "a comment").expect("encoded");
        let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(&bytes), true);
        let meta = meta.expect("pedantically valid");
        assert_eq!(meta.headers.len(), 1);
        assert!(!meta.requirements.has_multiple_layers && !meta.requirements.has_deep_data);
        let header = &meta.headers[0];
        assert_eq!(header.compression, Compression::ZIP16);
        assert!(!header.blocks.has_tiles());
        assert_eq!(header.own_attributes.comments, Some(Text::from("a comment")));
        assert_eq!(header.own_attributes.software_name, Some(Text::from(SOFTWARE)));
    }

    #[test]
    fn wrong_channels_are_errors() {
        let channel = |name: &str, n| ExrChannel {
            name: name.into(),
            samples: ExrSamples::F32(vec![0.0; n]),
        };
        assert!(matches!(encode(2, 2, &[channel("R", 3)], ""), Err(Error::Usage(_))));
        let twice = [channel("R", 4), channel("R", 4)];
        assert!(matches!(encode(2, 2, &twice, ""), Err(Error::Failed(_))));
        assert!(matches!(encode(2, 2, &[], ""), Err(Error::Failed(_))));
    }

    #[test]
    fn too_large_for_the_limit() {
        let bytes = encode(35, 19, &channels_of(&film(), &Aovs::All), "").expect("encoded");
        let error = decode(Path::new("x.exr"), Cursor::new(&bytes), 35 * 19 * 16 * 4 - 1);
        assert!(matches!(error, Err(Error::Input(_))));
    }
}
