//! The scene's nodes and the triangles that hang on them.

use super::accessor::Values;
use super::buffers::{Buffers, no_such};
use super::materials::{Materials, base_color};
use super::model::{Document, Index, Node, Primitive, TextureTransform};
use super::{Failure, Outcome, UNREADABLE, fail, size};
use crate::import::assembly::Assembly;
use crate::import::ply::Strip;
use crate::import::source::DAMAGED;
use crate::motion::rig::{Trs, unit_quaternion};
use crate::place::Affine;
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};

pub(super) const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// A mesh where a node puts it.
pub(super) struct Placed {
    pub mesh: Index,
    /// None where the document has no nodes at all.
    pub node: Option<Index>,
    pub skin: Option<Index>,
    pub site_from_mesh: Affine,
}

/// Vertices that were appended together: those of one primitive, `count` of them from `first` on.
pub(super) struct Span {
    /// Index into what was placed.
    pub placed: usize,
    /// Index into its mesh's primitives.
    pub primitive: usize,
    pub first: usize,
    pub count: usize,
}

/// The scene as it was modelled.
pub(super) fn build<'d>(document: &'d Document, buffers: &Buffers<'d>, assembly: &mut Assembly) -> Outcome<()> {
    let placed = place(document, assembly)?;
    append(document, buffers, &placed, assembly)?;
    if placed.iter().any(|placed| placed.skin.is_some()) {
        assembly.warn("has skins, which are not applied; its meshes stand as they were modelled");
    }
    Ok(())
}

/// Walks the nodes of the scene, parents before children.
pub(super) fn place(document: &Document, assembly: &mut Assembly) -> Outcome<Vec<Placed>> {
    let site_from_scene = assembly.site_from_file;
    let mut placed = Vec::new();
    let mut visited = vec![false; document.nodes.len()];
    let mut stack: Vec<(Index, Affine)> = roots(document)?.into_iter().rev().map(|node| (node, site_from_scene)).collect();
    while let Some((index, site_from_parent)) = stack.pop() {
        let item = || format!("nodes[{index}]");
        let node = document.nodes.get(index as usize).ok_or_else(|| no_such("nodes", index, document.nodes.len()))?;
        if std::mem::replace(&mut visited[index as usize], true) {
            return fail(&item(), "is reached twice, but a scene is a tree", "export the file again");
        }
        let site_from_node = site_from_parent.after(&parent_from_node(node));
        stack.extend(node.children.iter().rev().map(|&child| (child, site_from_node)));
        if let Some((name, _)) = UNREADABLE.iter().find(|(name, _)| node.extensions.contains_key(*name)) {
            assembly.warn(format_args!("{} uses {name}, which is not read here; one copy is read", item()));
        }
        placed.extend(node.mesh.map(|mesh| Placed {
            mesh,
            node: Some(index),
            skin: node.skin,
            site_from_mesh: site_from_node,
        }));
    }
    if document.nodes.is_empty() {
        // no scene at all: the meshes as they are
        let meshes = 0..document.meshes.len() as Index;
        placed.extend(meshes.map(|mesh| Placed { mesh, node: None, skin: None, site_from_mesh: site_from_scene }));
    }
    Ok(placed)
}

/// Appends what was placed to the mesh; answers where the vertices of each came to lie.
pub(super) fn append<'d>(
    document: &'d Document,
    buffers: &Buffers<'d>,
    placed: &[Placed],
    assembly: &mut Assembly,
) -> Outcome<Vec<Span>> {
    let site_from_scene = assembly.site_from_file;
    size::check(document, buffers, placed.iter().map(|placed| placed.mesh), assembly)?;
    let mut builder = Builder {
        document,
        buffers,
        assembly,
        materials: Materials::default(),
        left_out: 0,
        flat: 0,
        shared: Vec::new(),
        spans: Vec::new(),
    };
    for (k, placed) in placed.iter().enumerate() {
        builder.assembly.site_from_file = placed.site_from_mesh;
        builder.mesh(placed.mesh, k)?;
    }
    let Builder { materials, left_out, flat, spans, .. } = builder;
    assembly.site_from_file = site_from_scene;
    if left_out > 0 {
        assembly.warn(format_args!("{left_out} primitives of points or lines are left out"));
    }
    if flat > 0 {
        assembly.warn(format_args!("{flat} meshes are scaled to nothing by their nodes and are left out"));
    }
    materials.finish(document, buffers, assembly);
    Ok(spans)
}

