//! The outside of a glTF file: JSON, or the binary container of version 2 with a JSON and a BIN chunk.

use crate::import::error::{ImportError, Place};
use crate::import::source::DAMAGED;
use std::path::Path;

const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BIN: u32 = 0x004E_4942;

/// The document's JSON and the binary chunk, if there is one.
pub(super) fn open<'a>(bytes: &'a [u8], file: &Path) -> Result<(&'a [u8], Option<&'a [u8]>), ImportError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    }
    let fail = |at: usize, problem: String| ImportError::new(file, Place::Byte(at as u64), problem, DAMAGED);
    let word = |at: usize| {
        let raw = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        raw.ok_or_else(|| fail(at, "the file ends within its header".to_owned()))
    };
    let version = word(4)?;
    if version != 2 {
        let remedy = "convert it to glTF 2.0";
        return Err(ImportError::new(file, Place::Byte(4), format!("is binary glTF of version {version}"), remedy));
    }
    let length = word(8)? as usize;
    if length > bytes.len() {
        let problem = format!("the header promises {length} bytes, but the file ends after {}", bytes.len());
        return Err(fail(8, problem));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while at + 8 <= length {
        let (size, kind) = (word(at)? as usize, word(at + 4)?);
        let Some(chunk) = bytes.get(at + 8..at + 8 + size).filter(|_| at + 8 + size <= length) else {
            return Err(fail(at, format!("a chunk of {size} bytes goes beyond the file's end")));
        };
        match kind {
            CHUNK_JSON if json.is_none() => json = Some(chunk),
            CHUNK_BIN if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + size;
    }
    json.map(|json| (json, bin)).ok_or_else(|| fail(12, "has no JSON chunk".to_owned()))
}

/// The bytes of a `data:` address in base 64; `None` for what is none.
pub(super) fn data_uri(uri: &str) -> Option<Vec<u8>> {
    let (header, data) = uri.strip_prefix("data:")?.split_once(',')?;
    if !header.ends_with(";base64") {
        return None;
    }
    let mut out = Vec::with_capacity(data.len() / 4 * 3);
    let (mut bits, mut held) = (0_u32, 0);
    for byte in data.bytes() {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => break,
            b if b.is_ascii_whitespace() => continue,
            _ => return None,
        };
        bits = bits << 6 | u32::from(digit);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    Some(out)
}

/// The file name that a glTF file's relative URI stands for: `%20` and the like as the characters they stand for.
#[must_use]
pub fn percent_decoded(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = |i: usize| bytes.get(i).and_then(|b| char::from(*b).to_digit(16));
        match (bytes[at], hex(at + 1), hex(at + 2)) {
            (b'%', Some(high), Some(low)) => {
                out.push((high * 16 + low) as u8);
                at += 3;
            }
            (byte, _, _) => {
                out.push(byte);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_64_and_percent_signs() {
        assert_eq!(data_uri("data:application/octet-stream;base64,aGVsaW9kb24=").unwrap(), b"heliodon");
        assert_eq!(data_uri("data:;base64,aGVs\naW8").unwrap(), b"helio");
        assert_eq!(data_uri("data:text/plain,hello"), None);
        assert_eq!(data_uri("data:;base64,a*b"), None);
        assert_eq!(percent_decoded("a%20b%2"), "a b%2");
    }
}
