//! What whoever bakes light for a survey asks of it: the surface as rays and light see it, and texels that may stand for those about them.

use super::Survey;
use super::layout::Layout;
use super::surface::{Face, Surface, Triangle};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_rays::TriangleScene;
use rayon::prelude::*;

/// Which texel shows a place of the surface.
pub struct TexelIndex<'a> {
    layout: &'a Layout,
    /// For each cell of the atlas its texel.
    at: Vec<u32>,
}

const NOBODY: u32 = u32::MAX;

impl<'a> TexelIndex<'a> {
    pub(super) fn new(layout: &'a Layout) -> Self {
        let [width, height] = layout.size;
        let mut at = vec![NOBODY; width as usize * height as usize];
        (0..layout.texels.len()).for_each(|texel| at[layout.cell(texel)] = texel as u32);
        Self { layout, at }
    }

    /// The texel at a place of a triangle, `u` and `v` weighing its second and third corner; `None` where the triangle has no texture.
    #[must_use]
    pub fn texel(&self, triangle: u32, u: f32, v: f32) -> Option<usize> {
        let [a, b, c] = *self.layout.corners.get(triangle as usize)?;
        let place = a + (b - a) * u + (c - a) * v;
        let [width, height] = self.layout.size;
        let (x, y) = ((place.x.max(0.0) as u32).min(width - 1), (place.y.max(0.0) as u32).min(height - 1));
        let texel = self.at[y as usize * width as usize + x as usize];
        (texel != NOBODY).then_some(texel as usize)
    }

    /// A face's texel in a column and row of the atlas.
    pub(super) fn of_face(&self, face: u32, x: i64, y: i64) -> Option<u32> {
        let [width, height] = self.layout.size.map(i64::from);
        let texel = *self.at.get(usize::try_from(y * width + x).ok()?)?;
        let own = self.layout.starts[face as usize]..self.layout.starts[face as usize + 1];
        ((0..width).contains(&x) && (0..height).contains(&y) && own.contains(&(texel as usize))).then_some(texel)
    }
}

/// Texels that stand for those about them, for what changes slowly over a surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sparse {
    /// The texels that stand for others.
    pub nodes: Vec<u32>,
    /// For each texel where its share of `weights` begins, and where the last one's ends; nothing for texels that were not asked for.
    pub starts: Vec<u32>,
    /// Which of `nodes` a texel is read from, and how much each counts: 1 in all.
    pub weights: Vec<(u32, f32)>,
}

impl Sparse {
    /// What a texel has of the nodes' values; `None` if it was not asked for.
    #[must_use]
    pub fn read(&self, texel: usize, values: &[Vec3]) -> Option<Vec3> {
        let own = &self.weights[self.starts[texel] as usize..self.starts[texel + 1] as usize];
        (!own.is_empty()).then(|| own.iter().map(|(node, weight)| values[*node as usize] * *weight).sum())
    }
}

impl Survey<'_> {
    /// What rays meet: the parts' triangles, then those of what stands in the way.
    #[must_use]
    pub fn scene(&self) -> &TriangleScene {
        &self.surface.scene
    }

    /// The triangles of [`Survey::scene`]: their corners, and the unit normals there, as light is to see the surface.
    #[must_use]
    pub fn triangles(&self) -> Vec<([Vec3; 3], [Vec3; 3])> {
        let own = self.surface.triangles.iter().map(|triangle| (triangle.corners, triangle.normals));
        let others = self.surface.others.iter().map(|&[a, b, c]| ([a, b, c], [unit_or((b - a).cross(c - a), Vec3::Y); 3]));
        own.chain(others).collect()
    }

    /// For each texel the unit normal by which light falls on it: that of a round surface where flat triangles stand for one.
    pub fn light_normals(&self) -> impl ExactSizeIterator<Item = Vec3> {
        self.layout.texels.iter().map(|texel| light_normal(&self.surface, texel.triangle, texel.place))
    }

    /// The faces' texels, each with the index of the part that it belongs to.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = (usize, std::ops::Range<usize>)> {
        let range = |(i, face): (usize, &Face)| (face.part, self.layout.starts[i]..self.layout.starts[i + 1]);
        self.surface.faces.iter().enumerate().map(range)
    }

    /// Which texel shows which place.
    #[must_use]
    pub fn index(&self) -> TexelIndex<'_> {
        TexelIndex::new(&self.layout)
    }

    /// One of each `every` by `every` texels of a face to stand for those about it, of those that `asked` names. What is not asked for, as the ground under a
    /// block, stands for nothing.
    ///
    /// # Panics
    /// If there are not as many in `asked` as [`Survey::places`].
    #[must_use]
    pub fn sparse(&self, every: u32, asked: &[bool]) -> Sparse {
        assert_eq!(asked.len(), self.layout.texels.len(), "one for each texel");
        let of_faces: Vec<Sparse> = (0..self.surface.faces.len())
            .into_par_iter()
            .map(|face| sparse_of(&self.layout, self.layout.starts[face]..self.layout.starts[face + 1], every.max(1), asked))
            .collect();
        let mut all = Sparse { starts: vec![0], ..Sparse::default() };
        for face in of_faces {
            let (first_node, first_weight) = (all.nodes.len() as u32, all.weights.len() as u32);
            all.nodes.extend(face.nodes);
            all.starts.extend(face.starts[1..].iter().map(|start| start + first_weight));
            all.weights.extend(face.weights.into_iter().map(|(node, weight)| (node + first_node, weight)));
        }
        all
    }
}

