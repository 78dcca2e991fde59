//! Primitives compressed by `KHR_draco_mesh_compression`, decoded by draco-core.
//!
//! They are decoded before anything is built. What they hold becomes accessors of its own, for what the file's accessors say of it is often wrong:
//! exporters write other counts and types there, and share one among primitives that are compressed apart.

use super::accessor::Component;
use super::buffers::{Buffers, LARGEST_EXPANSION, no_such};
use super::model::{Accessor, Document, Draco, Index, KINDS, Primitive};
use super::scene::TRIANGLES;
use super::{Failure, Outcome, fail};
use draco_core::metadata::GeometryMetadata;
use draco_core::version::VERSION_FLAGS_INTRODUCED;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, DracoError, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::Path;

const NAME: &str = "KHR_draco_mesh_compression";
const REMEDY: &str = "export it again, or decompress it first (for example: gltf-transform copy in.glb out.glb)";

/// Vertices, and triangles, that a file of any size may hold, and bytes of them.
const FREE: Budget = Budget { elements: 1 << 20, bytes: 1 << 26 };
/// And for each byte of the buffers with streams in them: a scan has less than one, and a triangle takes a bit at least, unless it is one of many alike.
const FOR_A_BYTE: Budget = Budget { elements: 8, bytes: LARGEST_EXPANSION };
/// Attributes with seams of their own in a stream. For each, the decoder makes a table over all corners before it asks for any limit.
const MOST_WITH_SEAMS: u8 = 16;

