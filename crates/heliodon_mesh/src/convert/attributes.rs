//! Vertices as they are stored: which numbers an attribute's become, and how far off.

use super::grid::Grid;
use super::order::{self, Rows};
use super::{Bounds, NormalBits};
use crate::import::raw::{RawArray, RawPrimitive};
use crate::import::{Component, FARTHEST_M};
use std::collections::BTreeMap;

pub(super) const TRIANGLES: u32 = 4;
/// Attributes begin at multiples of so many bytes.
const ALIGNMENT: usize = 4;

/// How a mesh's attributes are to be stored.
pub(super) struct Encoding {
    pub grid: Option<Grid>,
    pub normals: NormalBits,
}

/// One attribute of all vertices.
#[derive(Clone, Debug)]
pub(super) struct Stream {
    pub name: String,
    /// The morph target that it is of.
    pub target: Option<usize>,
    pub component: Component,
    pub normalized: bool,
    pub width: usize,
    /// Bytes from one element to the next.
    pub stride: usize,
    pub bytes: Vec<u8>,
}

impl Stream {
    /// Bytes of an element without what fills it up.
    pub fn element(&self) -> usize {
        self.component.size() * self.width
    }

    /// Whether glTF knows it only with `KHR_mesh_quantization`.
    pub fn is_extended(&self) -> bool {
        let floats = self.component == Component::F32;
        match self.name.as_str() {
            "POSITION" | "NORMAL" | "TANGENT" => !floats,
            name if name.starts_with("TEXCOORD_") || self.target.is_some() => {
                let core = matches!(self.component, Component::U8 | Component::U16) && self.normalized && self.target.is_none();
                !(floats || core)
            }
            _ => false,
        }
    }
}

/// A primitive, welded and ordered.
#[derive(Clone, Debug)]
pub(super) struct Encoded {
    pub mode: u32,
    pub vertices: usize,
    pub corners: Vec<u32>,
    pub streams: Vec<Stream>,
    pub bounds: Bounds,
}

/// Whether it is finite and within reach, as importers see it.
pub(super) fn is_position(p: &[f64; 3]) -> bool {
    p.iter().all(|x| x.abs() <= FARTHEST_M)
}

/// The primitive as it is written; none where nothing is left of it.
pub(super) fn encode(primitive: &RawPrimitive, encoding: &Encoding) -> Option<Encoded> {
    let positions = primitive.attributes.get("POSITION")?;
    let good: Vec<bool> = (0..positions.count).map(|i| is_position(&positions.three(i))).collect();
    let mut bounds = Bounds::default();
    let mut streams: Vec<Stream> = Vec::new();
    let mut weights = BTreeMap::new();
    for (name, array) in &primitive.attributes {
        if name.starts_with("WEIGHTS_") && array.is_float() && array.width == 4 {
            weights.insert(name.clone(), array);
        } else {
            streams.push(attribute(name, array, encoding, &mut bounds));
        }
    }
    streams.extend(weight_streams(&weights, &mut bounds));
    for (target, attributes) in primitive.targets.iter().enumerate() {
        let deltas = attributes.iter().map(|(name, array)| Stream { target: Some(target), ..delta(name, array, encoding) });
        streams.extend(deltas);
    }
    let places: Vec<[f32; 3]> = (0..positions.count).map(|i| positions.three(i).map(|x| x as f32)).collect();
    let mut rows = Rows { streams, vertices: positions.count, corners: primitive.corners.clone() };
    if primitive.mode == TRIANGLES {
        rows.corners =
            rows.corners.as_chunks::<3>().0.iter().filter(|t| t.iter().all(|&i| good[i as usize])).flatten().copied().collect();
        order::weld_and_order(&mut rows, &places);
        if rows.corners.is_empty() {
            return None;
        }
    } else if good.contains(&false) || rows.vertices == 0 {
        return None;
    }
    let Rows { streams, vertices, corners } = rows;
    Some(Encoded { mode: primitive.mode, vertices, corners, streams, bounds })
}

/// Bytes with gaps behind each element.
fn stream(name: &str, (component, normalized): (Component, bool), width: usize, elements: impl Iterator<Item = u8>) -> Stream {
    let element = component.size() * width;
    let stride = element.next_multiple_of(ALIGNMENT);
    let tight: Vec<u8> = elements.collect();
    let bytes = if stride == element {
        tight
    } else {
        tight.chunks_exact(element).flat_map(|e| e.iter().copied().chain(std::iter::repeat_n(0, stride - element))).collect()
    };
    Stream { name: name.to_owned(), target: None, component, normalized, width, stride, bytes }
}

