//! Typed views: all component types, normalised or not, sparse or not, read element by element.

use super::buffers::{Buffers, no_such};
use super::model::{Accessor, Document, Index};
use super::{Failure, Outcome, fail};
use crate::import::source::DAMAGED;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn parse(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// The format's number for it.
    pub fn code(self) -> u32 {
        match self {
            Self::I8 => 5120,
            Self::U8 => 5121,
            Self::I16 => 5122,
            Self::U16 => 5123,
            Self::U32 => 5125,
            Self::F32 => 5126,
        }
    }

    /// Bytes of one.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that such bytes stand for.
    #[inline]
    pub fn read(self, b: &[u8]) -> f64 {
        match self {
            Self::I8 => f64::from(b[0] as i8),
            Self::U8 => f64::from(b[0]),
            Self::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Self::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Self::U32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            Self::F32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        }
    }

    /// What a normalised value is divided by.
    pub fn full(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::U32 | Self::F32 => 1.0,
        }
    }
}

/// Elements of up to four components, or matrices of sixteen.
pub(super) struct Values<'a> {
    pub count: usize,
    pub width: usize,
    component: Component,
    normalized: bool,
    /// From the first element on; empty where only sparse ones are given and the rest is zero.
    bytes: &'a [u8],
    stride: usize,
    sparse: Option<Sparse<'a>>,
}

struct Sparse<'a> {
    /// Rising.
    indices: Vec<u32>,
    values: &'a [u8],
}

impl<'a> Values<'a> {
    pub fn open(document: &Document, buffers: &'a Buffers, index: Index, widths: &[usize]) -> Outcome<Self> {
        let accessors = &document.accessors;
        let accessor = accessors.get(index as usize).ok_or_else(|| no_such("accessors", index, accessors.len()))?;
        let item = if buffers.held(index).is_some() { "Draco data".to_owned() } else { format!("accessors[{index}]") };
        let remedy = "export the file again";
        let Some(component) = Component::parse(accessor.component_type) else {
            return fail(&item, format!("has the unknown component type {}", accessor.component_type), remedy);
        };
        let width = accessor.width();
        if !widths.contains(&width) {
            return fail(&item, format!("is of type {}, which does not belong there", accessor.kind), remedy);
        }
        let element = component.size() * width;
        let Some(count) = usize::try_from(accessor.count).ok().filter(|&count| count <= u32::MAX as usize) else {
            return fail(&item, format!("has {} elements", accessor.count), remedy);
        };
        let (bytes, stride) = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = buffers.view(view)?;
                let stride = stride.unwrap_or(element);
                (elements(&item, bytes, accessor.byte_offset, count, element, stride)?, stride)
            }
            None => (buffers.held(index).unwrap_or_default(), element),
        };
        let sparse = match &accessor.sparse {
            Some(_) => Some(open_sparse(accessor, buffers, &item, element)?),
            None => None,
        };
        Ok(Self { count, width, component, normalized: accessor.normalized, bytes, stride, sparse })
    }

    /// Whether the file holds bytes for its elements, so that their number is bounded by its size.
    pub fn is_backed(&self) -> bool {
        !self.bytes.is_empty()
    }

    /// Element `i`; components beyond its width are zero.
    #[inline]
    pub fn get(&self, i: usize) -> [f64; 4] {
        self.components(i)
    }

    /// The first `N` components of element `i`; those beyond its width are zero.
    #[inline]
    pub fn components<const N: usize>(&self, i: usize) -> [f64; N] {
        let mut bytes = self.bytes.get(i * self.stride..).unwrap_or_default();
        if let Some(sparse) = &self.sparse
            && let Ok(place) = sparse.indices.binary_search(&(i as u32))
        {
            bytes = &sparse.values[place * self.component.size() * self.width..];
        }
        let mut out = [0.0; N];
        if bytes.is_empty() {
            return out;
        }
        let size = self.component.size();
        for (k, value) in out.iter_mut().take(self.width).enumerate() {
            *value = self.component.read(&bytes[k * size..]);
        }
        if self.normalized {
            out = out.map(|value| (value / self.component.full()).max(-1.0));
        }
        out
    }

    /// Element `i` of an index accessor.
    #[inline]
    pub fn index(&self, i: usize) -> u32 {
        self.get(i)[0] as u32
    }

    /// The bytes of element `i` as the file has them; none where it leaves them out, which means zeros.
    pub fn raw(&self, i: usize) -> &[u8] {
        let element = self.component.size() * self.width;
        if let Some(sparse) = &self.sparse
            && let Ok(place) = sparse.indices.binary_search(&(i as u32))
        {
            return &sparse.values[place * element..][..element];
        }
        self.bytes.get(i * self.stride..).and_then(|bytes| bytes.get(..element)).unwrap_or_default()
    }

    /// What its components are, and whether they are normalised.
    pub fn kind(&self) -> (Component, bool) {
        (self.component, self.normalized)
    }

    /// Whether these are whole, unsigned numbers, as indices are.
    pub fn is_unsigned(&self) -> bool {
        matches!(self.component, Component::U8 | Component::U16 | Component::U32)
    }
}

/// The bytes of `count` elements, `stride` apart, from `offset` on; checked to lie in the view.
fn elements<'a>(item: &str, view: &'a [u8], offset: u64, count: usize, element: usize, stride: usize) -> Outcome<&'a [u8]> {
    if stride < element && count > 1 {
        return fail(item, format!("its elements of {element} bytes lie {stride} bytes apart"), "export the file again");
    }
    let needed = (count.max(1) as u64 - 1).checked_mul(stride as u64).and_then(|n| n.checked_add(element as u64));
    let needed = if count == 0 { Some(0) } else { needed };
    let end = needed.and_then(|n| n.checked_add(offset)).filter(|end| *end <= view.len() as u64);
    match end {
        Some(end) => Ok(&view[offset as usize..end as usize]),
        None => fail(item, format!("its {count} elements go beyond the {} bytes of its buffer view", view.len()), DAMAGED),
    }
}

fn open_sparse<'a>(accessor: &Accessor, buffers: &'a Buffers, item: &str, element: usize) -> Outcome<Sparse<'a>> {
    let damaged = |problem: &str| Failure::new(item, problem, DAMAGED);
    let sparse = accessor.sparse.as_ref().ok_or_else(|| damaged("is not sparse"))?;
    let component = Component::parse(sparse.indices.component_type)
        .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
        .ok_or_else(|| damaged("its sparse indices are of no unsigned type"))?;
    if sparse.count > accessor.count {
        return Err(damaged("has more sparse elements than elements"));
    }
    let count = sparse.count as usize;
    let (view, _) = buffers.view(sparse.indices.buffer_view)?;
    let raw = elements(item, view, sparse.indices.byte_offset, count, component.size(), component.size())?;
    let indices: Vec<u32> = raw.chunks_exact(component.size()).map(|b| component.read(b) as u32).collect();
    if !indices.is_sorted_by(|a, b| a < b) || indices.last().is_some_and(|&last| u64::from(last) >= accessor.count) {
        return Err(damaged("its sparse indices do not rise, or go beyond its elements"));
    }
    let (view, _) = buffers.view(sparse.values.buffer_view)?;
    let values = elements(item, view, sparse.values.byte_offset, count, element, element)?;
    Ok(Sparse { indices, values })
}
