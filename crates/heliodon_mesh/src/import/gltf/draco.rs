//! Primitives compressed by `KHR_draco_mesh_compression`, decoded by draco-core.
//!
//! They are decoded before anything is built. What they hold becomes accessors of its own, for what the file's accessors say of it is often wrong:
//! exporters write other counts and types there, and share one among primitives that are compressed apart.

use super::accessor::Component;
use super::buffers::{Buffers, LARGEST_EXPANSION, no_such};
use super::model::{Accessor, Document, Draco, Index, KINDS, Primitive};
use super::scene::TRIANGLES;
use super::{Failure, Outcome, fail};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex};
use serde_json::{Map, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const NAME: &str = "KHR_draco_mesh_compression";
const REMEDY: &str = "export it again, or decompress it first (for example: gltf-transform copy in.glb out.glb)";

/// Vertices, and triangles, that a file of any size may hold, and bytes of them.
const FREE: Budget = Budget { elements: 1 << 18, bytes: 1 << 25 };
/// And for each compressed byte: a scan has less than one, a plane of equal squares some more.
const ELEMENTS_A_BYTE: u64 = 32;

/// What a document's compressed primitives hold.
#[derive(Default)]
pub(super) struct Decompressed {
    /// Elements side by side, by the numbers of the accessors that were added for them.
    pub held: BTreeMap<Index, Vec<u8>>,
    /// Of what could not be decoded, and is there without compression as well.
    pub warnings: Vec<String>,
}

/// Decodes all compressed primitives of triangles, and gives them accessors for what they hold. One that cannot be decoded is marked with why, which
/// is told if it is used. More than `most` vertices or triangles are not decoded, nor more than the compressed bytes warrant.
pub(super) fn decompress(document: &mut Document, bin: Option<&[u8]>, folder: Option<&Path>, most: u32) -> Decompressed {
    let is_compressed = |mesh: &super::model::Mesh| mesh.primitives.iter().any(|p| p.extensions.draco.is_some());
    if !document.meshes.iter().any(is_compressed) {
        return Decompressed::default();
    }
    let buffers = Buffers::new(document, bin, folder);
    let mut decoder = Decoder::new(document, &buffers, most);
    let mut results = Vec::new();
    for (m, mesh) in document.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(draco) = &primitive.extensions.draco {
                let result = decoder.primitive(primitive, draco, &format!("meshes[{m}].primitives[{p}]"));
                results.push((m, p, result));
            }
        }
    }
    let streams = decoder.streams;
    drop(buffers);
    let mut decompressed = Decompressed::default();
    let numbers: Vec<Numbers> = streams.into_iter().map(|stream| decompressed.add(stream, document)).collect();
    let is_required = document.extensions_required.iter().any(|name| name == NAME);
    for (m, p, result) in results {
        let has_view = |index: &Index| document.accessors.get(*index as usize).is_some_and(|a| a.buffer_view.is_some());
        let primitive = &mut document.meshes[m].primitives[p];
        match result {
            Ok(stream) => {
                let numbers = &numbers[stream];
                primitive.attributes.extend(numbers.attributes.clone());
                primitive.indices = Some(numbers.indices);
            }
            Err(failure) if !is_required && primitive.attributes.values().chain(&primitive.indices).all(has_view) => {
                decompressed.warnings.push(format!("{failure}; what the file has beside it without compression is read"));
            }
            Err(failure) => primitive.failure = Some(failure),
        }
    }
    decompressed
}

/// Takes the compression out of a document whose primitives are decoded.
pub(super) fn forget(root: &mut Map<String, Value>) {
    let meshes = root.get_mut("meshes").and_then(Value::as_array_mut).into_iter().flatten();
    let primitives = meshes.filter_map(|mesh| mesh.get_mut("primitives")?.as_array_mut()).flatten();
    for primitive in primitives.filter_map(Value::as_object_mut) {
        let extensions = primitive.get_mut("extensions").and_then(Value::as_object_mut);
        if extensions.is_some_and(|extensions| extensions.remove(NAME).is_some() && extensions.is_empty()) {
            primitive.remove("extensions");
        }
    }
}

/// An accessor and its elements.
type Held = (Accessor, Vec<u8>);

struct Stream {
    attributes: Vec<(String, Held)>,
    indices: Held,
}

/// Of a stream's accessors.
struct Numbers {
    attributes: BTreeMap<String, Index>,
    indices: Index,
}

impl Decompressed {
    fn add(&mut self, stream: Stream, document: &mut Document) -> Numbers {
        let mut number = |(accessor, bytes): Held| {
            let number = document.accessors.len() as Index;
            document.accessors.push(accessor);
            self.held.insert(number, bytes);
            number
        };
        Numbers {
            attributes: stream.attributes.into_iter().map(|(name, held)| (name, number(held))).collect(),
            indices: number(stream.indices),
        }
    }
}

#[derive(Clone, Copy)]
struct Budget {
    /// Vertices, and triangles.
    elements: u64,
    bytes: u64,
}

/// What makes two primitives' streams the same: the view, the attributes' numbers in it, and the accessors, which say what is normalised.
type Key = (Index, BTreeMap<String, u32>, BTreeMap<String, Index>);

struct Decoder<'b, 'd> {
    document: &'d Document,
    buffers: &'b Buffers<'d>,
    /// Elements that may still be decoded, by what the caller allows.
    most: u64,
    /// And what may be, by what the views that were met warrant.
    warranted: Budget,
    met: BTreeSet<Index>,
    known: BTreeMap<Key, usize>,
    streams: Vec<Stream>,
}

