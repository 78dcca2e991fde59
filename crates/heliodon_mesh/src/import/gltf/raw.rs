//! A document as it is, with the numbers behind it: what [`crate::convert`] writes anew. Nothing is placed, posed or mended here.

use super::accessor::{Component, Values};
use super::buffers::{Buffers, no_such};
use super::container;
use super::draco;
use super::model::{Document, Index, Motion, Primitive};
use super::scene::{TRIANGLES, parent_from_node};
use super::{Failure, Outcome, fail, open, parse, size, skins, whole};
use crate::import::ImportOptions;
use crate::import::error::ImportError;
use crate::import::source::{DAMAGED, Source};
use crate::place::Affine;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;

/// All widths that an accessor can have.
const WIDTHS: [usize; 5] = [1, 2, 3, 4, 16];
const TRIANGLE_STRIP: u32 = 5;

/// Elements one after the other, as the file has them.
#[derive(Clone, Debug)]
pub(crate) struct RawArray {
    pub component: Component,
    pub normalized: bool,
    pub width: usize,
    pub count: usize,
    /// Without gaps, little-endian.
    pub bytes: Vec<u8>,
}

impl RawArray {
    /// Floats, `width` to an element.
    pub fn floats(width: usize, values: impl IntoIterator<Item = f32>) -> Self {
        let bytes: Vec<u8> = values.into_iter().flat_map(f32::to_le_bytes).collect();
        Self { component: Component::F32, normalized: false, width, count: bytes.len() / (4 * width), bytes }
    }

    fn gather(values: &Values, rows: impl Iterator<Item = usize>) -> Self {
        let (component, normalized) = values.kind();
        let element = component.size() * values.width;
        let mut array = Self { component, normalized, width: values.width, count: 0, bytes: Vec::new() };
        for row in rows {
            array.bytes.extend_from_slice(values.raw(row));
            array.count += 1;
            array.bytes.resize(array.count * element, 0);
        }
        array
    }

    /// Component `k` of element `i`, as it is stored.
    #[inline]
    pub fn stored(&self, i: usize, k: usize) -> f64 {
        let size = self.component.size();
        self.component.read(&self.bytes[(i * self.width + k) * size..])
    }

    /// Component `k` of element `i`, as it is meant.
    #[inline]
    pub fn get(&self, i: usize, k: usize) -> f64 {
        let stored = self.stored(i, k);
        if self.normalized { (stored / self.component.full()).max(-1.0) } else { stored }
    }

    /// The first three components.
    #[inline]
    pub fn three(&self, i: usize) -> [f64; 3] {
        [self.get(i, 0), self.get(i, 1), self.get(i, 2)]
    }

    pub fn is_float(&self) -> bool {
        self.component == Component::F32
    }
}

/// Named arrays of a primitive, in the order of their names.
pub(crate) type RawAttributes = BTreeMap<String, RawArray>;

/// A primitive with vertices of its own, only those that it uses.
#[derive(Clone, Debug)]
pub(crate) struct RawPrimitive {
    /// Strips and fans are triangles here; points and lines keep the number of their mode.
    pub mode: u32,
    /// Corners in threes; of points and lines what the file has, which may be nothing.
    pub corners: Vec<u32>,
    pub attributes: RawAttributes,
    pub targets: Vec<RawAttributes>,
}

/// An image's bytes, if they are there.
pub(crate) type Picture = Option<Arc<Vec<u8>>>;

/// A document and what it names.
#[derive(Debug, Default)]
pub(crate) struct RawScene {
    pub root: Map<String, Value>,
    pub meshes: Vec<Vec<RawPrimitive>>,
    /// For each mesh how much longer its nodes or joints make lengths, at rest, at most.
    pub stretch: Vec<f64>,
    /// Accessors of skins and animations that can be read.
    pub arrays: BTreeMap<u32, RawArray>,
    /// The bytes of images that are there.
    pub images: Vec<Picture>,
    /// Bytes of all files that were read.
    pub bytes: u64,
    pub warnings: Vec<String>,
}

