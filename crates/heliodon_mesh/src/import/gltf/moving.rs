//! The scene with what moves it: nodes, skins and morph targets, bound to the vertices that the still import appends.

use super::accessor::Values;
use super::buffers::{Buffers, no_such};
use super::keyframes::{self, Driven};
use super::model::{Document, Index, Motion};
use super::scene::{self, Placed, Span, parent_from_node, three, trs};
use super::skins::{self, Tally};
use super::{Outcome, fail, size};
use crate::import::NormalSource;
use crate::import::assembly::Assembly;
use crate::motion::part::{Deltas, Drive, Morph, Part};
use crate::motion::rig::{Rig, RigNode, Skin};
use crate::place::Affine;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Appends the scene to the assembly as the still import does, skinned meshes by their first joint so that their triangles face
/// outward; answers what moves the vertices.
pub(super) fn build<'d>(
    document: &'d Document,
    motion: &Motion,
    buffers: &Buffers<'d>,
    assembly: &mut Assembly,
) -> Outcome<Rig> {
    let mut placed = scene::place(document, assembly)?;
    let mut nodes = Nodes::new(document)?;
    let mut skins: Vec<Skin> = Vec::new();
    let mut skin_of: HashMap<Index, usize> = HashMap::new();
    for placed in &placed {
        if let Some(node) = placed.node {
            nodes.need(node)?;
        }
        if let Some(index) = placed.skin
            && !skin_of.contains_key(&index)
        {
            let (joints, binds) = skins::read(document, motion, buffers, index)?;
            let joints = joints.into_iter().map(|joint| nodes.need(joint)).collect::<Outcome<_>>()?;
            skin_of.insert(index, skins.len());
            skins.push(Skin { joints, binds, centre: DVec3::ZERO });
        }
    }
    let mut driven = Driven { nodes: nodes.rig_of_node, weights: HashMap::new() };
    let weights = morph_weights(motion, &placed, buffers, &mut driven)?;
    let clips = keyframes::read(document, motion, buffers, assembly, &driven);
    let mut rig = Rig {
        site_from_scene: assembly.site_from_file,
        nodes: nodes.nodes,
        skins,
        weights,
        parts: Vec::new(),
        clips,
        renewal: None,
    };
    let moved: Vec<Vec<bool>> = rig.clips.iter().map(|clip| rig.moved_nodes(clip)).collect();
    for placed in &mut placed {
        if let Some(&skin) = placed.skin.as_ref().and_then(|index| skin_of.get(index)) {
            let Skin { joints, binds, .. } = &rig.skins[skin];
            let first = joints.first().zip(binds.first());
            let site_from_mesh = first.map(|(&joint, bind)| rig.node_at(joint, None, 0.0).after(bind));
            placed.site_from_mesh = site_from_mesh.filter(|m| !m.is_flat()).unwrap_or(rig.site_from_scene);
        } else if let Some(node) = placed.node.and_then(|node| driven.node(node))
            && placed.site_from_mesh.is_flat()
            && moved.iter().any(|moved| moved[node])
        {
            // scaled to nothing, but not for ever
            placed.site_from_mesh = rig.site_from_scene;
        }
    }
    let spans = scene::append(document, buffers, &placed, assembly)?;
    let mut reader =
        Reader { document, motion, buffers, driven: &driven, skin_of: &skin_of, tally: Tally::default(), deltas: 0 };
    for span in &spans {
        let part = reader.part(&rig, &placed[span.placed], span, assembly)?;
        rig.parts.push(part);
    }
    reader.tally.tell(assembly);
    // each clip notes for each part whether it moves it
    let most = size::warranted(buffers) / (rig.parts.len() + rig.nodes.len()).max(1) as u64;
    let clips = rig.clips.len();
    if clips as u64 > most {
        rig.clips.truncate(most as usize);
        assembly.warn(format_args!("has {clips} animations, of which {most} are read"));
    }
    Ok(rig)
}

/// The nodes that something needs, parents before children.
struct Nodes<'d> {
    document: &'d Document,
    parent: Vec<Option<Index>>,
    /// Whether two nodes call it their child.
    twice: Vec<bool>,
    rig_of_node: Vec<Option<usize>>,
    nodes: Vec<RigNode>,
}

