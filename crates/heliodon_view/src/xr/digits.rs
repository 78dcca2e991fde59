//! Hours as seven-segment digits: a mesh of rectangles, for a text in space would take a camera and a picture of its own.

use bevy::asset::RenderAssetUsages;
use bevy::math::Rect;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

/// Of a digit that is 1 high: its width, how thick its segments are, and the gap to the next.
const WIDTH: f32 = 0.52;
const THICK: f32 = 0.13;
const GAP: f32 = 0.2;

/// The segments of 0 to 9: from bit 0 on, top, upper right, lower right, bottom, lower left, upper left, middle.
const LIT: [u8; 10] =
    [0b011_1111, 0b000_0110, 0b101_1011, 0b100_1111, 0b110_0110, 0b110_1101, 0b111_1101, 0b000_0111, 0b111_1111, 0b110_1111];

/// The segments of a digit whose lower left corner is the origin.
fn segments() -> [Rect; 7] {
    let (middle, half) = (0.5, THICK * 0.5);
    [
        Rect::new(0.0, 1.0 - THICK, WIDTH, 1.0),
        Rect::new(WIDTH - THICK, middle, WIDTH, 1.0),
        Rect::new(WIDTH - THICK, 0.0, WIDTH, middle),
        Rect::new(0.0, 0.0, WIDTH, THICK),
        Rect::new(0.0, 0.0, THICK, middle),
        Rect::new(0.0, middle, THICK, 1.0),
        Rect::new(0.0, middle - half, WIDTH, middle + half),
    ]
}

/// The rectangles of a text of digits and colons, 1 high, with its lower left corner at the origin, and how wide it is. Other signs are gaps.
fn rectangles(text: &str) -> (Vec<Rect>, f32) {
    let (mut made, mut at) = (Vec::new(), 0.0);
    for sign in text.chars() {
        let shift = Vec2::new(at, 0.0);
        let moved = |of: Rect| Rect { min: of.min + shift, max: of.max + shift };
        if let Some(digit) = sign.to_digit(10) {
            let lit = LIT[digit as usize];
            made.extend(segments().into_iter().enumerate().filter(|(bit, _)| lit >> bit & 1 == 1).map(|(_, of)| moved(of)));
            at += WIDTH + GAP;
        } else {
            if sign == ':' {
                made.extend([0.2, 0.65].map(|y| moved(Rect::new(0.0, y, THICK, y + THICK))));
            }
            at += THICK + GAP;
        }
    }
    (made, (at - GAP).max(0.0))
}

/// A text of digits and colons so high, in the plane z = 0, seen from +z; the middle of it is the origin.
pub(super) fn mesh(text: &str, height: f32) -> Mesh {
    let (rectangles, width) = rectangles(text);
    let middle = Vec2::new(width, 1.0) * 0.5;
    let (mut positions, mut indices): (Vec<[f32; 3]>, Vec<u32>) = default();
    for Rect { min, max } in rectangles {
        let first = positions.len() as u32;
        let corners = [min, Vec2::new(max.x, min.y), max, Vec2::new(min.x, max.y)];
        positions.extend(corners.map(|corner| ((corner - middle) * height).extend(0.0).to_array()));
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    if positions.is_empty() {
        // A mesh of nothing has no place on the GPU.
        (positions, indices) = (vec![[0.0; 3]; 3], vec![0, 1, 2]);
    }
    let count = positions.len();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; count])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, vec![[0.0, 0.0]; count])
        .with_inserted_indices(Indices::U32(indices))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_have_their_segments_and_stand_in_a_row() {
        let count = |text: &str| rectangles(text).0.len();
        assert_eq!([count("1"), count("8"), count("07:30"), count(""), count("-")], [2, 7, 6 + 3 + 2 + 5 + 6, 0, 0]);
        let (of, width) = rectangles("12:34");
        assert!(of.iter().all(|one| one.min.x >= 0.0 && one.max.x <= width + 1e-6 && one.min.y >= 0.0 && one.max.y <= 1.0));
        // A 1 is at its right.
        assert!(rectangles("1").0.iter().all(|one| one.min.x > WIDTH * 0.5));
    }

    #[test]
    fn a_text_is_centred_and_as_high_as_asked() {
        let mesh = mesh("20:08", 0.1);
        let Some(bevy::mesh::VertexAttributeValues::Float32x3(places)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION) else {
            panic!()
        };
        let reach = |axis: usize| {
            let values = || places.iter().map(|place| place[axis]);
            (values().fold(f32::INFINITY, f32::min), values().fold(f32::NEG_INFINITY, f32::max))
        };
        assert!((reach(1).0 + 0.05).abs() < 1e-6 && (reach(1).1 - 0.05).abs() < 1e-6);
        assert!((reach(0).0 + reach(0).1).abs() < 1e-6);
        assert_eq!(super::mesh("", 0.1).count_vertices(), 3);
    }
}
