//! The bytes behind a document: buffers, views of them, also compressed ones.

use super::container::{data_uri, percent_decoded};
use super::model::{Document, Index, Meshopt};
use super::{Failure, Outcome, fail};
use crate::import::material::locate;
use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::path::Path;

/// Buffers are opened when first asked for, so that a missing one that no mesh needs does no harm.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    bin: Option<&'a [u8]>,
    folder: Option<&'a Path>,
    buffers: Vec<OnceCell<Result<Cow<'a, [u8]>, Failure>>>,
    decoded: Vec<OnceCell<Result<Vec<u8>, Failure>>>,
    /// What compressed primitives hold, by the numbers of their accessors.
    held: BTreeMap<Index, Vec<u8>>,
}

/// Decompressed views may be this many times larger than what they come from; the codecs' own limit lies near it.
pub(super) const LARGEST_EXPANSION: u64 = 256;

impl<'a> Buffers<'a> {
    pub fn new(document: &'a Document, bin: Option<&'a [u8]>, folder: Option<&'a Path>) -> Self {
        Self {
            document,
            bin,
            folder,
            buffers: document.buffers.iter().map(|_| OnceCell::new()).collect(),
            decoded: document.buffer_views.iter().map(|_| OnceCell::new()).collect(),
            held: BTreeMap::new(),
        }
    }

    /// With what compressed primitives hold.
    pub fn holding(self, held: BTreeMap<Index, Vec<u8>>) -> Self {
        Self { held, ..self }
    }

    /// The elements of an accessor of a compressed primitive, side by side.
    pub fn held(&self, accessor: Index) -> Option<&[u8]> {
        self.held.get(&accessor).map(Vec::as_slice)
    }

    fn buffer(&self, index: Index) -> Outcome<&[u8]> {
        let cell = self.buffers.get(index as usize).ok_or_else(|| no_such("buffers", index, self.buffers.len()))?;
        match cell.get_or_init(|| self.open(index)) {
            Ok(bytes) => Ok(bytes),
            Err(failure) => Err(failure.clone()),
        }
    }

    fn open(&self, index: Index) -> Outcome<Cow<'a, [u8]>> {
        let item = format!("buffers[{index}]");
        let Some(uri) = &self.document.buffers[index as usize].uri else {
            let bin = self.bin.filter(|_| index == 0).map(Cow::Borrowed);
            return bin.ok_or_else(|| Failure::new(&item, "has neither a uri nor a binary chunk", "export the file again"));
        };
        self.resolve(uri, &item).map(Cow::Owned)
    }

    /// The bytes that a uri stands for.
    pub fn resolve(&self, uri: &str, item: &str) -> Outcome<Vec<u8>> {
        if uri.starts_with("data:") {
            return data_uri(uri).ok_or_else(|| Failure::new(item, "its data uri is not in base 64", "export the file again"));
        }
        if uri.contains("://") {
            let problem = format!("lies at \"{uri}\", and nothing is fetched from a network");
            return fail(item, problem, "put it beside the file and name it there");
        }
        let name = percent_decoded(uri);
        let path = self.folder.and_then(|folder| locate(folder, &name).or_else(|| locate(folder, uri)));
        let Some(path) = path else {
            return fail(item, format!("names \"{name}\", which is not there"), "put that file beside this one");
        };
        std::fs::read(&path)
            .map_err(|error| Failure::new(item, format!("\"{}\" cannot be read: {error}", path.display()), "check that file"))
    }

    /// A view's bytes, decompressed where they must be, and the distance of its elements if it says one.
    pub fn view(&self, index: Index) -> Outcome<(&[u8], Option<usize>)> {
        let views = &self.document.buffer_views;
        let view = views.get(index as usize).ok_or_else(|| no_such("bufferViews", index, views.len()))?;
        let stride = view.byte_stride.map(|stride| stride as usize);
        if let Some(meshopt) = &view.extensions.meshopt {
            let decoded = self.decoded[index as usize].get_or_init(|| self.decode(index, meshopt));
            return match decoded {
                Ok(bytes) => Ok((bytes, Some(stride.unwrap_or(meshopt.byte_stride as usize)))),
                Err(failure) => Err(failure.clone()),
            };
        }
        let bytes = self.slice(view.buffer, view.byte_offset, view.byte_length, || format!("bufferViews[{index}]"))?;
        Ok((bytes, stride))
    }

    /// Bytes of the buffers that were asked for so far.
    pub fn bytes_opened(&self) -> u64 {
        self.buffers.iter().filter_map(|cell| cell.get()?.as_ref().ok()).map(|bytes| bytes.len() as u64).sum()
    }

    /// Those, and what is in memory of views and primitives that were decompressed.
    pub fn bytes_held(&self) -> u64 {
        let decoded = self.decoded.iter().filter_map(|cell| cell.get()?.as_ref().ok()).map(|bytes| bytes.len() as u64);
        let held = self.held.values().map(|bytes| bytes.len() as u64);
        self.bytes_opened() + decoded.sum::<u64>() + held.sum::<u64>()
    }

    fn slice(&self, buffer: Index, offset: u64, length: u64, item: impl Fn() -> String) -> Outcome<&[u8]> {
        let bytes = self.buffer(buffer)?;
        let end = offset.checked_add(length).filter(|end| *end <= bytes.len() as u64);
        match end {
            Some(end) => Ok(&bytes[offset as usize..end as usize]),
            None => fail(
                &item(),
                format!("asks for {length} bytes from {offset} on, but buffers[{buffer}] has {}", bytes.len()),
                "the file may be cut off or damaged, copy or export it again",
            ),
        }
    }

    fn decode(&self, index: Index, meshopt: &Meshopt) -> Outcome<Vec<u8>> {
        let item = format!("bufferViews[{index}]");
        let encoded = self.slice(meshopt.buffer, meshopt.byte_offset, meshopt.byte_length, || item.clone())?;
        let size = meshopt.count.saturating_mul(meshopt.byte_stride);
        // the codecs spend at least a bit or so on a vertex byte; more is a made-up count
        if size > (encoded.len() as u64).saturating_mul(LARGEST_EXPANSION) + (1 << 16) {
            let problem = format!("promises {size} bytes from {} compressed ones", encoded.len());
            return fail(&item, problem, "the file may be damaged, export it again");
        }
        super::meshopt::decode(meshopt, encoded).ok_or_else(|| {
            let problem = format!("its meshopt data (mode {}) cannot be decoded", meshopt.mode);
            Failure::new(&item, problem, "export it again, or without compression")
        })
    }
}

pub(super) fn no_such(what: &str, index: Index, count: usize) -> Failure {
    let problem = format!("is named, but there are {count}");
    Failure::new(&format!("{what}[{index}]"), problem, "the file is not consistent, export it again")
}