fn as_it_is(name: &str, array: &RawArray) -> Stream {
    stream(name, (array.component, array.normalized), array.width, array.bytes.iter().copied())
}

/// Numbers as they are, but for those that are none.
fn mended(name: &str, array: &RawArray, otherwise: f64) -> Stream {
    let mend = |x: f64| if x.is_finite() { x } else { otherwise } as f32;
    stream(name, (Component::F32, false), array.width, components(array).flat_map(|x| mend(x).to_le_bytes()))
}

fn components(array: &RawArray) -> impl Iterator<Item = f64> + '_ {
    (0..array.count).flat_map(move |i| (0..array.width).map(move |k| array.get(i, k)))
}

fn signed(x: f64) -> i16 {
    // NaN becomes 0
    (x * 32_767.0).round().clamp(-32_767.0, 32_767.0) as i16
}

fn unsigned(x: f64) -> u16 {
    (x * 65_535.0).round().clamp(0.0, 65_535.0) as u16
}

fn attribute(name: &str, array: &RawArray, encoding: &Encoding, bounds: &mut Bounds) -> Stream {
    let kind = name.split('_').next().unwrap_or(name);
    match kind {
        "JOINTS" if !name.starts_with('_') => return joints(name, array),
        _ if !array.is_float() || name.starts_with('_') => return as_it_is(name, array),
        _ => {}
    }
    match (kind, array.width) {
        ("POSITION", 3) => match &encoding.grid {
            Some(grid) => {
                let steps = (0..array.count).flat_map(|i| grid.step(array.three(i))).flat_map(u16::to_le_bytes);
                stream(name, (Component::U16, true), 3, steps)
            }
            None => as_it_is(name, array),
        },
        ("NORMAL", 3) | ("TANGENT", 4) => direction(name, array, encoding.normals, bounds),
        ("TEXCOORD", 2) => texture_coordinates(name, array, bounds),
        ("COLOR", 3 | 4) => color(name, array, bounds),
        _ => as_it_is(name, array),
    }
}

fn direction(name: &str, array: &RawArray, bits: NormalBits, bounds: &mut Bounds) -> Stream {
    // unit ones have no larger component; others are made unit by whoever reads them
    let length = |i: usize| array.three(i).iter().map(|x| x * x).sum::<f64>().sqrt();
    let scale = |i: usize| Some(length(i)).filter(|x| x.is_finite() && *x > 0.0).map_or(0.0, |x| 1.0 / x);
    let unit = (0..array.count).flat_map(|i| {
        let scale = scale(i);
        (0..array.width).map(move |k| if k < 3 { array.get(i, k) * scale } else { array.get(i, k) })
    });
    let steps: f64 = if bits == NormalBits::Eight { 127.0 } else { 32_767.0 };
    // half a step along three axes, seen from as near as the nearest rounded one can be
    let off = 0.5 / steps * 3.0_f64.sqrt();
    if name == "NORMAL" {
        bounds.normal_deg = libm::asin(off).to_degrees();
    }
    match bits {
        NormalBits::Eight => {
            let bytes = unit.map(|x| (x * 127.0).round().clamp(-127.0, 127.0) as i8 as u8);
            stream(name, (Component::I8, true), array.width, bytes)
        }
        NormalBits::Sixteen => stream(name, (Component::I16, true), array.width, unit.flat_map(|x| signed(x).to_le_bytes())),
    }
}

