//! NumPy's array files, version 1.0: little-endian, C order, data aligned to 64 bytes.
//!
//! The shape stands in the header, so it is given beforehand; the data is streamed. A file is written as `.NAME.part` and
//! renamed when all are whole.

use crate::storage::{WriteFault, io_fault};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The header of an array, magic number to padding.
#[must_use]
pub fn header(dtype: &str, shape: &[u64]) -> Vec<u8> {
    let numbers: Vec<String> = shape.iter().map(u64::to_string).collect();
    let tuple = if numbers.len() == 1 { format!("({},)", numbers[0]) } else { format!("({})", numbers.join(", ")) };
    let mut text = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': {tuple}, }}");
    let end = (10 + text.len() + 1).next_multiple_of(64);
    text.extend(std::iter::repeat_n(' ', end - 10 - text.len() - 1));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

/// An array file in the making; removed when dropped before [`NpyFile::finish`].
pub(crate) struct NpyFile {
    part: PathBuf,
    path: PathBuf,
    out: Option<BufWriter<File>>,
    data_offset: u64,
}

impl NpyFile {
    /// Begins `folder/name.npy`.
    pub(crate) fn create(folder: &Path, name: &str, dtype: &str, shape: &[u64]) -> Result<Self, WriteFault> {
        let part = folder.join(format!(".{name}.npy.part"));
        let file = File::create(&part).map_err(io_fault(&part))?;
        let header = header(dtype, shape);
        let mut this = Self {
            part,
            path: folder.join(format!("{name}.npy")),
            out: Some(BufWriter::with_capacity(1 << 18, file)),
            data_offset: header.len() as u64,
        };
        this.write(&header)?;
        Ok(this)
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), WriteFault> {
        match &mut self.out {
            Some(out) => out.write_all(bytes).map_err(io_fault(&self.part)),
            None => Ok(()),
        }
    }

    /// Writes at a place in the data, counted in bytes.
    pub(crate) fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), WriteFault> {
        if let Some(out) = &mut self.out {
            out.seek(SeekFrom::Start(self.data_offset + offset)).map_err(io_fault(&self.part))?;
        }
        self.write(bytes)
    }

    /// Flushes the data; the file gets its name by [`NpyFile::publish`].
    pub(crate) fn finish(&mut self) -> Result<(), WriteFault> {
        match self.out.take() {
            Some(mut out) => out.flush().map_err(io_fault(&self.part)),
            None => Ok(()),
        }
    }

    /// Gives the file its name, and answers with it.
    pub(crate) fn publish(self) -> Result<String, WriteFault> {
        std::fs::rename(&self.part, &self.path).map_err(io_fault(&self.path))?;
        Ok(self.path.file_name().unwrap_or_default().to_string_lossy().into_owned())
    }
}

impl Drop for NpyFile {
    fn drop(&mut self) {
        self.out = None;
        // gone already where it was published
        let _ = std::fs::remove_file(&self.part);
    }
}
