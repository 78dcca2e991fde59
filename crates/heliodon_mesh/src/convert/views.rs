//! The buffer of a file, its views and accessors, packed or not.

use super::attributes::{Encoded, Stream};
use crate::import::Component;
use crate::import::raw::RawArray;
use serde_json::{Value, json};

/// Vertices that indices of two bytes can name: 65,535 restarts a strip.
pub(super) const MOST_SHORT: usize = 65_535;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
/// The extension by which views are packed.
pub(super) const MESHOPT: &str = "EXT_meshopt_compression";

#[derive(Default)]
pub(super) struct Views {
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
    compress: bool,
    /// Bytes of the buffer that packed views unpack to.
    unpacked: u64,
}

/// What a packed view unpacks to.
struct Packing {
    mode: &'static str,
    count: usize,
    stride: usize,
}

impl Views {
    pub fn new(compress: bool) -> Self {
        Self { compress, ..Self::default() }
    }

    fn align(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    /// Bytes as they are.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.align();
        self.views.push(json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() }));
        self.bytes.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn packed(&mut self, encoded: &[u8], packing: &Packing) -> usize {
        self.align();
        let length = packing.count * packing.stride;
        let offset = self.unpacked.next_multiple_of(4);
        self.unpacked = offset + length as u64;
        let extension = json!({
            "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": encoded.len(), "byteStride": packing.stride,
            "count": packing.count, "mode": packing.mode,
        });
        self.views
            .push(json!({ "buffer": 1, "byteOffset": offset, "byteLength": length, "extensions": { MESHOPT: extension } }));
        self.bytes.extend_from_slice(encoded);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, component: Component, kind: &str, count: usize) -> usize {
        self.accessors.push(json!({ "bufferView": view, "componentType": component.code(), "type": kind, "count": count }));
        self.accessors.len() - 1
    }

    /// An array of skins or animations; with its bounds where they are asked for.
    pub fn array(&mut self, array: &RawArray, bounded: bool) -> usize {
        let view = self.view(&array.bytes);
        let accessor = self.accessor(view, array.component, kind(array.width), array.count);
        if array.normalized {
            self.accessors[accessor]["normalized"] = json!(true);
        }
        if bounded && array.count > 0 {
            let bound = |pick: fn(f64, f64) -> f64| (0..array.count).map(|i| array.stored(i, 0)).reduce(pick);
            self.accessors[accessor]["min"] = json!([bound(f64::min)]);
            self.accessors[accessor]["max"] = json!([bound(f64::max)]);
        }
        accessor
    }

    /// The corners of a primitive; none where it has no indices.
    pub fn corners(&mut self, encoded: &Encoded) -> Option<usize> {
        let corners = &encoded.corners;
        if corners.is_empty() {
            return None;
        }
        let is_short = encoded.vertices <= MOST_SHORT;
        let component = if is_short { Component::U16 } else { Component::U32 };
        let stride = component.size();
        let packed = (self.compress && encoded.mode == super::attributes::TRIANGLES)
            .then(|| meshopt::encode_index_buffer(corners, encoded.vertices).ok())
            .flatten();
        let view = match packed {
            Some(packed) => self.packed(&packed, &Packing { mode: "TRIANGLES", count: corners.len(), stride }),
            None if is_short => {
                let bytes: Vec<u8> = corners.iter().flat_map(|&corner| (corner as u16).to_le_bytes()).collect();
                self.view(&bytes)
            }
            None => {
                let bytes: Vec<u8> = corners.iter().flat_map(|corner| corner.to_le_bytes()).collect();
                self.view(&bytes)
            }
        };
        self.views[view]["target"] = json!(ELEMENT_ARRAY_BUFFER);
        Some(self.accessor(view, component, "SCALAR", corners.len()))
    }

    /// One attribute.
    pub fn stream(&mut self, stream: &Stream) -> usize {
        let count = stream.bytes.len() / stream.stride;
        let packed = self.compress.then(|| packed_vertices(&stream.bytes, stream.stride)).flatten();
        let view = match packed {
            Some(packed) => self.packed(&packed, &Packing { mode: "ATTRIBUTES", count, stride: stream.stride }),
            None => self.view(&stream.bytes),
        };
        self.views[view]["target"] = json!(ARRAY_BUFFER);
        self.views[view]["byteStride"] = json!(stream.stride);
        let accessor = self.accessor(view, stream.component, kind(stream.width), count);
        if stream.normalized {
            self.accessors[accessor]["normalized"] = json!(true);
        }
        if stream.name == "POSITION" {
            let (low, high) = limits(stream);
            self.accessors[accessor]["min"] = json!(low);
            self.accessors[accessor]["max"] = json!(high);
        }
        accessor
    }

    /// The buffers: what is in the file, and what it unpacks to.
    pub fn buffers(&mut self) -> Value {
        self.align();
        let own = json!({ "byteLength": self.bytes.len() });
        if self.unpacked == 0 {
            return json!([own]);
        }
        json!([own, { "byteLength": self.unpacked, "extensions": { MESHOPT: { "fallback": true } } }])
    }

    pub fn is_packed(&self) -> bool {
        self.unpacked > 0
    }
}

fn kind(width: usize) -> &'static str {
    match width {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        _ => "MAT4",
    }
}

/// The least and the greatest of each component, as they are stored.
fn limits(stream: &Stream) -> (Vec<f64>, Vec<f64>) {
    let (mut low, mut high) = (vec![f64::INFINITY; stream.width], vec![f64::NEG_INFINITY; stream.width]);
    for element in stream.bytes.chunks_exact(stream.stride) {
        for (k, number) in element[..stream.element()].chunks_exact(stream.component.size()).enumerate() {
            let x = stream.component.read(number);
            (low[k], high[k]) = (low[k].min(x), high[k].max(x));
        }
    }
    (low, high)
}

/// The vertex codec knows its stride at compile time; of version 0, which is what the extension means.
fn packed_vertices(bytes: &[u8], stride: usize) -> Option<Vec<u8>> {
    macro_rules! of_words {
        ($($words:literal)*) => {
            match stride {
                $(s if s == 4 * $words => {
                    let rows: Vec<[u32; $words]> = bytemuck::pod_collect_to_vec(bytes);
                    meshopt::encode_vertex_buffer_level(&rows, 2, Some(0)).ok()
                })*
                _ => None,
            }
        };
    }
    of_words!(1 2 3 4 5 6 7 8 16)
}
