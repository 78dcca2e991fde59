//! The order of origins in which beams are tight.

use glam::Vec3;
use rayon::prelude::*;

/// Points of a group, which are tested together.
const GROUP: usize = 16;
/// Below this many, one thread sorts alone.
const ALONE: usize = 4096;

/// The order of points in which the parallel questions are fastest: `order[i]` is the index of the i-th. Sixteen after
/// sixteen (and four sixteens) lie close together and, where normals are given, face the same way. Points that are not
/// finite come in any place. The same points give the same order on any number of threads.
///
/// Why not along a Morton curve: its runs of sixteen are not boxes, and change sides where the curve crosses a thin wall.
/// Rays are 4 to 8 % slower in [`crate::morton_order`] (a temple of 2 million triangles), which takes less time to compute.
///
/// # Panics
/// If there are normals, but not one for each point.
pub fn beam_order(points: &[Vec3], normals: Option<&[Vec3]>) -> Vec<u32> {
    assert!(normals.is_none_or(|n| n.len() == points.len()), "one normal for each point");
    let mut items: Vec<Item> = (0..points.len())
        .into_par_iter()
        .map(|i| {
            let normal = normals.map_or(Vec3::ZERO, |n| n[i]);
            Item { index: i as u32, at: [points[i].to_array(), normal.to_array()] }
        })
        .collect();
    split(&mut items);
    items.into_iter().map(|item| item.index).collect()
}

#[derive(Clone, Copy)]
struct Item {
    index: u32,
    at: [[f32; 3]; 2],
}

/// Halves the points across their widest axis until groups are left.
fn split(items: &mut [Item]) {
    if items.len() <= GROUP {
        return;
    }
    let spans = [0, 1].map(|of| {
        let vector = |item: &Item| Vec3::from_array(item.at[of]);
        let finite = || items.iter().map(vector).filter(|x| x.is_finite());
        let low = finite().fold(Vec3::INFINITY, Vec3::min);
        let high = finite().fold(Vec3::NEG_INFINITY, Vec3::max);
        (high - low).max(Vec3::ZERO)
    });
    // Of n points on a surface as wide as they are, sixteen are about 4 / sqrt(n) of it apart. So normals count from
    // about a hundred points on, where they differ by more than a radian: both sides of a wall, or an edge.
    let (place, facing) = (spans[0].max_element(), spans[1].max_element());
    let turned = facing * 8.0 > (items.len() as f32).sqrt();
    let of = usize::from(turned || place == 0.0);
    let span = spans[of];
    let axis = if span.x >= span.y && span.x >= span.z {
        0
    } else if span.y >= span.z {
        1
    } else {
        2
    };
    let unit = if items.len() > 4 * GROUP { 4 * GROUP } else { GROUP };
    let middle = (items.len() / 2).next_multiple_of(unit).min((items.len() - 1) / unit * unit);
    items.select_nth_unstable_by(middle, |a, b| a.at[of][axis].total_cmp(&b.at[of][axis]).then(a.index.cmp(&b.index)));
    let (left, right) = items.split_at_mut(middle);
    if left.len() + right.len() > ALONE {
        rayon::join(|| split(left), || split(right));
    } else {
        split(left);
        split(right);
    }
}