impl<'d> Nodes<'d> {
    fn new(document: &'d Document) -> Outcome<Self> {
        let count = document.nodes.len();
        let (mut parent, mut twice) = (vec![None; count], vec![false; count]);
        for (k, node) in document.nodes.iter().enumerate() {
            for &child in &node.children {
                if let Some(parent) = parent.get_mut(child as usize) {
                    twice[child as usize] |= parent.is_some();
                    *parent = Some(k as Index);
                }
            }
        }
        // where the still import begins, nothing hangs on anything
        for root in scene::roots(document)? {
            if let Some(parent) = parent.get_mut(root as usize) {
                *parent = None;
                twice[root as usize] = false;
            }
        }
        Ok(Self { document, parent, twice, rig_of_node: vec![None; count], nodes: Vec::new() })
    }

    /// The rig's number for a node.
    fn need(&mut self, index: Index) -> Outcome<usize> {
        let count = self.document.nodes.len();
        let mut chain = Vec::new();
        let mut next = Some(index);
        let mut above = None;
        while let Some(at) = next {
            let Some(known) = self.rig_of_node.get(at as usize) else { return Err(no_such("nodes", at, count)) };
            if known.is_some() {
                above = *known;
                break;
            }
            if self.twice[at as usize] {
                return fail(&format!("nodes[{at}]"), "is the child of two nodes", "export the file again");
            }
            if chain.len() >= count {
                return fail(&format!("nodes[{index}]"), "hangs on itself", "export the file again");
            }
            chain.push(at);
            next = self.parent[at as usize];
        }
        for &at in chain.iter().rev() {
            let node = &self.document.nodes[at as usize];
            let matrix = node.matrix.map(|_| parent_from_node(node));
            self.nodes.push(RigNode { parent: above, trs: trs(node), matrix });
            above = Some(self.nodes.len() - 1);
            self.rig_of_node[at as usize] = above;
        }
        above.ok_or_else(|| no_such("nodes", index, count))
    }
}

/// Default weights of all nodes with morph targets; notes where each node's begin.
fn morph_weights(motion: &Motion, placed: &[Placed], buffers: &Buffers, driven: &mut Driven) -> Outcome<Vec<f64>> {
    let mut weights = Vec::new();
    for Placed { mesh, node, .. } in placed {
        let Some(morphs) = motion.meshes.get(*mesh as usize) else { continue };
        let targets = morphs.primitives.iter().map(|primitive| primitive.targets.len()).max().unwrap_or(0);
        if targets == 0 {
            continue;
        }
        if (weights.len() + targets) as u64 > size::warranted(buffers) {
            return fail("scene", "has more morph targets than its data warrants", "leave some of its instances out");
        }
        let own = node.and_then(|node| motion.nodes.get(node as usize)).map(|node| &node.weights).filter(|w| !w.is_empty());
        let said = own.unwrap_or(&morphs.weights);
        driven.weights.insert((*mesh, *node), (weights.len(), targets));
        weights.extend((0..targets).map(|k| said.get(k).copied().unwrap_or(0.0)));
    }
    Ok(weights)
}

/// A target takes as much memory as so many of its deltas, even without any.
const DELTAS_A_TARGET: u64 = 4;

struct Reader<'b, 'd> {
    document: &'d Document,
    motion: &'b Motion,
    buffers: &'b Buffers<'d>,
    driven: &'b Driven,
    skin_of: &'b HashMap<Index, usize>,
    tally: Tally,
    /// Morph deltas looked at so far.
    deltas: u64,
}