fn light_normal(surface: &Surface, triangle: u32, place: Vec3) -> Vec3 {
    let Triangle { corners: [a, b, c], normal, normals } = surface.triangles[triangle as usize];
    let (ab, ac, to) = (b - a, c - a, place - a);
    let area = ab.cross(ac);
    let square = area.length_squared();
    if square <= 0.0 {
        return normal;
    }
    let (u, v) = (to.cross(ac).dot(area) / square, ab.cross(to).dot(area) / square);
    unit_or(normals[0] * (1.0 - u - v) + normals[1] * u + normals[2] * v, normal)
}

/// So many cells' sides a node is heard: farther than a cell's diagonal, so that each texel hears that of its own.
const HEARD: f32 = 1.5;

fn sparse_of(layout: &Layout, range: std::ops::Range<usize>, every: u32, asked: &[bool]) -> Sparse {
    let texels = &layout.texels[range.clone()];
    let mut sparse = Sparse { starts: vec![0], ..Sparse::default() };
    let low = texels.iter().fold([u16::MAX; 2], |low, t| [low[0].min(t.at[0]), low[1].min(t.at[1])]);
    let high = texels.iter().fold([0; 2], |high, t| [high[0].max(t.at[0]), high[1].max(t.at[1])]);
    if texels.is_empty() {
        return sparse;
    }
    let cells = [0, 1].map(|axis| (u32::from(high[axis] - low[axis]) / every + 1) as usize);
    let of = |at: [u16; 2]| [0, 1].map(|axis| (u32::from(at[axis] - low[axis]) / every) as usize);
    // the asked texel nearest to each cell's middle, those on the face before those beside it
    let mut best = vec![(f32::INFINITY, NOBODY); cells[0] * cells[1]];
    for (i, texel) in texels.iter().enumerate().filter(|(i, _)| asked[range.start + i]) {
        let [x, y] = of(texel.at);
        let off = |axis: usize, cell: usize| f32::from(texel.at[axis] - low[axis]) - (cell as f32 + 0.5) * every as f32 + 0.5;
        let (dx, dy) = (off(0, x), off(1, y));
        let beside = if texel.inside { 0.0 } else { (every * every) as f32 };
        let distance = dx * dx + dy * dy + beside;
        let cell = &mut best[y * cells[0] + x];
        if distance < cell.0 {
            *cell = (distance, i as u32);
        }
    }
    let mut node_of = vec![NOBODY; best.len()];
    for (cell, (_, texel)) in best.iter().enumerate().filter(|(_, (_, texel))| *texel != NOBODY) {
        node_of[cell] = sparse.nodes.len() as u32;
        sparse.nodes.push(range.start as u32 + texel);
    }
    let reach = HEARD * every as f32;
    for (i, texel) in texels.iter().enumerate() {
        if asked[range.start + i] {
            let begin = sparse.weights.len();
            let [x, y] = of(texel.at);
            for cy in y.saturating_sub(1)..(y + 2).min(cells[1]) {
                for cx in x.saturating_sub(1)..(x + 2).min(cells[0]) {
                    let node = node_of[cy * cells[0] + cx];
                    if node == NOBODY {
                        continue;
                    }
                    let other = layout.texels[sparse.nodes[node as usize] as usize].at;
                    let off = |axis: usize| f32::from(texel.at[axis]) - f32::from(other[axis]);
                    let near = 1.0 - (off(0) * off(0) + off(1) * off(1)) / (reach * reach);
                    if near > 0.0 {
                        sparse.weights.push((node, near * near));
                    }
                }
            }
            let sum: f32 = sparse.weights[begin..].iter().map(|(_, weight)| weight).sum();
            sparse.weights[begin..].iter_mut().for_each(|(_, weight)| *weight /= sum);
        }
        sparse.starts.push(sparse.weights.len() as u32);
    }
    sparse
}
