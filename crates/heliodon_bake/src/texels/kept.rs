//! Unwrapped surfaces as bytes: cutting and packing charts takes seconds to minutes, and a change of light, names or mattes moves none of them.

use crate::codec::{Decoder, Encoder};
use glam::{Vec2, Vec3};
use heliodon_lightmap::charts::{Chart, Plane};
use heliodon_lightmap::packing::{Packing, Placement};
use heliodon_lightmap::unwrap::Unwrapped;

/// An unwrapped surface as bytes.
#[must_use]
pub fn encode_unwrapped(unwrapped: &Unwrapped) -> Vec<u8> {
    let Unwrapped { original_vertex, triangles, uvs, sheet, chart, charts, packing } = unwrapped;
    let mut encoder = Encoder::default();
    encoder.run(original_vertex).run(triangles.as_flattened()).run(uvs).run(sheet).run(chart);
    let sizes: Vec<u64> = charts.iter().map(|chart| chart.triangles.len() as u64).collect();
    let of_charts: Vec<u32> = charts.iter().flat_map(|chart| &chart.triangles).copied().collect();
    let planes: Vec<[Vec3; 3]> =
        charts.iter().map(|Chart { plane, .. }| [plane.axes[0], plane.axes[1], plane.origin]).collect();
    let scales: Vec<f32> = charts.iter().map(|chart| chart.scale).collect();
    encoder.run(&sizes).run(&of_charts).run(planes.as_flattened()).run(&scales);
    let places: Vec<[u32; 2]> = packing.placements.iter().map(|place| [place.sheet, place.quarters.into()]).collect();
    let offsets: Vec<Vec2> = packing.placements.iter().map(|place| place.offset).collect();
    encoder.run(places.as_flattened()).run(&offsets).run(&[packing.per_m, packing.utilisation]);
    encoder.number(packing.sheets.into());
    encoder.finish()
}

/// That of so many triangles from its bytes; `None` where they are of something else.
#[must_use]
pub fn decode_unwrapped(bytes: &[u8], triangle_count: usize) -> Option<Unwrapped> {
    let mut decoder = Decoder::new(bytes);
    let original_vertex: Vec<u32> = decoder.run()?;
    let triangles: Vec<u32> = decoder.run()?;
    let (uvs, sheet, chart) = (decoder.run::<Vec2>()?, decoder.run::<u16>()?, decoder.run::<u32>()?);
    let (sizes, of_charts) = (decoder.run::<u64>()?, decoder.run::<u32>()?);
    let (planes, scales) = (decoder.run::<Vec3>()?, decoder.run::<f32>()?);
    let (places, offsets) = (decoder.run::<u32>()?, decoder.run::<Vec2>()?);
    let [per_m, utilisation] = decoder.run::<f32>()?[..] else { return None };
    let sheets = u32::try_from(decoder.number()?).ok()?;
    let count = sizes.len();
    let fits = decoder.is_empty()
        && [triangles.len() / 3, sheet.len(), chart.len()] == [triangle_count; 3]
        && uvs.len() == original_vertex.len()
        && [planes.len() / 3, scales.len(), places.len() / 2, offsets.len()] == [count; 4];
    if !fits {
        return None;
    }
    let mut rest = of_charts.as_slice();
    let mut charts = Vec::with_capacity(count);
    for ((&size, &[u, v, origin]), &scale) in sizes.iter().zip(planes.as_chunks().0).zip(&scales) {
        let (own, others) = rest.split_at_checked(usize::try_from(size).ok()?)?;
        rest = others;
        charts.push(Chart { triangles: own.to_vec(), plane: Plane { axes: [u, v], origin }, scale });
    }
    let placement = |(&[sheet, quarters], &offset): (&[u32; 2], &Vec2)| Placement { sheet, quarters: quarters as u8, offset };
    let placements = places.as_chunks().0.iter().zip(&offsets).map(placement).collect();
    let packing = Packing { per_m, placements, sheets, utilisation };
    Some(Unwrapped { original_vertex, triangles: triangles.as_chunks().0.to_vec(), uvs, sheet, chart, charts, packing })
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_lightmap::unwrap::{UnwrapParams, unwrap};

    #[test]
    fn what_was_unwrapped_comes_back() {
        let positions: Vec<Vec3> = (0..8_u8).map(|i| Vec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into())).collect();
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let unwrapped = unwrap(&positions, &triangles, &[1.0; 12], &UnwrapParams::default()).unwrap();
        let bytes = encode_unwrapped(&unwrapped);
        let back = decode_unwrapped(&bytes, 12).unwrap();
        assert_eq!(format!("{back:?}"), format!("{unwrapped:?}"));
        assert!(decode_unwrapped(&bytes, 11).is_none());
        assert!((0..bytes.len()).step_by(7).all(|end| decode_unwrapped(&bytes[..end], 12).is_none()));
    }
}