/// The document of a glTF file.
pub(crate) fn read(source: &mut Source, folder: Option<&Path>) -> Result<RawScene, ImportError> {
    let file = source.file();
    let length = source.length();
    let (json, bin) = container::open(whole(source)?, file)?;
    let (document, decompressed) = open(json, bin, (file, folder), ImportOptions::default().most_elements)?;
    let (motion, mut root): (Motion, Map<String, Value>) = (parse(json, file)?, parse(json, file)?);
    draco::forget(&mut root);
    let buffers = Buffers::new(&document, bin, folder).holding(decompressed.held);
    let mut reader = Reader { document: &document, motion: &motion, buffers: &buffers, elements: 0 };
    let mut scene = reader.scene(root).map_err(|failure| failure.of_file(file))?;
    scene.warnings.extend(decompressed.warnings);
    let beside = document.buffers.iter().filter_map(|buffer| buffer.uri.as_deref()).filter(|uri| !uri.starts_with("data:"));
    let beside = beside.filter_map(|uri| buffers.resolve(uri, "").ok()).map(|bytes| bytes.len() as u64);
    let pictures = document.images.iter().zip(&scene.images).filter(|(image, _)| image.buffer_view.is_none());
    let pictures = pictures.filter(|(image, _)| image.uri.as_ref().is_some_and(|uri| !uri.starts_with("data:")));
    scene.bytes =
        length + beside.sum::<u64>() + pictures.filter_map(|(_, bytes)| bytes.as_ref()).map(|b| b.len() as u64).sum::<u64>();
    Ok(scene)
}

struct Reader<'b, 'd> {
    document: &'d Document,
    motion: &'d Motion,
    buffers: &'b Buffers<'d>,
    /// Taken so far.
    elements: u64,
}

