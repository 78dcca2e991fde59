//! A file read once, front to back, by bytes, by lines or by words, that knows where it is and how much is left.

use super::error::{ImportError, Place};
use std::fs::File;
use std::io::{Cursor, ErrorKind, Read};
use std::ops::Range;
use std::path::Path;

/// Bytes asked of the file at a time.
const BLOCK: usize = 256 * 1024;

/// A longer line or word is no mesh; shorter ones are held in memory whole.
const LONGEST_LINE: usize = 64 * 1024 * 1024;

/// What helps against most damage.
pub(crate) const DAMAGED: &str = "the file may be cut off or damaged, copy or export it again";

/// What some editors begin text in UTF-8 with.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

pub(crate) struct Source<'a> {
    file: &'a Path,
    reader: Box<dyn Read + 'a>,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Bytes of the file before `buffer[start]`.
    consumed: u64,
    length: u64,
    /// The line that the next word or line is on, from 1.
    line: u64,
    joined: Vec<u8>,
}

/// A reader that tells how much was read of it.
struct Telling<'a> {
    reader: Box<dyn Read + 'a>,
    tell: &'a dyn Fn(u64),
    read: u64,
}

impl Read for Telling<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.reader.read(buffer)?;
        self.read += count as u64;
        (self.tell)(self.read);
        Ok(count)
    }
}

impl<'a> Source<'a> {
    pub fn open(path: &'a Path) -> Result<Self, ImportError> {
        let failed = |error| ImportError::io(path, "read it", error);
        let mut file = File::open(path).map_err(failed)?;
        let metadata = file.metadata().map_err(failed)?;
        if metadata.is_dir() {
            return Err(ImportError::new(path, Place::File, "is a folder", "name a mesh file in it"));
        }
        if metadata.is_file() {
            return Ok(Self::new(path, Box::new(file), metadata.len()));
        }
        // A pipe has no length to check counts against: take it whole.
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let length = bytes.len() as u64;
        Ok(Self::new(path, Box::new(Cursor::new(bytes)), length))
    }

    pub fn from_bytes(file: &'a Path, bytes: &'a [u8]) -> Self {
        Self::new(file, Box::new(bytes), bytes.len() as u64)
    }

    fn new(file: &'a Path, reader: Box<dyn Read + 'a>, length: u64) -> Self {
        Self { file, reader, buffer: Vec::new(), start: 0, end: 0, consumed: 0, length, line: 1, joined: Vec::new() }
    }

    /// The same, that tells how many bytes it has taken from the file so far.
    pub fn telling(mut self, tell: &'a dyn Fn(u64)) -> Self {
        let reader = std::mem::replace(&mut self.reader, Box::new(std::io::empty()));
        // what was peeked at is told with what comes next
        self.reader = Box::new(Telling { reader, tell, read: self.end as u64 });
        self
    }

    pub fn file(&self) -> &'a Path {
        self.file
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// The byte that comes next, counted from 0.
    pub fn position(&self) -> u64 {
        self.consumed
    }

    pub fn remaining(&self) -> u64 {
        self.length.saturating_sub(self.consumed)
    }

    pub fn line(&self) -> u64 {
        self.line
    }