fn texture_coordinates(name: &str, array: &RawArray, bounds: &mut Bounds) -> Stream {
    let finite = || components(array).map(|x| if x.is_finite() { x } else { 0.0 });
    let (low, high) = finite().fold((0.0_f64, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
    if low >= 0.0 && high <= 1.0 {
        bounds.uv = bounds.uv.max(0.5 / 65_535.0);
        stream(name, (Component::U16, true), 2, finite().flat_map(|x| unsigned(x).to_le_bytes()))
    } else if low >= -1.0 && high <= 1.0 {
        bounds.uv = bounds.uv.max(0.5 / 32_767.0);
        stream(name, (Component::I16, true), 2, finite().flat_map(|x| signed(x).to_le_bytes()))
    } else {
        mended(name, array, 0.0)
    }
}

fn color(name: &str, array: &RawArray, bounds: &mut Bounds) -> Stream {
    if components(array).any(|x| !x.is_nan() && !(0.0..=1.0).contains(&x)) {
        return as_it_is(name, array);
    }
    bounds.color = 0.5 / 65_535.0;
    // what is no number is what the importer takes it for
    let mend = |x: f64| if x.is_nan() { 0.5 } else { x };
    stream(name, (Component::U16, true), array.width, components(array).flat_map(|x| unsigned(mend(x)).to_le_bytes()))
}

fn joints(name: &str, array: &RawArray) -> Stream {
    let most = components(array).fold(0.0, f64::max);
    if array.component == Component::U16 && most < 256.0 {
        return stream(name, (Component::U8, false), array.width, components(array).map(|x| x as u8));
    }
    as_it_is(name, array)
}

/// The weights of all sets together, which sum to 65,535 for every vertex that has any.
fn weight_streams(sets: &BTreeMap<String, &RawArray>, bounds: &mut Bounds) -> Vec<Stream> {
    let Some(count) = sets.values().map(|set| set.count).min() else { return Vec::new() };
    bounds.weight = 1.0 / 65_535.0;
    let mut bytes = vec![Vec::with_capacity(count * 8); sets.len()];
    for i in 0..count {
        let all: Vec<f64> = sets.values().flat_map(|set| (0..4).map(|k| set.get(i, k))).collect();
        for (set, four) in bytes.iter_mut().zip(shares(&all).chunks_exact(4)) {
            set.extend(four.iter().flat_map(|share| share.to_le_bytes()));
        }
    }
    sets.keys().zip(bytes).map(|(name, bytes)| stream(name, (Component::U16, true), 4, bytes.into_iter())).collect()
}

/// Parts of 65,535 that are nearest to the weights, by the largest remainders.
fn shares(weights: &[f64]) -> Vec<u16> {
    let weights: Vec<f64> = weights.iter().map(|&w| if w > 0.0 && w.is_finite() { w } else { 0.0 }).collect();
    let sum: f64 = weights.iter().sum();
    if sum <= 0.0 {
        return vec![0; weights.len()];
    }
    let exact: Vec<f64> = weights.iter().map(|w| w / sum * 65_535.0).collect();
    let mut shares: Vec<u16> = exact.iter().map(|x| x.floor() as u16).collect();
    let missing = 65_535 - shares.iter().map(|&share| usize::from(share)).sum::<usize>().min(65_535);
    let mut order: Vec<usize> = (0..exact.len()).filter(|&k| exact[k] > 0.0).collect();
    order.sort_by(|&a, &b| (exact[b].fract()).total_cmp(&exact[a].fract()).then(a.cmp(&b)));
    order.iter().take(missing).for_each(|&k| shares[k] = shares[k].saturating_add(1));
    shares
}

/// What a morph target adds.
fn delta(name: &str, array: &RawArray, encoding: &Encoding) -> Stream {
    if !array.is_float() || array.width != 3 {
        return as_it_is(name, array);
    }
    match (name, &encoding.grid) {
        ("POSITION", Some(grid)) => {
            let steps = (0..array.count).flat_map(|i| grid.delta(array.three(i))).flat_map(i16::to_le_bytes);
            stream(name, (Component::I16, true), 3, steps)
        }
        ("NORMAL" | "TANGENT", _) if components(array).all(|x| x.abs() <= 1.0) => {
            stream(name, (Component::I16, true), 3, components(array).flat_map(|x| signed(x).to_le_bytes()))
        }
        _ => as_it_is(name, array),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_keep_their_shares() {
        assert_eq!(shares(&[0.5, 0.5, 0.0, 0.0]), [32_768, 32_767, 0, 0]);
        assert_eq!(shares(&[f64::NAN, -1.0, 2.0, f64::INFINITY]), [0, 0, 65_535, 0]);
        assert_eq!(shares(&[0.0; 4]), [0; 4]);
        let thirds = shares(&[1.0 / 3.0; 3]);
        assert_eq!(thirds.iter().map(|&x| u32::from(x)).sum::<u32>(), 65_535);
        assert!(thirds.iter().all(|x| x.abs_diff(21_845) <= 1));
    }

    #[test]
    fn what_is_outside_of_what_whole_numbers_hold_stays() {
        let array = |values: &[f32]| RawArray::floats(2, values.iter().copied());
        let mut bounds = Bounds::default();
        let kind = |stream: Stream| (stream.component, stream.stride);
        assert_eq!(kind(texture_coordinates("TEXCOORD_0", &array(&[0.0, 1.0]), &mut bounds)), (Component::U16, 4));
        assert_eq!(kind(texture_coordinates("TEXCOORD_0", &array(&[-0.5, 1.0]), &mut bounds)), (Component::I16, 4));
        assert_eq!(kind(texture_coordinates("TEXCOORD_0", &array(&[f32::NAN, 1.5]), &mut bounds)), (Component::F32, 8));
        let bright = RawArray::floats(3, [0.0, 2.0, 1.0]);
        assert_eq!(kind(color("COLOR_0", &bright, &mut bounds)), (Component::F32, 12));
        assert_eq!(bounds.color, 0.0);
    }
}
