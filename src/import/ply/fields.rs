//! Values of a PLY body one by one, from text or bytes.

use super::header::{Format, Type};
use crate::import::lines::{Words, show};
use crate::import::source::Fault;

/// Reads the values of one record after another.
pub(super) struct Fields<'a> {
    bytes: &'a [u8],
    format: Format,
    /// Next byte, and line.
    at: usize,
    line: usize,
    /// Place of the start of the current record.
    record: usize,
    /// The rest of the current record's line (ASCII).
    words: Words<'a>,
}

impl<'a> Fields<'a> {
    pub fn new(bytes: &'a [u8], format: Format, (at, line): (usize, usize)) -> Self {
        Self { bytes, format, at, line, record: at, words: Words::new(b"") }
    }

    /// Byte and line of the next value.
    pub fn place(&self) -> (usize, usize) {
        (self.at, self.line)
    }

    /// An error in the current record.
    pub fn fault(&self, message: impl std::fmt::Display) -> Fault {
        match self.format {
            Format::Ascii => Fault::new(self.line - 1, message.to_string()),
            _ => Fault::at_byte(self.record, message.to_string()),
        }
    }

    /// Starts the next record: in text, the next line that is not blank.
    pub fn start(&mut self) -> Result<(), Fault> {
        self.record = self.at;
        while self.format == Format::Ascii {
            let rest = &self.bytes[self.at..];
            self.line += 1;
            if rest.is_empty() {
                return Err(self.fault("the file ends too early"));
            }
            let end = memchr::memchr(b'\n', rest).unwrap_or(rest.len());
            self.at += (end + 1).min(rest.len());
            self.words = Words::new(&rest[..end]);
            if self.words.clone().next().is_some() {
                break;
            }
        }
        Ok(())
    }

    /// Ends a record: in text, nothing may be left on its line.
    pub fn end(&mut self) -> Result<(), Fault> {
        match self.words.next() {
            Some(word) => Err(self.fault(format!("`{}` is one value too many", show(word)))),
            None => Ok(()),
        }
    }

    /// The next value. Whole numbers of every type are exact in f64.
    pub fn value(&mut self, t: Type) -> Result<f64, Fault> {
        if self.format == Format::Ascii {
            let word = self.words.next().ok_or_else(|| self.fault("too few values"))?;
            let value = std::str::from_utf8(word).ok().and_then(|s| s.parse::<f64>().ok());
            return value.ok_or_else(|| self.fault(format!("`{}` is not a number", show(word))));
        }
        let bytes = self.bytes.get(self.at..self.at + t.size());
        let bytes = bytes.ok_or_else(|| self.fault("the file ends too early"))?;
        let value = decode(t, self.format, bytes);
        self.at += t.size();
        Ok(value)
    }

    /// A list's length, for which the file is long enough.
    pub fn list_length(&mut self, count: Type, item: Type) -> Result<usize, Fault> {
        let value = self.value(count)?;
        let left = self.bytes.len() - self.at;
        let most = match self.format {
            Format::Ascii => self.words.rest().len().div_ceil(2),
            _ => left / item.size(),
        };
        if value.fract() != 0.0 || !(0.0..=most as f64).contains(&value) {
            return Err(self.fault(format!("a list of {value} items, more than the file holds")));
        }
        Ok(value as usize)
    }

    /// Leaves out `count` values.
    pub fn skip(&mut self, t: Type, count: usize) -> Result<(), Fault> {
        if self.format == Format::Ascii {
            return (0..count).try_for_each(|_| self.value(t).map(|_| ()));
        }
        self.at = count
            .checked_mul(t.size())
            .and_then(|size| self.at.checked_add(size))
            .filter(|at| *at <= self.bytes.len())
            .ok_or_else(|| self.fault("the file ends too early"))?;
        Ok(())
    }
}

/// A number of type `t` from its bytes.
#[inline]
pub(super) fn decode(t: Type, format: Format, bytes: &[u8]) -> f64 {
    macro_rules! number {
        ($t:ty) => {{
            let mut buffer = [0; size_of::<$t>()];
            buffer.copy_from_slice(bytes);
            match format {
                Format::Big => <$t>::from_be_bytes(buffer) as f64,
                _ => <$t>::from_le_bytes(buffer) as f64,
            }
        }};
    }
    match t {
        Type::I8 => number!(i8),
        Type::U8 => number!(u8),
        Type::I16 => number!(i16),
        Type::U16 => number!(u16),
        Type::I32 => number!(i32),
        Type::U32 => number!(u32),
        Type::F32 => number!(f32),
        Type::F64 => number!(f64),
    }
}