/// What a document's compressed primitives hold.
#[derive(Default)]
pub(super) struct Decompressed {
    /// Elements side by side, by the numbers of the accessors that were added for them.
    pub held: BTreeMap<Index, Vec<u8>>,
    /// Of what could not be decoded and is there without compression as well, or is left out.
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
    let Decoder { streams, warnings, .. } = decoder;
    drop(buffers);
    let mut decompressed = Decompressed { warnings, ..Decompressed::default() };
    let numbers: Vec<Numbers> = streams.into_iter().map(|stream| decompressed.add(stream, document)).collect();
    let is_required = document.extensions_required.iter().any(|name| name == NAME);
    for (m, p, result) in results {
        let has_view = |index: &Index| document.accessors.get(*index as usize).is_some_and(|a| a.buffer_view.is_some());
        let primitive = &mut document.meshes[m].primitives[p];
        match result {
            Ok(stream) => {
                let numbers = &numbers[stream];
                primitive.attributes.retain(|name, _| !numbers.left_out.contains(name));
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
    /// What the stream holds, and which of it is of which name.
    held: Vec<Held>,
    named: Vec<(String, usize)>,
    /// Names of what glTF does not know, and nobody here reads.
    left_out: Vec<String>,
    indices: Held,
}

/// Of a stream's accessors.
struct Numbers {
    attributes: BTreeMap<String, Index>,
    left_out: Vec<String>,
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
        let held: Vec<Index> = stream.held.into_iter().map(&mut number).collect();
        Numbers {
            attributes: stream.named.into_iter().map(|(name, index)| (name, held[index])).collect(),
            left_out: stream.left_out,
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
    /// Vertices, and triangles, that the caller allows.
    most: u64,
    spent: Budget,
    known: BTreeMap<Key, usize>,
    /// Of views that could not be decoded.
    failures: BTreeMap<Index, Failure>,
    streams: Vec<Stream>,
    warnings: Vec<String>,
}

impl<'b, 'd> Decoder<'b, 'd> {
    fn new(document: &'d Document, buffers: &'b Buffers<'d>, most: u32) -> Self {
        Self {
            document,
            buffers,
            most: most.into(),
            spent: Budget { elements: 0, bytes: 0 },
            known: BTreeMap::new(),
            failures: BTreeMap::new(),
            streams: Vec::new(),
            warnings: Vec::new(),
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
        let corners = mesh.faces().as_flattened();
        let bytes = corners.iter().flat_map(|corner| corner.0.to_le_bytes()).collect();
        let indices = (accessor(Component::U32, 1, corners.len(), false), bytes);
        let mut stream = Stream { held: Vec::new(), named: Vec::new(), left_out: Vec::new(), indices };
        // several names may be of one attribute
        let mut held: BTreeMap<(u32, bool), usize> = BTreeMap::new();
        for (name, &index) in &primitive.attributes {
            let accessors = &self.document.accessors;
            let told = accessors.get(index as usize).ok_or_else(|| no_such("accessors", index, accessors.len()))?;
            let Some(&id) = draco.attributes.get(name) else {
                if name == "POSITION" && told.buffer_view.is_none() {
                    return fail(item, "its Draco data has no POSITION", REMEDY);
                }
                continue;
            };
            let found = match mesh.attribute_by_unique_id(id) {
                Some(attribute) => {
                    let normalized = is_normalized(attribute, told);
                    held.get(&(id, normalized)).copied().map_or_else(
                        || {
                            stream.held.push(values(attribute, mesh.num_points(), normalized)?);
                            held.insert((id, normalized), stream.held.len() - 1);
                            Ok(stream.held.len() - 1)
                        },
                        Ok,
                    )
                }
                None => Err(format!("is not there, as its attribute {id}")),
            };
            match found {
                Ok(found) => stream.named.push((name.clone(), found)),
                Err(problem) if is_known(name) => {
                    return fail(item, format!("{name} of its Draco data {problem}"), REMEDY);
                }
                Err(problem) => {
                    self.warnings.push(format!("{item}: {name} of its Draco data {problem}; it is left out"));
                    stream.left_out.push(name.clone());
                }
            }
        }
        self.streams.push(stream);
        self.known.insert(key, self.streams.len() - 1);
        Ok(self.streams.len() - 1)
    }

    fn decode(&mut self, view: Index, item: &str) -> Outcome<Mesh> {
        if let Some(failure) = self.failures.get(&view) {
            return Err(Failure { item: item.to_owned(), ..failure.clone() });
        }
        let mesh = self.decode_anew(view, item);
        if let Err(failure) = &mesh {
            self.failures.insert(view, failure.clone());
        }
        mesh
    }

    fn decode_anew(&mut self, view: Index, item: &str) -> Outcome<Mesh> {
        let (stream, _) = self.buffers.view(view)?;
        let opened = self.buffers.bytes_opened();
        let left = |free: u64, for_a_byte: u64, spent: u64| (free + opened.saturating_mul(for_a_byte)).saturating_sub(spent);
        let elements = left(FREE.elements, FOR_A_BYTE.elements, self.spent.elements);
        let elements = elements.min(self.most.saturating_sub(self.spent.elements));
        let bytes = left(FREE.bytes, FOR_A_BYTE.bytes, self.spent.bytes);
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
        let broken = |error: DracoError| match error.kind() {
            ErrorKind::LimitExceeded => too_many(),
            _ => Failure::new(item, format!("its Draco data cannot be decoded: {error}"), REMEDY),
        };
        // a stream that breaks has been worked at too
        self.spent.elements = self.spent.elements.saturating_add(stream.len() as u64);
        if attributes_with_seams(stream).map_err(broken)? > MOST_WITH_SEAMS {
            return fail(
                item,
                format!("its Draco data has more than {MOST_WITH_SEAMS} attributes with seams of their own"),
                REMEDY,
            );
        }
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut DecoderBuffer::new(stream).with_limits(limits), &mut mesh).map_err(broken)?;
        let made = (mesh.num_points() as u64).max(mesh.num_faces() as u64);
        let attributes = (0..mesh.num_attributes()).map(|number| mesh.attribute(number));
        let a_point: u64 = attributes.map(|attribute| width(attribute).1).map(|size| size as u64).sum();
        let held = (mesh.num_points() as u64).saturating_mul(a_point).saturating_add(mesh.num_faces() as u64 * 12);
        self.spent.elements = self.spent.elements.saturating_add(made) - stream.len() as u64;
        self.spent.bytes = self.spent.bytes.saturating_add(held);
        // the decoder's limits know no points but those of clouds
        if made > elements { Err(too_many()) } else { Ok(mesh) }
    }
}

/// How many attributes of a stream have seams of their own, by its header.
fn attributes_with_seams(stream: &[u8]) -> Result<u8, DracoError> {
    const MAGIC_BYTES: usize = 5;
    const EDGEBREAKER: u8 = 1;
    const METADATA: u16 = 0x8000;
    let mut header = DecoderBuffer::new(stream);
    header.try_advance(MAGIC_BYTES)?;
    let version = (header.decode_u8()?, header.decode_u8()?);
    header.set_version(version.0, version.1);
    let (_geometry, method, flags) = (header.decode_u8()?, header.decode_u8()?, header.decode_u16()?);
    if method != EDGEBREAKER {
        return Ok(0);
    }
    if version >= VERSION_FLAGS_INTRODUCED && flags & METADATA != 0 {
        GeometryMetadata::decode(&mut header)?;
    }
    let _traversal = header.decode_u8()?;
    // vertices and triangles, and before version 2.2 the vertices that splits add
    for _ in 0..if version < (2, 2) { 3 } else { 2 } {
        if version < (2, 0) {
            header.decode_u32()?;
        } else {
            header.decode_varint()?;
        }
    }
    header.decode_u8()
}

/// Whether an attribute is one that glTF gives a meaning.
fn is_known(name: &str) -> bool {
    let sets = ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"];
    matches!(name, "POSITION" | "NORMAL" | "TANGENT") || sets.iter().any(|set| name.starts_with(set))
}

/// Whether numbers of a stream stand for parts of one: as the accessor says of whole numbers, or as the stream does where the accessor takes them for
/// fractions.
fn is_normalized(attribute: &PointAttribute, told: &Accessor) -> bool {
    match attribute.data_type() {
        DataType::Float32 | DataType::Uint32 => false,
        _ if told.component_type == Component::F32.code() => attribute.normalized(),
        _ => told.normalized,
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
    let stride = usize::try_from(attribute.byte_stride()).ok().filter(|stride| *stride >= element).ok_or("ends early")?;
    let all = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * element);
    for point in 0..points as u32 {
        let first = attribute.mapped_index(PointIndex(point)).0 as usize * stride;
        let of_point = all.get(first..).and_then(|rest| rest.get(..element));
        bytes.extend_from_slice(of_point.ok_or("ends early")?);
    }
    Ok((accessor(component, width, points, normalized), bytes))
}