/// The nodes of the scene that is to be shown; without scenes, those that are nobody's child.
pub(super) fn roots(document: &Document) -> Outcome<Vec<Index>> {
    let scene = document.scene.unwrap_or(0);
    match document.scenes.get(scene as usize) {
        Some(scene) => Ok(scene.nodes.clone()),
        None if document.scene.is_some() => Err(no_such("scenes", scene, document.scenes.len())),
        None => {
            let mut child = vec![false; document.nodes.len()];
            for &c in document.nodes.iter().flat_map(|n| &n.children) {
                if let Some(child) = child.get_mut(c as usize) {
                    *child = true;
                }
            }
            Ok((0..document.nodes.len() as Index).filter(|&i| !child[i as usize]).collect())
        }
    }
}

pub(super) fn parent_from_node(node: &Node) -> Affine {
    if let Some(m) = node.matrix {
        let column = |k: usize| DVec3::new(m[4 * k], m[4 * k + 1], m[4 * k + 2]);
        return Affine::new(DMat3::from_cols(column(0), column(1), column(2)), column(3));
    }
    trs(node).affine()
}

/// What a node without a matrix says.
pub(super) fn trs(node: &Node) -> Trs {
    Trs {
        translation: DVec3::from(node.translation.unwrap_or([0.0; 3])),
        rotation: unit_quaternion(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
        scale: DVec3::from(node.scale.unwrap_or([1.0; 3])),
    }
}

struct Builder<'b, 'a, 'd> {
    document: &'d Document,
    buffers: &'b Buffers<'d>,
    assembly: &'b mut Assembly<'a>,
    materials: Materials,
    left_out: u64,
    flat: u64,
    /// Vertex data of the node at hand that several primitives index into, and where its vertices begin in the mesh.
    shared: Vec<(Streams, u32)>,
    spans: Vec<Span>,
}

/// What makes two primitives' vertices the same.
#[derive(Clone, PartialEq)]
pub(super) struct Streams {
    position: Index,
    normal: Option<Index>,
    color: Option<Index>,
    uv: Option<Index>,
    transform: Option<TextureTransform>,
}

impl Streams {
    pub fn of(document: &Document, primitive: &Primitive, position: Index) -> Outcome<Self> {
        let materials = &document.materials;
        let material = |index: Index| materials.get(index as usize).ok_or_else(|| no_such("materials", index, materials.len()));
        let info = primitive.material.map(material).transpose()?.and_then(|material| base_color(material).1);
        let transform = info.as_ref().and_then(|info| info.extensions.transform);
        let set = info.map_or(0, |info| transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord));
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        Ok(Self {
            position,
            normal: attribute("NORMAL"),
            color: attribute("COLOR_0"),
            uv: attribute(&format!("TEXCOORD_{set}")),
            transform,
        })
    }
}