    /// What is in memory of what comes next: at least `want` bytes, less only where the file ends before.
    pub fn peek(&mut self, want: usize) -> Result<&[u8], ImportError> {
        if self.end - self.start < want {
            self.fill(want)?;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    #[cold]
    fn fill(&mut self, want: usize) -> Result<(), ImportError> {
        self.buffer.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        let capacity = want.max(BLOCK);
        if self.buffer.len() < capacity {
            self.buffer.resize(capacity, 0);
        }
        while self.end < want {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Ok(0) => break,
                Ok(count) => self.end += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(ImportError::io(self.file, "read it", error)),
            }
        }
        Ok(())
    }

    /// Passes over a [`BYTE_ORDER_MARK`] at the file's beginning.
    pub fn skip_byte_order_mark(&mut self) -> Result<(), ImportError> {
        if self.consumed == 0 && self.peek(BYTE_ORDER_MARK.len())?.starts_with(BYTE_ORDER_MARK) {
            self.skip_peeked(BYTE_ORDER_MARK.len());
        }
        Ok(())
    }

    pub fn skip_peeked(&mut self, count: usize) {
        let count = count.min(self.end - self.start);
        self.start += count;
        self.consumed += count as u64;
    }

    /// The next `count` bytes, all of them or an error; `count` is checked against the file's length before memory is taken.
    #[inline]
    pub fn take(&mut self, count: usize) -> Result<&[u8], ImportError> {
        if self.end - self.start < count {
            if self.remaining() < count as u64 {
                return Err(self.ended());
            }
            self.fill(count)?;
            if self.end - self.start < count {
                return Err(self.ended());
            }
        }
        let start = self.start;
        self.start += count;
        self.consumed += count as u64;
        Ok(&self.buffer[start..start + count])
    }

    /// Passes over `count` bytes without holding them.
    pub fn skip(&mut self, count: u64) -> Result<(), ImportError> {
        if count > self.remaining() {
            return Err(self.ended());
        }
        let mut left = count;
        while left > 0 {
            let step = left.min(BLOCK as u64) as usize;
            self.take(step)?;
            left -= step as u64;
        }
        Ok(())
    }

    #[cold]
    fn ended(&self) -> ImportError {
        let problem = format!("the file ends after {} bytes, in the middle of its data", self.length);
        ImportError::new(self.file, Place::Byte(self.consumed), problem, DAMAGED)
    }

    #[cold]
    pub fn fail_at_line(&self, line: u64, problem: impl Into<String>, remedy: &str) -> ImportError {
        ImportError::new(self.file, Place::Line(line), problem, remedy)
    }

    #[cold]
    pub fn fail_at(&self, item: String, problem: impl Into<String>, remedy: &str) -> ImportError {
        ImportError::new(self.file, Place::Item(item), problem, remedy)
    }

    #[cold]
    pub fn fail(&self, problem: impl Into<String>, remedy: &str) -> ImportError {
        ImportError::new(self.file, Place::File, problem, remedy)
    }

    /// The bytes up to the next byte that `is_end` accepts, in memory, without that byte; their number, and whether there was one.
    fn find(&mut self, needle: impl Fn(&[u8]) -> Option<usize>) -> Result<(usize, bool), ImportError> {
        let mut searched = 0;
        loop {
            if let Some(at) = needle(&self.buffer[self.start + searched..self.end]) {
                return Ok((searched + at, true));
            }
            searched = self.end - self.start;
            if searched > LONGEST_LINE {
                let problem = format!("a line or word goes on for more than {} MiB", LONGEST_LINE >> 20);
                return Err(self.fail_at_line(
                    self.line,
                    problem,
                    "check that this is a mesh in the format that its name says",
                ));
            }
            self.fill(searched + 1)?;
            if self.end - self.start == searched {
                return Ok((searched, false));
            }
        }
    }

    /// Passes over the next line; where it lies in the buffer, without its end (`\n`, `\r\n` or `\r`).
    fn pass_line(&mut self) -> Result<Option<Range<usize>>, ImportError> {
        let (length, ends) = self.find(|bytes| memchr::memchr2(b'\n', b'\r', bytes))?;
        if length == 0 && !ends {
            return Ok(None);
        }
        let mut passed = length + usize::from(ends);
        if ends && self.buffer[self.start + length] == b'\r' && self.peek(length + 2)?.get(length + 1) == Some(&b'\n') {
            passed += 1;
        }
        let line = self.start..self.start + length;
        self.start += passed;
        self.consumed += passed as u64;
        self.line += 1;
        Ok(Some(line))
    }

    /// The next line without its end; none at the end of the file.
    pub fn next_line(&mut self) -> Result<Option<&[u8]>, ImportError> {
        Ok(self.pass_line()?.map(|line| &self.buffer[line]))
    }

    /// The next line, joined with those that it goes on in: a backslash at a line's end continues it, as in OBJ.
    pub fn next_joined_line(&mut self) -> Result<Option<&[u8]>, ImportError> {
        let Some(mut line) = self.pass_line()? else { return Ok(None) };
        if self.buffer[line.clone()].last() != Some(&b'\\') {
            return Ok(Some(&self.buffer[line]));
        }
        self.joined.clear();
        loop {
            let goes_on = self.buffer[line.clone()].last() == Some(&b'\\');
            line.end -= usize::from(goes_on);
            self.joined.extend_from_slice(&self.buffer[line]);
            if self.joined.len() > LONGEST_LINE {
                return Err(self.fail_at_line(self.line, "a line is continued without end", DAMAGED));
            }
            if !goes_on {
                break;
            }
            let Some(next) = self.pass_line()? else { break };
            self.joined.push(b' ');
            line = next;
        }
        Ok(Some(&self.joined))
    }

    /// The next word between spaces and line ends; none at the end of the file.
    pub fn next_word(&mut self) -> Result<Option<&[u8]>, ImportError> {
        loop {
            let bytes = &self.buffer[self.start..self.end];
            let blank = bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(bytes.len());
            self.line += bytes[..blank].iter().filter(|b| **b == b'\n').count() as u64;
            self.skip_peeked(blank);
            if self.start < self.end {
                break;
            }
            if self.peek(1)?.is_empty() {
                return Ok(None);
            }
        }
        let (length, _) = self.find(|bytes| bytes.iter().position(u8::is_ascii_whitespace))?;
        let start = self.start;
        self.start += length;
        self.consumed += length as u64;
        Ok(Some(&self.buffer[start..start + length]))
    }
}
