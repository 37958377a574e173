//! The header of a PLY file: text, whatever the body is.

use crate::import::lines::show;
use crate::import::source::Fault;

/// A header longer than this is refused.
const MAX_HEADER: usize = 1 << 20;
/// More elements or properties than this are refused.
const MAX_ENTRIES: usize = 1000;

/// How the body is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    Little,
    Big,
}

/// A number's type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// The type of a property.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Type),
    List { count: Type, item: Type },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// Line in the header.
    pub line: usize,
}

impl Property {
    /// The type of a list's items.
    pub fn list_item(&self) -> Option<Type> {
        match self.kind {
            Kind::List { item, .. } => Some(item),
            Kind::Scalar(_) => None,
        }
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
    /// Line in the header.
    pub line: usize,
}

impl Element {
    /// Bytes of one record in a binary file, if all records are alike.
    pub fn fixed_size(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, p| match p.kind {
            Kind::Scalar(t) => Some(sum + t.size()),
            Kind::List { .. } => None,
        })
    }

    /// The least that one record takes in the file.
    fn least_size(&self, format: Format) -> usize {
        let least = |p: &Property| match (format, p.kind) {
            // A digit and what separates it from the next.
            (Format::Ascii, _) => 2,
            (_, Kind::Scalar(t)) => t.size(),
            (_, Kind::List { count, .. }) => count.size(),
        };
        self.properties.iter().map(least).sum()
    }
}

/// A checked header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Where the body starts: byte and line.
    pub body: usize,
    pub body_line: usize,
}

impl Header {
    /// The number of vertices announced.
    pub fn vertex_count(&self) -> usize {
        self.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count)
    }

    /// The line of a vertex in an ASCII file that has the vertices first and no blank lines.
    pub fn vertex_line(&self, vertex: usize) -> Option<usize> {
        let first = self.elements.first().is_some_and(|e| e.name == "vertex");
        (self.format == Format::Ascii && first).then_some(self.body_line + vertex)
    }
}

type Checked<T> = std::result::Result<T, String>;

/// Reads and checks the header.
///
/// Errors: anything that is not a PLY header, duplicate names, and counts for which the file is
/// too short.
pub(super) fn read(bytes: &[u8]) -> std::result::Result<Header, Fault> {
    let mut header = Header { format: Format::Ascii, elements: Vec::new(), body: 0, body_line: 1 };
    let mut has_format = false;
    loop {
        let number = header.body_line;
        let fault = |message: String| Fault::new(number, message);
        let rest = &bytes[header.body..];
        let end = memchr::memchr(b'\n', rest)
            .filter(|end| header.body + end < MAX_HEADER)
            .ok_or_else(|| fault("the header does not end: no `end_header`".into()))?;
        header.body += end + 1;
        header.body_line += 1;
        let line = rest[..end].trim_ascii();
        let text = std::str::from_utf8(line)
            .map_err(|_| fault(format!("`{}` is not text", show(line))))?;
        let mut words = text.split_ascii_whitespace();
        match (number, words.next().unwrap_or("")) {
            (1, "ply") => {}
            (1, _) => return Err(fault("not a PLY file: the first line is not `ply`".into())),
            (_, "format") => {
                header.format = format(words).map_err(fault)?;
                has_format = true;
            }
            (_, "comment" | "obj_info" | "") => {}
            (_, "element") => header.element(words, number).map_err(fault)?,
            (_, "property") => header.property(words, number).map_err(fault)?,
            (_, "end_header") => break,
            (_, other) => {
                return Err(fault(format!("`{}` is no header line", show(other.as_bytes()))));
            }
        }
    }
    if !has_format {
        return Err(Fault::new(1, "the header has no `format` line"));
    }
    header.check(bytes.len() - header.body)?;
    Ok(header)
}

fn format<'a>(mut words: impl Iterator<Item = &'a str>) -> Checked<Format> {
    let format = match words.next().unwrap_or("") {
        "ascii" => Format::Ascii,
        "binary_little_endian" => Format::Little,
        "binary_big_endian" => Format::Big,
        other => return Err(format!("format `{}` is unknown", show(other.as_bytes()))),
    };
    match words.next() {
        Some("1.0") => Ok(format),
        other => {
            let version = show(other.unwrap_or("").as_bytes());
            Err(format!("version `{version}`: only 1.0 is known"))
        }
    }
}

impl Header {
    fn element<'a>(
        &mut self,
        mut words: impl Iterator<Item = &'a str>,
        line: usize,
    ) -> Checked<()> {
        let (Some(name), Some(count), None) = (words.next(), words.next(), words.next()) else {
            return Err("`element` takes a name and a count".into());
        };
        let count = count
            .parse()
            .map_err(|_| format!("`{}` is no count of `{name}`", show(count.as_bytes())))?;
        if self.elements.iter().any(|e| e.name == name) {
            return Err(format!("element `{name}` occurs twice"));
        }
        if self.elements.len() >= MAX_ENTRIES {
            return Err(format!("more than {MAX_ENTRIES} elements"));
        }
        self.elements.push(Element { name: name.into(), count, properties: Vec::new(), line });
        Ok(())
    }

    fn property<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Checked<()> {
        let element = self.elements.last_mut().ok_or("`property` before the first `element`")?;
        let words: Vec<&str> = words.take(5).collect();
        let kind = |word: &str| {
            Type::of(word).ok_or_else(|| format!("`{}` is no type", show(word.as_bytes())))
        };
        let (kind, name) = match words[..] {
            ["list", count, item, name] => {
                let (count, item) = (kind(count)?, kind(item)?);
                if !count.is_integer() {
                    return Err(format!("the list `{name}` counts its items by a fraction"));
                }
                (Kind::List { count, item }, name)
            }
            [t, name] => (Kind::Scalar(kind(t)?), name),
            _ => return Err("`property` takes a type and a name".into()),
        };
        if element.properties.iter().any(|p| p.name == name) {
            return Err(format!("property `{name}` occurs twice in `{}`", element.name));
        }
        if element.properties.len() >= MAX_ENTRIES {
            return Err(format!("more than {MAX_ENTRIES} properties"));
        }
        element.properties.push(Property { name: name.into(), kind, line });
        Ok(())
    }

    /// Errors: counts for which `body` bytes do not suffice, or that a 32-bit index cannot name.
    fn check(&self, body: usize) -> std::result::Result<(), Fault> {
        // An ASCII file may lack its last line end.
        let mut left = body + usize::from(self.format == Format::Ascii);
        for element in &self.elements {
            let Element { name, count, line, .. } = element;
            if element.properties.is_empty() && *count > 0 {
                return Err(Fault::new(*line, format!("`{name}` has no properties")));
            }
            let need = element.least_size(self.format).checked_mul(*count);
            left = need.and_then(|need| left.checked_sub(need)).ok_or_else(|| {
                let message =
                    format!("{count} of `{name}`, but only {body} bytes follow the header");
                Fault::new(*line, message)
            })?;
            if *count >= u32::MAX as usize / 3 {
                let most = u32::MAX / 3 - 1;
                return Err(Fault::new(*line, format!("{count} of `{name}`; {most} is the most")));
            }
        }
        Ok(())
    }
}
