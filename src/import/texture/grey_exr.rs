//! OpenEXR files of one channel, as programs write roughness and masks: [`image`] reads those with red, green and blue.

use crate::error::{Error, Result};
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers, read};
use image::{DynamicImage, Rgb32FImage};
use std::io::Cursor;
use std::path::Path;

/// Bytes of a pixel as it is decoded: three floats.
pub(super) const PIXEL: u64 = 12;
/// What such a file begins with.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Width and height of the picture; `None` of what is no such file of a single channel, or shows a part of its picture alone.
pub(super) fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    if !bytes.starts_with(&MAGIC) {
        return None;
    }
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).ok()?;
    let [header] = meta.headers.as_slice() else { return None };
    let (size, shown) = (header.layer_size, header.shared_attributes.display_window);
    let is_whole = header.own_attributes.layer_position == shown.position && size == shown.size;
    let is_grey = header.channels.list.len() == 1 && !header.deep && is_whole;
    Some((u32::try_from(size.0).ok()?, u32::try_from(size.1).ok()?)).filter(|_| is_grey)
}

/// The picture, grey; `None` as of [`size`], which was held against the limits.
///
/// Errors: `Error::Input` for a file that ends early or is damaged.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<Option<DynamicImage>> {
    let Some((width, height)) = size(bytes) else { return Ok(None) };
    let unreadable = |what: String| Error::input(path, format!("not a readable image: {what}"));
    let reader = read().no_deep_data().largest_resolution_level().all_channels();
    let reader = reader.first_valid_layer().all_attributes().non_parallel();
    let found = reader
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| unreadable(format!("Format error decoding OpenExr: {error}")))?;
    let channel = found.layer_data.channel_data.list.first();
    let greys = channel.into_iter().flat_map(|channel| channel.sample_data.values_as_f32());
    let mut pixels = Vec::with_capacity(width as usize * height as usize * 3);
    greys.for_each(|grey| pixels.extend([grey; 3]));
    let image = Rgb32FImage::from_raw(width, height, pixels);
    let image = image.ok_or_else(|| unreadable("it has other pixels than its size says".into()))?;
    Ok(Some(DynamicImage::ImageRgb32F(image)))
}
