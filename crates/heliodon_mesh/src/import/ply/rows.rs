//! Rows of a PLY file, as text or bytes: one value after another.

use super::header::{Element, Encoding, Kind, Scalar};
use crate::import::error::ImportError;
use crate::import::number::parse_f64;
use crate::import::source::{DAMAGED, Source};

/// Bytes behind the last row that are looked at.
const LOOKED_AT: usize = 64;

/// Values as `f64`: exact for every type but 64-bit integers beyond 2^53, which no index reaches.
pub(super) struct Rows<'s, 'a> {
    pub source: &'s mut Source<'a>,
    encoding: Encoding,
}

impl<'s, 'a> Rows<'s, 'a> {
    pub fn new(source: &'s mut Source<'a>, encoding: Encoding) -> Self {
        Self { source, encoding }
    }

    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    #[inline]
    pub fn scalar(&mut self, scalar: Scalar) -> Result<f64, ImportError> {
        match self.encoding {
            Encoding::Ascii => self.word(),
            Encoding::Little => Ok(decode::<false>(scalar, self.source.take(scalar.size())?)),
            Encoding::Big => Ok(decode::<true>(scalar, self.source.take(scalar.size())?)),
        }
    }

    fn word(&mut self) -> Result<f64, ImportError> {
        let Some(word) = self.source.next_word()? else {
            let line = self.source.line();
            return Err(self.source.fail_at_line(line, "the file ends in the middle of its data", DAMAGED));
        };
        if let Some(number) = parse_f64(word) {
            return Ok(number);
        }
        let shown = String::from_utf8_lossy(&word[..word.len().min(24)]).into_owned();
        let line = self.source.line();
        Err(self.source.fail_at_line(line, format!("has \"{shown}\" where a number belongs"), DAMAGED))
    }

    /// The number of items of a list that comes next, checked against what the file can still hold.
    #[inline]
    pub fn list_count(&mut self, count: Scalar, item: Scalar) -> Result<usize, ImportError> {
        let number = self.scalar(count)?;
        let least = if self.encoding == Encoding::Ascii { 2 } else { item.size() as u64 };
        let whole = number as u64;
        if number < 0.0 || whole as f64 != number || whole.saturating_mul(least) > self.source.remaining() + 1 {
            let (problem, byte) = (format!("a list of {number} items goes beyond the file's end"), self.source.position());
            return Err(match self.encoding {
                Encoding::Ascii => self.source.fail_at_line(self.source.line(), problem, DAMAGED),
                _ => self.source.fail_at(format!("byte {byte}"), problem, DAMAGED),
            });
        }
        Ok(whole as usize)
    }

    pub fn skip(&mut self, kind: Kind) -> Result<(), ImportError> {
        match kind {
            Kind::Scalar(scalar) => self.scalar(scalar).map(|_| ()),
            Kind::List { count, item } => {
                let items = self.list_count(count, item)?;
                if self.encoding == Encoding::Ascii {
                    return (0..items).try_for_each(|_| self.scalar(item).map(|_| ()));
                }
                self.source.skip((items * item.size()) as u64)
            }
        }
    }

    /// Bytes behind the last row; blanks and ends of lines do not count.
    pub fn left_over(&mut self) -> Result<u64, ImportError> {
        let left = self.source.remaining();
        let start = self.source.peek(LOOKED_AT)?;
        let is_blank = start[..start.len().min(LOOKED_AT)].iter().all(u8::is_ascii_whitespace);
        Ok(if is_blank { 0 } else { left })
    }

    pub fn skip_element(&mut self, element: &Element) -> Result<(), ImportError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        match element.fixed_row() {
            Some(row) if self.encoding != Encoding::Ascii => self.source.skip(element.count.saturating_mul(row as u64)),
            _ => (0..element.count).try_for_each(|_| element.properties.iter().try_for_each(|p| self.skip(p.kind))),
        }
    }
}

/// One value from its bytes.
#[inline]
pub(super) fn decode<const BIG: bool>(scalar: Scalar, bytes: &[u8]) -> f64 {
    macro_rules! number {
        ($type:ty) => {{
            let mut raw = [0; size_of::<$type>()];
            raw.copy_from_slice(&bytes[..size_of::<$type>()]);
            (if BIG { <$type>::from_be_bytes(raw) } else { <$type>::from_le_bytes(raw) }) as f64
        }};
    }
    match scalar {
        Scalar::I8 => number!(i8),
        Scalar::U8 => number!(u8),
        Scalar::I16 => number!(i16),
        Scalar::U16 => number!(u16),
        Scalar::I32 => number!(i32),
        Scalar::U32 => number!(u32),
        Scalar::I64 => number!(i64),
        Scalar::U64 => number!(u64),
        Scalar::F32 => number!(f32),
        Scalar::F64 => number!(f64),
    }
}
