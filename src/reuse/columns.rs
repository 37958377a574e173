//! The codec of references: records of 32-bit words, column by column, deflated.
//!
//! A column is stored as four planes of bytes, the lowest bytes of all words first, since these are alike in
//! neighbouring records. The bytes are cut into parts of a fixed size, each with its compressed length in front, so
//! that parts are deflated in parallel. Little endian throughout. Lengths are checked against the bytes that are
//! left, and memory is only allocated as bytes are read.

use flate2::Compression;
use flate2::read::{DeflateDecoder, DeflateEncoder};
use rayon::prelude::*;
use std::io::Read;

/// Bytes deflated together.
const PART: usize = 1 << 20;
/// Most bytes of records that are written or read.
const MOST_BYTES: usize = 1 << 30;

/// Total size of `count` records of `columns` words and of `further` bytes; `None` where it is too large.
pub fn size_of(count: usize, columns: usize, further: usize) -> Option<usize> {
    let planes = count.checked_mul(4 * columns)?;
    planes.checked_add(further).filter(|n| *n <= MOST_BYTES)
}

/// The planes of `count` records of `columns` words; `word(record, column)` gives a word.
pub fn planes(count: usize, columns: usize, word: impl Fn(usize, usize) -> u32 + Sync) -> Vec<u8> {
    let mut raw = vec![0; 4 * columns * count];
    let each = raw.par_chunks_exact_mut((4 * count).max(1)).enumerate();
    each.for_each(|(column, planes)| {
        for i in 0..count {
            let bytes = word(i, column).to_le_bytes();
            bytes.iter().enumerate().for_each(|(b, byte)| planes[b * count + i] = *byte);
        }
    });
    raw
}

/// The word of record `i` of `count` in column `column`.
pub fn word(planes: &[u8], count: usize, i: usize, column: usize) -> u32 {
    let byte = |b: usize| planes[(4 * column + b) * count + i];
    u32::from_le_bytes([byte(0), byte(1), byte(2), byte(3)])
}

/// `raw` deflated, part by part.
pub fn deflated(raw: &[u8]) -> Option<Vec<u8>> {
    let parts: Vec<Vec<u8>> = raw.par_chunks(PART).map(deflated_part).collect::<Option<_>>()?;
    let mut out = Vec::new();
    for part in parts {
        out.extend((part.len() as u32).to_le_bytes());
        out.extend(part);
    }
    Some(out)
}

fn deflated_part(raw: &[u8]) -> Option<Vec<u8>> {
    let mut out = Vec::new();
    DeflateEncoder::new(raw, Compression::fast()).read_to_end(&mut out).ok()?;
    Some(out)
}

/// Exactly `expected` bytes from all parts of `body`.
pub fn inflated(mut body: &[u8], expected: usize) -> Option<Vec<u8>> {
    let mut raw = Vec::new();
    while raw.len() < expected {
        let length = take_u32(&mut body)?;
        let part = take(&mut body, length)?;
        let wanted = PART.min(expected - raw.len());
        let before = raw.len();
        DeflateDecoder::new(part).take(wanted as u64).read_to_end(&mut raw).ok()?;
        if raw.len() - before != wanted {
            return None;
        }
    }
    body.is_empty().then_some(raw)
}

/// Takes `length` bytes off the front of `bytes`.
pub fn take<'b>(bytes: &mut &'b [u8], length: usize) -> Option<&'b [u8]> {
    let (head, rest) = bytes.split_at_checked(length)?;
    *bytes = rest;
    Some(head)
}

/// Takes a number of four bytes off the front of `bytes`.
pub fn take_u32(bytes: &mut &[u8]) -> Option<usize> {
    let word = take(bytes, 4)?;
    Some(u32::from_le_bytes(word.try_into().ok()?) as usize)
}
