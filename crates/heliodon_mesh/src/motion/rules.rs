//! How a moving mesh is posed, as plain numbers, for whoever poses it elsewhere: on a GPU, above all.
//!
//! What stays is [`PoseRules`], once for a mesh; what changes from moment to moment is a [`Palette`], small beside the vertices. Together they say what
//! [`MovingMesh::pose`] does, but in `f32` throughout: each vertex about the middle of what it moves with, so that survey coordinates keep their digits.
//!
//! A vertex whose part does not move is where the rest mesh has it. Another one's position is that of its rule, plus each delta times its weight, taken by the sum of
//! its matrices, each times its share; its normal goes likewise, by the inverse transpose, and is made unit. Where a part renews, the normal is the unit sum of the normals
//! of the triangles around the vertex, and around those it shares it with, times their angles there. What gets no direction, or lies farther off than
//! [`PoseRules::FARTHEST_M`], keeps its rest. With a cache the palette has the positions themselves.

use super::part::Drive;
use super::rig::{JointMatrix, Rig, Scratch};
use super::{Motion, MovingMesh};
use crate::import::FARTHEST_M;
use crate::place::Affine;
use glam::{DVec3, Vec3};
use std::ops::Range;

/// What stays of a moving mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseRules {
    /// One for each vertex of the rest mesh.
    pub vertices: Vec<VertexRule>,
    /// Matrices, and their shares above 0; those of a vertex add to 1.
    pub influences: Vec<(u32, f32)>,
    /// What morph targets add.
    pub deltas: Vec<Delta>,
    /// For each part whether its normals are computed from the pose.
    pub renews: Vec<bool>,
    /// Vertices that share a renewed normal, group after group; none is in two.
    pub shared: Vec<Vec<u32>>,
    /// How many matrices a palette has.
    pub matrices: usize,
    /// How many weights.
    pub weights: usize,
    /// Whether a palette has the positions.
    pub cached: bool,
}

/// How a vertex moves.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexRule {
    /// Its part; none where nothing ever moves it.
    pub part: Option<u32>,
    /// Where it is before its matrices, unless cached.
    pub position: Vec3,
    /// Its normal before its matrices, unit.
    pub normal: Vec3,
    /// Its part of [`PoseRules::influences`].
    pub influences: Range<u32>,
    /// Its part of [`PoseRules::deltas`].
    pub deltas: Range<u32>,
}

/// What one morph target adds to one vertex at weight 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delta {
    /// Which weight.
    pub weight: u32,
    /// To the position.
    pub position: Vec3,
    /// To the normal.
    pub normal: Vec3,
}

/// A moment of a clip; reuse it, and nothing is allocated after the first.
#[derive(Clone, Debug, Default)]
pub struct Palette {
    /// Columns of `site_from_part`, about the part's middle: x, y, z with 0, offset with 1.
    pub matrices: Vec<[[f32; 4]; 4]>,
    /// Morph weights.
    pub weights: Vec<f32>,
    /// For each part whether the clip moves it.
    pub moves: Vec<bool>,
    /// Where the vertices are, in metres, with a cache; else empty.
    pub positions: Vec<Vec3>,
    scratch: Scratch,
}

impl PoseRules {
    /// Positions farther than this from the origin along an axis, in metres, are not used.
    pub const FARTHEST_M: f32 = FARTHEST_M as f32;

    /// Whether all that vertices name is there.
    ///
    /// # Errors
    /// What is not.
    pub fn validate(&self) -> Result<(), &'static str> {
        let within = |range: &Range<u32>, len: usize| range.start <= range.end && range.end as usize <= len;
        if !self.vertices.iter().all(|v| within(&v.influences, self.influences.len()) && within(&v.deltas, self.deltas.len())) {
            return Err("a vertex names influences or deltas that are not there");
        }
        if !self.vertices.iter().all(|v| v.part.is_none_or(|part| (part as usize) < self.renews.len())) {
            return Err("a vertex names a part that is not there");
        }
        let weighted = self.deltas.iter().all(|delta| (delta.weight as usize) < self.weights);
        if !weighted || !self.influences.iter().all(|(matrix, _)| (*matrix as usize) < self.matrices) {
            return Err("a matrix or a weight is named that is not there");
        }
        let mut met = vec![false; self.vertices.len()];
        let twice = |&v: &u32| met.get_mut(v as usize).is_none_or(|met| std::mem::replace(met, true));
        if self.shared.iter().flatten().any(twice) {
            return Err("a vertex shares its normal with two groups");
        }
        Ok(())
    }
}

impl MovingMesh {
    /// How its vertices are posed.
    #[must_use]
    pub fn rules(&self) -> PoseRules {
        let rest = |part: Option<u32>| {
            let own = |(&position, &normal)| VertexRule { part, position, normal, influences: 0..0, deltas: 0..0 };
            self.rest.positions.iter().zip(&self.rest.normals).map(own).collect()
        };
        match &self.motion {
            Motion::Still => PoseRules { vertices: rest(None), ..PoseRules::default() },
            Motion::Cache(cache) => PoseRules {
                vertices: rest(Some(0)),
                renews: vec![true],
                shared: cache.renewal().groups().map(<[u32]>::to_vec).collect(),
                cached: true,
                ..PoseRules::default()
            },
            Motion::Rig(rig) => rules_of(rig, rest(None)),
        }
    }