impl Reader<'_, '_> {
    fn part(&mut self, rig: &Rig, placed: &Placed, span: &Span, assembly: &Assembly) -> Outcome<Part> {
        let Placed { mesh, node, skin, site_from_mesh } = *placed;
        let item = format!("meshes[{mesh}].primitives[{}]", span.primitive);
        let primitive = &self.document.meshes[mesh as usize].primitives[span.primitive];
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return fail(&item, "has no POSITION", "export the file again");
        };
        let positions = Values::open(self.document, self.buffers, position, &[3])?;
        let base = (0..span.count).map(|i| three(positions.get(i)).as_vec3());
        // those that are not finite have no triangles any more
        let base = base.map(|p| if p.is_finite() { p } else { Vec3::ZERO }).collect();
        let skin = skin.and_then(|index| self.skin_of.get(&index).copied());
        let on_node = node.and_then(|node| self.driven.node(node)).map_or(Drive::Scene, Drive::Node);
        let mut settles = skin.is_some();
        let drive = match skin {
            Some(skin) => {
                let joints = rig.skins[skin].joints.len();
                let influences =
                    skins::influences(self.document, self.buffers, primitive, span.count, joints, &item, &mut self.tally)?;
                influences.map_or(on_node, |influences| Drive::Skin(skin, influences))
            }
            None => on_node,
        };
        if let Drive::Node(node) = drive {
            settles |= is_other(&rig.node_at(node, None, 0.0), &site_from_mesh);
        }
        let morph = self.morph(mesh, node, span, &item, assembly)?;
        if let Some(morph) = &morph {
            let weights = &rig.weights[morph.first_weight..morph.first_weight + morph.targets.len()];
            settles |= weights.iter().any(|w| *w != 0.0);
        }
        Ok(Part {
            drive,
            first: span.first,
            extra: Vec::new(),
            base,
            normals: Vec::new(),
            morph,
            modelled: site_from_mesh,
            settles,
        })
    }

    fn morph(
        &mut self,
        mesh: Index,
        node: Option<Index>,
        span: &Span,
        item: &str,
        assembly: &Assembly,
    ) -> Outcome<Option<Morph>> {
        let primitive = self.motion.meshes.get(mesh as usize).and_then(|mesh| mesh.primitives.get(span.primitive));
        let Some(targets) = primitive.map(|primitive| &primitive.targets).filter(|targets| !targets.is_empty()) else {
            return Ok(None);
        };
        let Some(&(first_weight, _)) = self.driven.weights.get(&(mesh, node)) else { return Ok(None) };
        let attributes = &self.document.meshes[mesh as usize].primitives[span.primitive].attributes;
        let own_normals = attributes.contains_key("NORMAL") && assembly.options.normals != NormalSource::Computed;
        self.deltas += targets.len() as u64 * DELTAS_A_TARGET;
        self.check_deltas(item)?;
        let mut morph = Morph { first_weight, targets: Vec::with_capacity(targets.len()), renews: false };
        for target in targets {
            let mut deltas = |name: &str| match target.get(name) {
                Some(&index) => self.deltas(index, span.count, name, item),
                None => Ok(Vec::new()),
            };
            let positions = deltas("POSITION")?;
            let normals = if own_normals { deltas("NORMAL")? } else { Vec::new() };
            let says_normals = own_normals && target.contains_key("NORMAL");
            morph.renews |= !positions.is_empty() && !says_normals;
            morph.targets.push(Deltas { positions, normals });
        }
        Ok(Some(morph))
    }

    fn deltas(&mut self, index: Index, count: usize, name: &str, item: &str) -> Outcome<Vec<(u32, Vec3)>> {
        let values = Values::open(self.document, self.buffers, index, &[3])?;
        if values.count < count {
            let problem = format!("has {} morph deltas of {name} for {count} positions", values.count);
            return fail(item, problem, "export the file again");
        }
        self.deltas += values.count as u64;
        self.check_deltas(item)?;
        let deltas = (0..count).map(|i| (i as u32, three(values.get(i)).as_vec3()));
        Ok(deltas.filter(|(_, delta)| *delta != Vec3::ZERO && delta.is_finite()).collect())
    }

    fn check_deltas(&self, item: &str) -> Outcome<()> {
        let most = size::warranted(self.buffers);
        if self.deltas > most {
            let problem = format!("has morph targets that use the same data again and again; at most {most} deltas are read");
            return fail(item, problem, "leave morph targets or instances out");
        }
        Ok(())
    }
}

/// Whether two placings differ by more than the rounding of `f64`.
fn is_other(a: &Affine, b: &Affine) -> bool {
    let tolerance = 1.0e-9 * (1.0 + b.offset().abs().max_element() + b.linear().x_axis.abs().max_element());
    let linear = a.linear() - b.linear();
    let farthest = linear.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
    // true for NaN
    !(farthest <= tolerance && (a.offset() - b.offset()).abs().max_element() <= tolerance)
}
