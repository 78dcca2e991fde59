//! What no photograph saw takes the colours about it, smoothly over the surface: a membrane over each gap, held by what was seen around it
//! ([`super::membrane`]). It goes on where faces meet, whatever their charts' places, turns and sizes in the atlas, and knows nothing of a chart that merely
//! lies beside. A gap that nothing seen hangs together with takes a plain colour.

use super::layout::Layout;
use super::lit::TexelIndex;
use super::membrane::Membrane;
use super::surface::Surface;
use crate::model::Part;
use glam::{Vec2, Vec3};
use heliodon_mesh::topology::{Edges, HalfEdge, UnionFind, places};

/// The colours of all texels, with a part's entry of `plain` where nothing holds a gap.
pub(super) fn filled(parts: &[Part], surface: &Surface, layout: &Layout, colors: &[Option<Vec3>], plain: &[Vec3]) -> Vec<Vec3> {
    let gaps: Vec<u32> = (0..colors.len() as u32).filter(|&texel| colors[texel as usize].is_none()).collect();
    let mut membrane = Membrane { starts: vec![0], ..Membrane::default() };
    // for each texel its node
    let mut node_of = vec![NONE; colors.len()];
    gaps.iter().enumerate().for_each(|(node, &texel)| node_of[texel as usize] = node as u32);
    let index = TexelIndex::new(layout);
    let seams = seams(parts, surface, layout, &index, &node_of);
    let mut nodes = UnionFind::new(gaps.len());
    for (node, &texel) in gaps.iter().enumerate() {
        let (mut held, mut pull) = (0.0, Vec3::ZERO);
        let mut link = |other: u32, weight: f32| match colors[other as usize] {
            Some(color) => {
                held += weight;
                pull += color * weight;
            }
            None => {
                membrane.links.push((node_of[other as usize], weight));
                nodes.unite(node as u32, node_of[other as usize], false);
            }
        };
        let [x, y] = layout.texels[texel as usize].at.map(i64::from);
        let face = surface.face_of[layout.texels[texel as usize].triangle as usize];
        for (x, y) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
            if let Some(other) = index.of_face(face, x, y) {
                link(other, 1.0);
            }
        }
        let first = seams.partition_point(|seam| seam.from < texel);
        seams[first..].iter().take_while(|seam| seam.from == texel).for_each(|seam| link(seam.to, seam.weight));
        membrane.starts.push(membrane.links.len() as u32);
        membrane.held.push(held);
        membrane.pull.push(pull);
    }
    let mut is_held = vec![false; gaps.len()];
    for node in (0..gaps.len()).filter(|&node| membrane.held[node] > 0.0) {
        is_held[nodes.find(node as u32).0 as usize] = true;
    }
    for (node, &texel) in gaps.iter().enumerate() {
        if !is_held[nodes.find(node as u32).0 as usize] {
            let face = surface.face_of[layout.texels[texel as usize].triangle as usize];
            membrane.held[node] = 1.0;
            membrane.pull[node] = plain[surface.faces[face as usize].part];
        }
    }
    let found = membrane.solved();
    let color = |(color, node): (&Option<Vec3>, &u32)| color.unwrap_or_else(|| found[*node as usize].max(Vec3::ZERO));
    colors.iter().zip(&node_of).map(color).collect()
}

const NONE: u32 = u32::MAX;

/// A place where two charts show what lies side by side on the surface.
struct Seam {
    from: u32,
    to: u32,
    weight: f32,
}

/// Places along a seam for each texel of the finer of its charts: none of its texels is missed.
const PLACES: f32 = 2.0;
/// Sides of triangles that lie nearer to one another than this in the atlas, texels, are no seam: the same texels show both.
const ONE_SIDE: f32 = 0.5;

/// Both ways of all seams at texels that have a node, sorted by where they begin.
fn seams(parts: &[Part], surface: &Surface, layout: &Layout, index: &TexelIndex, node_of: &[u32]) -> Vec<Seam> {
    let mut seams: Vec<Seam> = Vec::new();
    let is_gap = |texel: u32| node_of[texel as usize] != NONE;
    for (part, &first) in parts.iter().zip(&surface.starts) {
        let at = places(&part.mesh.positions, 0.0);
        let is_surface = |t: usize| {
            let [a, b, c] = part.mesh.triangles[t].map(|v| at[v as usize]);
            a != b && b != c && c != a
        };
        Edges::new(&part.mesh.triangles, &at, is_surface).for_each(|_, sides| {
            let sides: Vec<Side> = sides.map(|side| Side::new(side, first, layout)).collect();
            for pair in sides.windows(2) {
                let lengths = [0, 1].map(|k| pair[k].to.distance(pair[k].from));
                let apart = pair[0].from.distance(pair[1].from).max(pair[0].to.distance(pair[1].to));
                let is_one = surface.face_of[pair[0].triangle] == surface.face_of[pair[1].triangle] && apart < ONE_SIDE;
                let count = (PLACES * lengths[0].max(lengths[1])).ceil();
                if is_one || !(lengths[0] > 0.0 && lengths[1] > 0.0 && count.is_finite()) {
                    continue;
                }
                // as wide as a place's share of the edge, as long as half a texel of each chart: 1 between texels of one size
                let weight = 2.0 / count * lengths[0] * lengths[1] / (lengths[0] + lengths[1]);
                for k in 0..count as u32 {
                    let along = (k as f32 + 0.5) / count;
                    let texel = |side: &Side| side.texel(along, surface.face_of[side.triangle], index);
                    if let (Some(a), Some(b)) = (texel(&pair[0]), texel(&pair[1])) {
                        let both = [(a, b), (b, a)].into_iter().filter(|(from, to)| from != to && is_gap(*from));
                        seams.extend(both.map(|(from, to)| Seam { from, to, weight }));
                    }
                }
            }
        });
    }
    seams.sort_by_key(|seam| seam.from);
    seams
}

/// A side of a triangle in the atlas, from the place of its edge with the lower number to the other.
struct Side {
    triangle: usize,
    from: Vec2,
    to: Vec2,
    /// To the middles of the texels along it, half a texel.
    inwards: Vec2,
}

impl Side {
    fn new(side: HalfEdge, first: u32, layout: &Layout) -> Self {
        let triangle = (first + side.triangle) as usize;
        let corner = |step: u8| layout.corners[triangle][usize::from((side.corner + step) % 3)];
        let (begin, end, third) = (corner(0), corner(1), corner(2));
        let across = (end - begin).perp().try_normalize().unwrap_or(Vec2::ZERO) * 0.5;
        let inwards = if across.dot(third - begin) < 0.0 { -across } else { across };
        let (from, to) = if side.down { (end, begin) } else { (begin, end) };
        Self { triangle, from, to, inwards }
    }

    /// The texel at a part of the way along it.
    fn texel(&self, along: f32, face: u32, index: &TexelIndex) -> Option<u32> {
        let edge = self.from.lerp(self.to, along);
        // a face narrower than a texel may have none inside
        [edge + self.inwards, edge].iter().find_map(|at| index.of_face(face, at.x.floor() as i64, at.y.floor() as i64))
    }
}
