//! Vertices that are the same become one; triangles and vertices in the order in which a device takes them best.

use super::attributes::Stream;
use crate::device_order::{Ordered, ordered};

/// Vertices that caches hold, where misses are counted.
const CACHE: u32 = 16;
const EMPTY: u32 = u32::MAX;

/// A primitive's vertices, attribute by attribute, and its corners.
pub(super) struct Rows {
    pub streams: Vec<Stream>,
    pub vertices: usize,
    pub corners: Vec<u32>,
}

/// Vertices that a cache of 16 has to work on.
pub(super) fn cache_misses(corners: &[u32], vertices: usize) -> u64 {
    if corners.is_empty() {
        return 0;
    }
    u64::from(meshopt::analyze_vertex_cache(corners, vertices, CACHE, 0, 0).vertices_transformed)
}

/// Welds, drops triangles that name a vertex twice then, and orders.
pub(super) fn weld_and_order(rows: &mut Rows, places: &[[f32; 3]]) {
    let first = first_of_row(&rows.streams, rows.vertices);
    let corners: Vec<u32> = rows.corners.iter().map(|&corner| first[corner as usize]).collect();
    let is_triangle = |t: &&[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let corners: Vec<u32> = corners.as_chunks::<3>().0.iter().filter(is_triangle).flatten().copied().collect();
    if corners.is_empty() {
        rows.corners = corners;
        return;
    }
    let Ordered { corners, vertices } = ordered(&corners, places);
    for stream in &mut rows.streams {
        let stride = stream.stride;
        let row = |&vertex: &u32| &stream.bytes[vertex as usize * stride..][..stride];
        stream.bytes = vertices.iter().flat_map(row).copied().collect();
    }
    (rows.vertices, rows.corners) = (vertices.len(), corners);
}

/// For each vertex the first one of which all bytes are the same.
fn first_of_row(streams: &[Stream], vertices: usize) -> Vec<u32> {
    let width: usize = streams.iter().map(|stream| stream.stride).sum();
    let mut bytes = Vec::with_capacity(width * vertices);
    for i in 0..vertices {
        streams.iter().for_each(|stream| bytes.extend_from_slice(&stream.bytes[i * stream.stride..][..stream.stride]));
    }
    let size = (vertices * 2).next_power_of_two().max(2);
    let mut slots = vec![EMPTY; size];
    let row = |i: usize| &bytes[i * width..][..width];
    let place = |i: usize| {
        let mut slot = hash(row(i)) as usize & (size - 1);
        loop {
            match slots[slot] {
                EMPTY => break,
                first if row(first as usize) == row(i) => return first,
                _ => slot = (slot + 1) & (size - 1),
            }
        }
        slots[slot] = i as u32;
        i as u32
    };
    (0..vertices).map(place).collect()
}

/// Of words; rows are multiples of four bytes.
fn hash(row: &[u8]) -> u64 {
    let mix =
        |h: u64, word: &[u8; 4]| (h ^ u64::from(u32::from_le_bytes(*word))).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
    let h = row.as_chunks::<4>().0.iter().fold(0x51_7C_C1_B7, mix);
    (h ^ (h >> 32)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 20
}
