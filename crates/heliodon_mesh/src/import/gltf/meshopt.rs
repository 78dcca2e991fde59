//! Views compressed by `EXT_meshopt_compression`, decoded by meshoptimizer.
//!
//! Its decoders are made for untrusted input, but assert what the extension's document demands of counts and strides; that is
//! checked here first.

use super::model::Meshopt;
use meshopt::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer, decode_index_sequence,
};

pub(super) fn decode(view: &Meshopt, encoded: &[u8]) -> Option<Vec<u8>> {
    let count = usize::try_from(view.count).ok()?;
    match (view.mode.as_str(), view.byte_stride) {
        ("TRIANGLES", 2 | 4) if !count.is_multiple_of(3) => None,
        ("TRIANGLES", 2) => decode_index_buffer::<u16>(encoded, count).ok().map(|v| bytemuck::cast_slice(&v).to_vec()),
        ("TRIANGLES", 4) => decode_index_buffer::<u32>(encoded, count).ok().map(|v| bytemuck::cast_slice(&v).to_vec()),
        ("INDICES", 2) => decode_index_sequence::<u16>(encoded, count).ok().map(|v| bytemuck::cast_slice(&v).to_vec()),
        ("INDICES", 4) => decode_index_sequence::<u32>(encoded, count).ok().map(|v| bytemuck::cast_slice(&v).to_vec()),
        ("ATTRIBUTES", stride) => attributes(encoded, count, stride, view.filter.as_deref().unwrap_or("NONE")),
        _ => None,
    }
}

fn attributes(encoded: &[u8], count: usize, stride: u64, filter: &str) -> Option<Vec<u8>> {
    let mut bytes = vertices(encoded, count, stride)?;
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => decode_filter_oct::<i8>(bytemuck::cast_slice_mut(&mut bytes)),
        ("OCTAHEDRAL", 8) => with_alignment(&mut bytes, decode_filter_oct::<i16>),
        ("EXPONENTIAL", _) => with_alignment(&mut bytes, |words: &mut [u32]| {
            decode_filter_exp::<1>(bytemuck::cast_slice_mut(words));
        }),
        ("COLOR", 4) => decode_filter_color::<u8>(bytemuck::cast_slice_mut(&mut bytes)),
        ("COLOR", 8) => with_alignment(&mut bytes, decode_filter_color::<u16>),
        ("QUATERNION", 8) => with_alignment(&mut bytes, |words: &mut [u16]| {
            decode_filter_quat(bytemuck::cast_slice_mut(words));
        }),
        _ => return None,
    }
    Some(bytes)
}

/// Bytes need not lie where wider numbers may.
fn with_alignment<T: bytemuck::Pod>(bytes: &mut [u8], filter: impl FnOnce(&mut [T])) {
    let mut copy: Vec<T> = bytemuck::pod_collect_to_vec(bytes);
    filter(&mut copy);
    bytes.copy_from_slice(bytemuck::cast_slice(&copy));
}

/// The vertex codec knows its stride at compile time: multiples of 4 up to 128 bytes are in use (its own limit is 256).
fn vertices(encoded: &[u8], count: usize, stride: u64) -> Option<Vec<u8>> {
    macro_rules! of_words {
        ($($words:literal)*) => {
            match stride {
                $(s if s == 4 * $words => {
                    let rows = meshopt::decode_vertex_buffer::<[u32; $words]>(encoded, count).ok()?;
                    Some(bytemuck::cast_slice(rows.as_flattened()).to_vec())
                })*
                _ => None,
            }
        };
    }
    of_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
}