impl Builder<'_, '_, '_> {
    fn mesh(&mut self, index: Index, placed: usize) -> Outcome<()> {
        let meshes = &self.document.meshes;
        let mesh = meshes.get(index as usize).ok_or_else(|| no_such("meshes", index, meshes.len()))?;
        if self.assembly.site_from_file.is_flat() {
            self.flat += 1;
            return Ok(());
        }
        self.shared.clear();
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let first = self.assembly.mesh.positions.len();
            self.primitive(primitive, &format!("meshes[{index}].primitives[{k}]"))?;
            let count = self.assembly.mesh.positions.len() - first;
            if count > 0 {
                self.spans.push(Span { placed, primitive: k, first, count });
            }
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, item: &str) -> Outcome<()> {
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if !(TRIANGLES..=TRIANGLE_FAN).contains(&mode) {
            self.left_out += 1;
            return Ok(());
        }
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return fail(item, "has no POSITION", "export the file again");
        };
        let streams = Streams::of(self.document, primitive, position)?;
        let number = self.materials.number(primitive.material)?;
        let positions = Values::open(self.document, self.buffers, position, &[3])?;
        let known = self.shared.iter().find(|(known, _)| *known == streams).map(|(_, first)| *first);
        let first = match known {
            Some(first) => first,
            None => self.vertices(&positions, &streams, item)?,
        };
        if known.is_none() {
            self.shared.push((streams, first));
        }
        self.triangles(primitive, mode, first, positions.count, number, item)
    }

    fn open(
        &self,
        index: Option<Index>,
        widths: &[usize],
        count: usize,
        name: &str,
        item: &str,
    ) -> Outcome<Option<Values<'_>>> {
        let Some(index) = index else { return Ok(None) };
        let values = Values::open(self.document, self.buffers, index, widths)?;
        if values.count < count {
            let problem = format!("has {} of {name} for {count} positions", values.count);
            return fail(item, problem, "export the file again");
        }
        Ok(Some(values))
    }

    /// Appends the vertices; answers the index of the first.
    fn vertices(&mut self, positions: &Values, streams: &Streams, item: &str) -> Outcome<u32> {
        let count = positions.count;
        let normals = self.open(streams.normal, &[3], count, "NORMAL", item)?;
        let colors = self.open(streams.color, &[3, 4], count, "COLOR_0", item)?;
        let uvs = self.open(streams.uv, &[2], count, "texture coordinates", item)?;
        let before = self.assembly.mesh.positions.len();
        if !positions.is_backed() && count > 1 << 16 {
            let problem = format!("has {count} positions without data behind them");
            return fail(item, problem, DAMAGED);
        }
        let transform = streams.transform;
        let uvs: Option<Vec<Vec2>> = uvs.map(|uvs| (0..count).map(|i| transformed(uvs.get(i), transform)).collect());
        let colors: Option<Vec<Vec3>> = colors.map(|colors| (0..count).map(|i| three(colors.get(i)).as_vec3()).collect());
        let directions: Option<Vec<DVec3>> = normals.map(|normals| (0..count).map(|i| three(normals.get(i))).collect());
        let assembly = &mut *self.assembly;
        assembly.mesh.positions.reserve(count);
        for i in 0..count {
            assembly.push_position(three(positions.get(i)));
        }
        // Where only some primitives have an attribute, the others get what says nothing.
        let mesh = &mut assembly.mesh;
        if directions.is_some() || !mesh.normals.is_empty() {
            mesh.normals.resize(before, Vec3::ZERO);
        }
        if uvs.is_some() || !mesh.uvs.is_empty() {
            mesh.uvs.resize(before, Vec2::ZERO);
            mesh.uvs.extend(uvs.unwrap_or_default());
            mesh.uvs.resize(before + count, Vec2::ZERO);
        }
        if colors.is_some() || !mesh.colors_linear.is_empty() {
            mesh.colors_linear.resize(before, Vec3::ONE);
            colors.unwrap_or_default().into_iter().for_each(|color| assembly.push_color(color));
            assembly.mesh.colors_linear.resize(before + count, Vec3::ONE);
        }
        if directions.is_some() || !assembly.mesh.normals.is_empty() {
            directions.unwrap_or_default().into_iter().for_each(|n| assembly.push_normal(n));
            assembly.mesh.normals.resize(before + count, Vec3::ZERO);
        }
        Ok(before as u32)
    }

    fn triangles(
        &mut self,
        primitive: &Primitive,
        mode: u32,
        first: u32,
        vertices: usize,
        material: u16,
        item: &str,
    ) -> Outcome<()> {
        let indices = match primitive.indices {
            Some(index) => Some(Values::open(self.document, self.buffers, index, &[1])?),
            None => None,
        };
        if let Some(indices) = &indices
            && (!indices.is_unsigned() || !indices.is_backed() && indices.count > 0)
        {
            return fail(item, "its indices are no unsigned numbers", "export the file again");
        }
        let count = indices.as_ref().map_or(vertices, |indices| indices.count);
        self.assembly.mesh.triangles.reserve(triangle_count(mode, count));
        if mode == TRIANGLES && !count.is_multiple_of(3) {
            self.assembly.warn(format_args!("{item}: the last {} of its {count} indices form no triangle", count % 3));
        }
        let mut strip = Strip::default();
        let mut corners = [0; 3];
        for i in 0..count {
            let index = indices.as_ref().map_or(i as u32, |indices| indices.index(i));
            if index as usize >= vertices {
                let problem = format!("its index {i} names vertex {index}, but there are {vertices}");
                return Err(Failure::new(item, problem, DAMAGED));
            }
            let vertex = first + index;
            let triangle = match mode {
                TRIANGLES => {
                    corners[i % 3] = vertex;
                    (i % 3 == 2).then_some(corners)
                }
                TRIANGLE_STRIP => strip.next(vertex),
                _ => {
                    // a fan turns about its first vertex
                    corners = if i == 0 { [vertex; 3] } else { [corners[0], corners[2], vertex] };
                    (i >= 2).then_some(corners)
                }
            };
            if let Some(triangle) = triangle {
                self.assembly.push_triangle(triangle, Some(material));
            }
        }
        Ok(())
    }
}

/// How many triangles so many corners make.
pub(super) fn triangle_count(mode: u32, corners: usize) -> usize {
    if mode == TRIANGLES { corners / 3 } else { corners.saturating_sub(2) }
}

#[inline]
pub(super) fn three([x, y, z, _]: [f64; 4]) -> DVec3 {
    DVec3::new(x, y, z)
}

/// `KHR_texture_transform`: scaled, then turned counter-clockwise (v points down), then shifted.
fn transformed([u, v, ..]: [f64; 4], transform: Option<TextureTransform>) -> Vec2 {
    let Some(TextureTransform { offset, rotation, scale, .. }) = transform else { return Vec2::new(u as f32, v as f32) };
    let scaled = DVec2::new(u, v) * DVec2::from(scale.unwrap_or([1.0; 2]));
    let (sin, cos) = libm::sincos(rotation);
    let turned = DVec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
    (turned + DVec2::from(offset)).as_vec2()
}
