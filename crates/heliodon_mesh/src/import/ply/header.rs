//! The header of a PLY file: what the rows hold and how many there are.

use super::faces::index_list;
use crate::import::error::ImportError;
use crate::import::number::parse_integer;
use crate::import::source::Source;

/// A header this long is none.
const LONGEST_HEADER: u64 = 4 << 20;

const REMEDY: &str = "check that this is a PLY file, or export it again";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "int64" | "long" | "longlong" => Self::I64,
            "uint64" | "ulong" | "ulonglong" => Self::U64,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// The least that a row takes: bytes in a binary file, characters in text. A face is taken to have three corners: counting empty lists,
    /// a scan of gigabytes that was cut off would be read to its end before that is told.
    pub fn least_row(&self, encoding: Encoding) -> u64 {
        let corners = |i: usize| if self.name == "face" && Some(i) == index_list(self).map(|list| list.0) { 3 } else { 0 };
        let least = |(i, p): (usize, &Property)| match (encoding, p.kind) {
            (Encoding::Ascii, _) => 2 + 2 * corners(i),
            (_, Kind::Scalar(scalar)) => scalar.size() as u64,
            (_, Kind::List { count, item }) => count.size() as u64 + corners(i) * item.size() as u64,
        };
        self.properties.iter().enumerate().map(least).sum()
    }

    pub fn find(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| self.properties.iter().position(|p| p.name == *name))
    }

    /// Bytes of a row where all rows are of one size.
    pub fn fixed_row(&self) -> Option<usize> {
        self.properties.iter().map(|p| if let Kind::Scalar(s) = p.kind { Some(s.size()) } else { None }).sum()
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// What MeshLab's `comment TextureFile` lines name, in order.
    pub textures: Vec<String>,
}

/// Reads to the end of `end_header`'s line, where the data begins.
pub(super) fn read(source: &mut Source) -> Result<Header, ImportError> {
    let first = source.next_line()?.unwrap_or_default();
    if first.trim_ascii_end() != b"ply" {
        return Err(source.fail_at_line(1, "does not begin with \"ply\"", REMEDY));
    }
    let mut encoding = None;
    let mut header = Header { encoding: Encoding::Ascii, elements: Vec::new(), textures: Vec::new() };
    loop {
        let number = source.line();
        if source.position() > LONGEST_HEADER {
            return Err(source.fail_at_line(number, "the header does not end", REMEDY));
        }
        let Some(line) = source.next_line()? else {
            return Err(source.fail_at_line(number, "the file ends within its header", REMEDY));
        };
        let line = String::from_utf8_lossy(line).into_owned();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let wrong = |problem: String| Err(source.fail_at_line(number, problem, REMEDY));
        match words.as_slice() {
            [] => {}
            ["end_header", ..] => break,
            ["comment", "TextureFile", name @ ..] if !name.is_empty() => header.textures.push(name.join(" ")),
            ["comment" | "obj_info", ..] => {}
            ["format", name, ..] => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    other => return wrong(format!("\"{other}\" is no format of PLY")),
                });
            }
            ["element", name, count, ..] => match parse_integer(count.as_bytes()).and_then(|n| u64::try_from(n).ok()) {
                Some(count) => {
                    header.elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                None => return wrong(format!("\"{count}\" is no number of elements")),
            },
            ["property", rest @ ..] => {
                let property = match rest {
                    ["list", count, item, name] => Scalar::parse(count)
                        .filter(|s| !s.is_float())
                        .zip(Scalar::parse(item))
                        .map(|(count, item)| Property { name: (*name).to_owned(), kind: Kind::List { count, item } }),
                    [scalar, name] => {
                        Scalar::parse(scalar).map(|s| Property { name: (*name).to_owned(), kind: Kind::Scalar(s) })
                    }
                    _ => None,
                };
                match (header.elements.last_mut(), property) {
                    (Some(element), Some(property)) => element.properties.push(property),
                    (None, _) => return wrong("a property stands before any element".to_owned()),
                    (_, None) => return wrong(format!("\"{}\" is no property of PLY", line.trim())),
                }
            }
            [word, ..] => return wrong(format!("\"{word}\" is no word of a PLY header")),
        }
    }
    let Some(encoding) = encoding else {
        return Err(source.fail("has no format line in its header", REMEDY));
    };
    header.encoding = encoding;
    check_counts(source, &header)?;
    Ok(header)
}

/// Every row takes some bytes, so the counts cannot promise more rows than the file can hold.
fn check_counts(source: &Source, header: &Header) -> Result<(), ImportError> {
    let mut left = source.remaining() + u64::from(header.encoding == Encoding::Ascii);
    for element in &header.elements {
        match element.count.checked_mul(element.least_row(header.encoding)).and_then(|bytes| left.checked_sub(bytes)) {
            Some(rest) => left = rest,
            None => {
                let problem = format!(
                    "the header promises {} rows of \"{}\", more than the file's {} bytes can hold",
                    element.count,
                    element.name,
                    source.length()
                );
                return Err(source.fail(problem, crate::import::source::DAMAGED));
            }
        }
    }
    Ok(())
}