impl Reader<'_, '_> {
    fn scene(&mut self, root: Map<String, Value>) -> Outcome<RawScene> {
        let mut scene = RawScene { root, ..RawScene::default() };
        for (m, mesh) in self.document.meshes.iter().enumerate() {
            let mut primitives = Vec::with_capacity(mesh.primitives.len());
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let targets = self.motion.meshes.get(m).and_then(|mesh| mesh.primitives.get(p)).map(|p| &p.targets[..]);
                primitives.push(self.primitive(primitive, targets.unwrap_or(&[]), &format!("meshes[{m}].primitives[{p}]"))?);
            }
            scene.meshes.push(primitives);
        }
        scene.arrays = self.arrays(&mut scene.warnings)?;
        scene.images = self.images(&mut scene.warnings)?;
        scene.stretch = self.stretch()?;
        Ok(scene)
    }

    /// Counts what is taken, so that what is shared in a small file does not become more than there is memory.
    fn take(&mut self, elements: u64, item: &str) -> Outcome<()> {
        self.elements = self.elements.saturating_add(elements);
        let most = size::warranted(self.buffers).saturating_mul(4);
        if self.elements > most {
            let problem = format!("uses the same data again and again; at most {most} numbers of it are written out");
            return fail(item, problem, "have its instances written out one by one, or leave some out");
        }
        Ok(())
    }

    fn open(&self, index: Index) -> Outcome<Values<'_>> {
        Values::open(self.document, self.buffers, index, &WIDTHS)
    }

    fn primitive(&mut self, primitive: &Primitive, targets: &[BTreeMap<String, Index>], item: &str) -> Outcome<RawPrimitive> {
        primitive.check()?;
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return fail(item, "has no POSITION", "export the file again");
        };
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        let count = Values::open(self.document, self.buffers, position, &[3])?.count;
        let corners = self.corners(primitive, mode, count, item)?;
        let (corners, used) = compacted(corners, count);
        let mut gather = |index: Index, name: &str| {
            let values = Values::open(self.document, self.buffers, index, &WIDTHS)?;
            if values.count < count {
                let problem = format!("has {} of {name} for {count} positions", values.count);
                return fail(item, problem, "export the file again");
            }
            let rows = used.as_ref().map_or(count, Vec::len);
            self.take((rows * values.width) as u64, item)?;
            let values = Values::open(self.document, self.buffers, index, &WIDTHS)?;
            Ok(match &used {
                Some(used) => RawArray::gather(&values, used.iter().map(|&row| row as usize)),
                None => RawArray::gather(&values, 0..count),
            })
        };
        let mut all = |named: &BTreeMap<String, Index>| -> Outcome<RawAttributes> {
            named.iter().map(|(name, &index)| Ok((name.clone(), gather(index, name)?))).collect()
        };
        let attributes = all(&primitive.attributes)?;
        let targets = targets.iter().map(&mut all).collect::<Outcome<_>>()?;
        let mode = if (TRIANGLES..=TRIANGLES + 2).contains(&mode) { TRIANGLES } else { mode };
        Ok(RawPrimitive { mode, corners, attributes, targets })
    }

    /// Corners of triangles; of points and lines the indices, if they have any.
    fn corners(&mut self, primitive: &Primitive, mode: u32, vertices: usize, item: &str) -> Outcome<Vec<u32>> {
        let indices = primitive.indices.map(|index| Values::open(self.document, self.buffers, index, &[1])).transpose()?;
        let is_surface = mode >= TRIANGLES;
        let Some(indices) = indices else {
            self.take(vertices as u64, item)?;
            return Ok(if is_surface { triangles(mode, (0..vertices as u32).collect()) } else { Vec::new() });
        };
        if !indices.is_unsigned() || !indices.is_backed() && indices.count > 0 {
            return fail(item, "its indices are no unsigned numbers", "export the file again");
        }
        let count = indices.count;
        self.take(count as u64, item)?;
        let indices = primitive.indices.map(|index| self.open(index)).transpose()?;
        let list: Vec<u32> = indices.iter().flat_map(|indices| (0..count).map(|i| indices.index(i))).collect();
        if let Some(i) = list.iter().position(|&index| index as usize >= vertices) {
            let problem = format!("its index {i} names vertex {}, but there are {vertices}", list[i]);
            return Err(Failure::new(item, problem, DAMAGED));
        }
        Ok(if is_surface { triangles(mode, list) } else { list })
    }

    /// What skins and animations name.
    fn arrays(&mut self, warnings: &mut Vec<String>) -> Outcome<BTreeMap<u32, RawArray>> {
        let keyframes = self.motion.animations.iter().flat_map(|animation| &animation.samplers);
        let keyframes = keyframes.flat_map(|sampler| [sampler.input, sampler.output]);
        let binds = self.motion.skins.iter().filter_map(|skin| skin.inverse_bind_matrices);
        let named: BTreeSet<Index> = keyframes.chain(binds).collect();
        let mut arrays = BTreeMap::new();
        for index in named {
            let item = format!("accessors[{index}]");
            match self.open(index).map(|values| (values.count, values.width)) {
                Ok((count, width)) => {
                    self.take((count * width) as u64, &item)?;
                    let values = self.open(index)?;
                    arrays.insert(index, RawArray::gather(&values, 0..count));
                }
                Err(failure) => warnings.push(format!("{failure}; what uses it is left out")),
            }
        }
        Ok(arrays)
    }

    fn images(&mut self, warnings: &mut Vec<String>) -> Outcome<Vec<Picture>> {
        let mut known: HashMap<(Option<Index>, Option<&str>), Picture> = HashMap::new();
        let mut images = Vec::new();
        for (k, image) in self.document.images.iter().enumerate() {
            let item = format!("images[{k}]");
            let key = (image.buffer_view, image.uri.as_deref());
            if let Some(image) = known.get(&key) {
                images.push(image.clone());
                continue;
            }
            let bytes = match key {
                (Some(view), _) => self.buffers.view(view).map(|(bytes, _)| bytes.to_vec()),
                (None, Some(uri)) => self.buffers.resolve(uri, &item),
                (None, None) => fail(&item, "has neither a uri nor a buffer view", "export the file again"),
            };
            let bytes = match bytes {
                Ok(bytes) => {
                    self.take(bytes.len() as u64 / 4, &item)?;
                    Some(Arc::new(bytes))
                }
                Err(failure) => {
                    warnings.push(format!("{failure}; it stays named, and is not put into the file"));
                    None
                }
            };
            known.insert(key, bytes.clone());
            images.push(bytes);
        }
        Ok(images)
    }

    fn stretch(&self) -> Outcome<Vec<f64>> {
        let globals = self.globals();
        let mut stretch = vec![0.0_f64; self.document.meshes.len()];
        for (node, global) in self.document.nodes.iter().zip(&globals) {
            let Some(longest) = node.mesh.and_then(|mesh| stretch.get_mut(mesh as usize)) else { continue };
            let Some(skin) = node.skin else {
                *longest = longest.max(norm(global));
                continue;
            };
            let (joints, binds) = skins::read(self.document, self.motion, self.buffers, skin)?;
            for (joint, bind) in joints.iter().zip(&binds) {
                let global = globals.get(*joint as usize).ok_or_else(|| no_such("nodes", *joint, globals.len()))?;
                *longest = longest.max(norm(&global.after(bind)));
            }
        }
        // meshes that no node shows, and documents without nodes
        Ok(stretch.into_iter().map(|longest| if longest > 0.0 && longest.is_finite() { longest } else { 1.0 }).collect())
    }

    /// Every node in the scene's space; those that hang on themselves stand as if alone.
    fn globals(&self) -> Vec<Affine> {
        let nodes = &self.document.nodes;
        let mut is_child = vec![false; nodes.len()];
        nodes.iter().flat_map(|node| &node.children).for_each(|&child| {
            if let Some(is_child) = is_child.get_mut(child as usize) {
                *is_child = true;
            }
        });
        let mut globals = vec![Affine::IDENTITY; nodes.len()];
        let mut seen = vec![false; nodes.len()];
        let mut stack: Vec<(usize, Affine)> =
            (0..nodes.len()).filter(|&k| !is_child[k]).map(|k| (k, Affine::IDENTITY)).collect();
        while let Some((k, parent)) = stack.pop() {
            let Some(node) = nodes.get(k).filter(|_| !std::mem::replace(&mut seen[k], true)) else { continue };
            globals[k] = parent.after(&parent_from_node(node));
            stack.extend(
                node.children.iter().map(|&child| (child as usize, globals[k])).filter(|(child, _)| *child < nodes.len()),
            );
        }
        globals
    }
}

