//! COLMAP's binary files: little-endian, counts first.

use super::FormatError;
use super::colmap::{Image, MODELS, Track, lens};
use super::text::fault;
use crate::camera::Intrinsics;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

struct Bytes {
    path: PathBuf,
    all: Vec<u8>,
    at: usize,
}

impl Bytes {
    fn open(path: PathBuf) -> Result<Self, FormatError> {
        let all =
            std::fs::read(&path).map_err(|e| FormatError::Read { file: path.display().to_string(), why: e.to_string() })?;
        Ok(Self { path, all, at: 0 })
    }

    fn fault(&self, what: impl Into<String>) -> FormatError {
        fault(&self.path, 0, what)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let bytes = self.all.get(self.at..).and_then(|rest| rest.first_chunk::<N>()).copied();
        self.at += N;
        bytes.ok_or_else(|| self.fault("the file ends too early"))
    }

    fn u32(&mut self) -> Result<u32, FormatError> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, FormatError> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, FormatError> {
        let value = self.take().map(f64::from_le_bytes)?;
        if value.is_finite() { Ok(value) } else { Err(self.fault("a number is not finite")) }
    }

    /// How many things of at least `size` bytes follow: more than the file can hold are refused before memory is asked for.
    fn count(&mut self, size: usize) -> Result<usize, FormatError> {
        let count = self.u64()?;
        let left = self.all.len().saturating_sub(self.at) / size;
        usize::try_from(count).ok().filter(|n| *n <= left).ok_or_else(|| self.fault("the file is shorter than its count says"))
    }
}

pub(super) fn cameras(folder: &Path) -> Result<BTreeMap<u32, Intrinsics>, FormatError> {
    let mut bytes = Bytes::open(folder.join("cameras.bin"))?;
    let mut all = BTreeMap::new();
    for _ in 0..bytes.count(24)? {
        let id = bytes.u32()?;
        let model = bytes.u32()? as usize;
        let size = [bytes.u64()?, bytes.u64()?];
        let &(name, parameters) =
            MODELS.get(model).ok_or_else(|| bytes.fault(format!("lens model number {model} is not known")))?;
        let [Ok(width), Ok(height)] = size.map(u32::try_from) else {
            return Err(bytes.fault("a photograph's size is too large"));
        };
        let values = (0..parameters).map(|_| bytes.f64()).collect::<Result<Vec<_>, _>>()?;
        let lens = lens(name, width, height, &values).map_err(|what| bytes.fault(what))?;
        all.insert(id, lens);
    }
    Ok(all)
}

pub(super) fn images(folder: &Path) -> Result<Vec<Image>, FormatError> {
    let mut bytes = Bytes::open(folder.join("images.bin"))?;
    let mut all = Vec::new();
    for _ in 0..bytes.count(73)? {
        let id = bytes.u32()?;
        let mut pose = [0.0; 7];
        for value in &mut pose {
            *value = bytes.f64()?;
        }
        let camera = bytes.u32()?;
        let mut name = Vec::new();
        loop {
            match bytes.take::<1>()? {
                [0] => break,
                [byte] => name.push(byte),
            }
        }
        let mut pixels = Vec::new();
        for _ in 0..bytes.count(24)? {
            pixels.push(DVec2::new(bytes.f64()?, bytes.f64()?));
            bytes.u64()?;
        }
        all.push(Image { id, pose, camera, name: String::from_utf8_lossy(&name).into_owned(), pixels });
    }
    Ok(all)
}

pub(super) fn points(folder: &Path) -> Result<Vec<Track>, FormatError> {
    let path = folder.join("points3D.bin");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let mut bytes = Bytes::open(path)?;
    let mut all = Vec::new();
    for _ in 0..bytes.count(51)? {
        bytes.u64()?;
        let position = DVec3::new(bytes.f64()?, bytes.f64()?, bytes.f64()?);
        bytes.take::<3>()?;
        bytes.take::<8>()?;
        let mut seen = Vec::new();
        for _ in 0..bytes.count(8)? {
            seen.push((bytes.u32()?, bytes.u32()?));
        }
        all.push(Track { position, seen });
    }
    Ok(all)
}