    /// Fills a palette with what [`PoseRules`] need to pose the mesh as [`Self::pose`] does.
    pub fn palette(&self, clip: usize, time_s: f32, palette: &mut Palette) {
        let time_s = self.clamped(clip, time_s);
        let Palette { matrices, weights, moves, positions, scratch } = palette;
        match &self.motion {
            Motion::Still => *moves = Vec::new(),
            Motion::Cache(cache) => {
                *moves = vec![clip == 0];
                if clip == 0 { cache.place(time_s, positions) } else { positions.clone_from(&self.rest.positions) }
            }
            Motion::Rig(rig) => {
                let of = rig.clips.get(clip);
                match of {
                    Some(clip) => moves.clone_from(&clip.moves),
                    None => *moves = vec![false; rig.parts.len()],
                }
                rig.sample(of, time_s, scratch);
                weights.clear();
                weights.extend(scratch.weights().iter().map(|&weight| weight as f32));
                matrices.clear();
                for skin in 0..rig.skins.len() {
                    rig.joint_matrices(skin, scratch);
                    matrices.extend(scratch.joints.iter().map(columns));
                }
                for part in &rig.parts {
                    let site_from_part = match part.drive {
                        Drive::Scene => rig.site_from_scene,
                        Drive::Node(node) => scratch.global(node),
                        Drive::Skin(..) => continue,
                    };
                    matrices.push(columns(&JointMatrix::of(&site_from_part, centre(&part.base))));
                }
            }
        }
    }
}

fn columns(matrix: &JointMatrix) -> [[f32; 4]; 4] {
    let [x, y, z, offset] = matrix.columns;
    [x.extend(0.0), y.extend(0.0), z.extend(0.0), offset.extend(1.0)].map(|column| column.to_array())
}

/// The middle of a part's vertices.
fn centre(base: &[Vec3]) -> DVec3 {
    let (low, high) = base.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    if low.cmple(high).all() { (low.as_dvec3() + high.as_dvec3()) * 0.5 } else { DVec3::ZERO }
}

fn rules_of(rig: &Rig, mut vertices: Vec<VertexRule>) -> PoseRules {
    let mut rules = PoseRules {
        renews: rig.parts.iter().map(super::part::Part::renews).collect(),
        weights: rig.weights.len(),
        ..PoseRules::default()
    };
    // Skins' matrices come first, then one for each part that has none.
    let mut first_of_skin = Vec::new();
    for skin in &rig.skins {
        first_of_skin.push(rules.matrices as u32);
        rules.matrices += skin.joints.len();
    }
    for (k, part) in (0..).zip(&rig.parts) {
        // What a target does to each vertex, in the order of the targets.
        let mut deltas: Vec<Vec<Delta>> = vec![Vec::new(); part.len()];
        for (target, morph) in part.morph.iter().flat_map(|morph| (morph.first_weight..).zip(&morph.targets)) {
            let nothing = Delta { weight: target as u32, position: Vec3::ZERO, normal: Vec3::ZERO };
            let of = |list: &mut Vec<Delta>| match list.last() {
                Some(last) if last.weight == nothing.weight => list.len() - 1,
                _ => {
                    list.push(nothing);
                    list.len() - 1
                }
            };
            for &(i, delta) in &morph.positions {
                let list = &mut deltas[i as usize];
                let at = of(list);
                list[at].position += delta;
            }
            for &(i, delta) in &morph.normals {
                let list = &mut deltas[i as usize];
                let at = of(list);
                list[at].normal += delta;
            }
        }
        let own = rules.matrices as u32;
        let middle = match part.drive {
            Drive::Skin(..) => DVec3::ZERO,
            _ => {
                rules.matrices += 1;
                centre(&part.base)
            }
        };
        for (i, deltas) in deltas.into_iter().enumerate() {
            let (influence, delta) = (rules.influences.len() as u32, rules.deltas.len() as u32);
            match &part.drive {
                Drive::Skin(skin, influences) => {
                    let first = first_of_skin[*skin];
                    rules.influences.extend(influences.of(i).iter().map(|&(joint, w)| (first + u32::from(joint), w)));
                }
                _ => rules.influences.push((own, 1.0)),
            }
            rules.deltas.extend(deltas);
            vertices[part.vertex(i)] = VertexRule {
                part: Some(k),
                position: (part.base[i].as_dvec3() - middle).as_vec3(),
                normal: part.normals[i],
                influences: influence..rules.influences.len() as u32,
                deltas: delta..rules.deltas.len() as u32,
            };
        }
    }
    rules.shared = rig.renewal.iter().flat_map(|renewal| renewal.groups().map(<[u32]>::to_vec)).collect();
    PoseRules { vertices, ..rules }
}

impl JointMatrix {
    /// From relative to a centre.
    pub fn of(site_from_mesh: &Affine, centre: DVec3) -> Self {
        let linear = site_from_mesh.linear();
        let columns = [linear.x_axis, linear.y_axis, linear.z_axis, site_from_mesh.position(centre)];
        Self { columns: columns.map(|column| column.as_vec3().into()) }
    }
}