/// A bound of how much longer lengths become: the largest sum of a row of what the linear part makes with its transpose, rooted.
fn norm(affine: &Affine) -> f64 {
    let linear = affine.linear();
    let square = linear.transpose() * linear;
    let rows = square.transpose().to_cols_array_2d();
    rows.iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max).sqrt()
}

/// Lists as they are, strips and fans cut into triangles.
fn triangles(mode: u32, list: Vec<u32>) -> Vec<u32> {
    if mode == TRIANGLES {
        let whole = list.len() / 3 * 3;
        let mut list = list;
        list.truncate(whole);
        return list;
    }
    let corner = |i: usize| match mode {
        TRIANGLE_STRIP if i.is_multiple_of(2) => [list[i], list[i + 1], list[i + 2]],
        TRIANGLE_STRIP => [list[i + 1], list[i], list[i + 2]],
        _ => [list[0], list[i + 1], list[i + 2]],
    };
    (0..list.len().saturating_sub(2)).flat_map(corner).collect()
}

/// Corners counted among the vertices that they use, and these; all of them without corners.
fn compacted(corners: Vec<u32>, vertices: usize) -> (Vec<u32>, Option<Vec<u32>>) {
    if corners.is_empty() {
        return (corners, None);
    }
    let mut used = corners.clone();
    used.sort_unstable();
    used.dedup();
    if used.len() == vertices {
        return (corners, None);
    }
    let corners = corners.iter().map(|corner| used.binary_search(corner).map_or(0, |place| place as u32)).collect();
    (corners, Some(used))
}