impl<'b, 'd> Decoder<'b, 'd> {
    fn new(document: &'d Document, buffers: &'b Buffers<'d>, most: u32) -> Self {
        Self {
            document,
            buffers,
            most: most.into(),
            warranted: FREE,
            met: BTreeSet::new(),
            known: BTreeMap::new(),
            streams: Vec::new(),
        }
    }

    /// The number of its stream.
    fn primitive(&mut self, primitive: &Primitive, draco: &Draco, item: &str) -> Outcome<usize> {
        if primitive.mode.unwrap_or(TRIANGLES) != TRIANGLES {
            return fail(item, "is compressed by Draco, but not made of plain triangles", REMEDY);
        }
        let key = (draco.buffer_view, draco.attributes.clone(), primitive.attributes.clone());
        if let Some(&known) = self.known.get(&key) {
            return Ok(known);
        }
        let mesh = self.decode(draco.buffer_view, item)?;
        let mut attributes = Vec::new();
        for (name, &index) in &primitive.attributes {
            let told = self.accessor(index)?;
            let Some(id) = draco.attributes.get(name) else {
                if name == "POSITION" && told.buffer_view.is_none() {
                    return fail(item, "its Draco data has no POSITION", REMEDY);
                }
                continue;
            };
            let Some(attribute) = mesh.attribute_by_unique_id(*id) else {
                return fail(item, format!("its Draco data has no attribute {id} for {name}"), REMEDY);
            };
            let held = values(attribute, mesh.num_points(), told.normalized);
            let held = held.map_err(|problem| Failure::new(item, format!("{name} of its Draco data {problem}"), REMEDY))?;
            attributes.push((name.clone(), held));
        }
        let corners = mesh.faces().as_flattened();
        let bytes = corners.iter().flat_map(|corner| corner.0.to_le_bytes()).collect();
        let indices = (accessor(Component::U32, 1, corners.len(), false), bytes);
        self.streams.push(Stream { attributes, indices });
        self.known.insert(key, self.streams.len() - 1);
        Ok(self.streams.len() - 1)
    }

    fn accessor(&self, index: Index) -> Outcome<&'d Accessor> {
        let accessors = &self.document.accessors;
        accessors.get(index as usize).ok_or_else(|| no_such("accessors", index, accessors.len()))
    }

    fn decode(&mut self, view: Index, item: &str) -> Outcome<Mesh> {
        let (stream, _) = self.buffers.view(view)?;
        if self.met.insert(view) {
            self.warranted.elements += ELEMENTS_A_BYTE * stream.len() as u64;
            self.warranted.bytes += LARGEST_EXPANSION * stream.len() as u64;
        }
        let Budget { elements, bytes } = self.warranted;
        let elements = elements.min(self.most);
        let limits = DecodeLimits::default().with_max_faces(elements).with_max_decoded_bytes(bytes);
        let too_many = || {
            let problem = format!(
                "its Draco data makes more than the {elements} vertices or triangles, or the {bytes} bytes, that may still be decoded"
            );
            Failure::new(
                item,
                problem,
                "split the file, or decompress it first (for example: gltf-transform copy in.glb out.glb)",
            )
        };
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut DecoderBuffer::new(stream).with_limits(limits), &mut mesh).map_err(|error| {
            if error.kind() == ErrorKind::LimitExceeded {
                return too_many();
            }
            Failure::new(item, format!("its Draco data cannot be decoded: {error}"), REMEDY)
        })?;
        // the limits know no points but those of clouds
        let (points, faces) = (mesh.num_points() as u64, mesh.num_faces() as u64);
        if points.max(faces) > elements {
            return Err(too_many());
        }
        let attributes = (0..mesh.num_attributes()).map(|number| mesh.attribute(number));
        let a_point: u64 = attributes.map(|attribute| width(attribute).1).map(|size| size as u64).sum();
        let held = points.saturating_mul(a_point).saturating_add(faces * 12);
        self.most -= points.max(faces);
        self.warranted.elements -= points.max(faces);
        self.warranted.bytes = self.warranted.bytes.saturating_sub(held);
        Ok(mesh)
    }
}

/// An accessor of elements that lie side by side; at most four components are asked for.
fn accessor(component: Component, width: usize, count: usize, normalized: bool) -> Accessor {
    let kind = KINDS.iter().find(|(_, components)| *components == width).map_or("", |(kind, _)| kind);
    Accessor {
        buffer_view: None,
        byte_offset: 0,
        component_type: component.code(),
        normalized,
        count: count as u64,
        kind: kind.to_owned(),
        sparse: None,
    }
}

/// Components of an element, and its bytes.
fn width(attribute: &PointAttribute) -> (usize, usize) {
    let components = usize::from(attribute.num_components());
    (components, components * attribute.data_type().byte_length())
}

/// A decoded attribute, or what of it glTF does not know.
fn values(attribute: &PointAttribute, points: usize, normalized: bool) -> Result<Held, String> {
    let (width, element) = width(attribute);
    let component = match attribute.data_type() {
        DataType::Int8 => Some(Component::I8),
        DataType::Uint8 => Some(Component::U8),
        DataType::Int16 => Some(Component::I16),
        DataType::Uint16 => Some(Component::U16),
        DataType::Uint32 => Some(Component::U32),
        DataType::Float32 => Some(Component::F32),
        _ => None,
    };
    let Some(component) = component.filter(|_| (1..=4).contains(&width)) else {
        return Err(format!("has {width} components of {:?}", attribute.data_type()));
    };
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
    let all = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * element);
    for point in 0..points as u32 {
        let first = attribute.mapped_index(PointIndex(point)).0 as usize * stride;
        let of_point = all.get(first..).and_then(|rest| rest.get(..element));
        bytes.extend_from_slice(of_point.ok_or("ends early")?);
    }
    Ok((accessor(component, width, points, normalized), bytes))
}
