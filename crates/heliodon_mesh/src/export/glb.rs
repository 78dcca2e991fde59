//! Binary glTF of a [`Scene`]: nodes, skins, morph targets, clips.
//!
//! Why not the bundle's writer: that one streams tens of gigabytes of what never moves; this one holds a few megabytes in memory.

use super::scene::{Channel, Clip, Interpolation, Node, Scene, SceneMesh, Skin, Track};
use super::{ExportError, write_file};
use glam::{Quat, Vec3};
use serde_json::{Map, Value, json};
use std::io::{self, Write};
use std::path::Path;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_BYTE: u32 = 5121;
pub(super) const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
/// Stone and bone: hardly a gloss.
pub(super) const ROUGHNESS: f32 = 0.9;

/// Writes the scene to a file.
///
/// # Errors
/// Where the file cannot be written, or the scene contradicts itself; an older file stays as it was.
pub fn write_glb(path: &Path, scene: &Scene) -> Result<(), ExportError> {
    write_file(path, |out| glb(out, scene))
}

/// Writes the scene to `out`, in a few large pieces.
///
/// # Errors
/// What `out` answers, or that the scene contradicts itself ([`Scene::validate`]) or exceeds 4 GiB.
pub fn glb(out: &mut dyn Write, scene: &Scene) -> io::Result<()> {
    let invalid = |fault: Box<dyn std::error::Error + Send + Sync>| io::Error::new(io::ErrorKind::InvalidInput, fault);
    scene.validate().map_err(|fault| invalid(fault.into()))?;
    let mut build = Build::default();
    let json = build.document(scene);
    build.write(out, &json)
}

fn too_large() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "a GLB file holds less than 4 GiB")
}

impl Build {
    /// Writes the file that the document and what was put into the buffer make.
    pub fn write(&self, out: &mut dyn Write, json: &Value) -> io::Result<()> {
        let mut json = serde_json::to_vec(json)?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.bytes.len();
        let total = u32::try_from(total).map_err(|_| too_large())?;
        out.write_all(b"glTF")?;
        for word in [2, total, json.len() as u32] {
            out.write_all(&word.to_le_bytes())?;
        }
        out.write_all(b"JSON")?;
        out.write_all(&json)?;
        out.write_all(&(self.bytes.len() as u32).to_le_bytes())?;
        out.write_all(b"BIN\0")?;
        out.write_all(&self.bytes)?;
        out.flush()
    }
}

/// The buffer and what describes it.
#[derive(Default)]
pub(super) struct Build {
    pub bytes: Vec<u8>,
    pub views: Vec<Value>,
    pub accessors: Vec<Value>,
    /// Times that were written, with their accessors: most channels of a clip share theirs.
    times: Vec<(Vec<f32>, usize)>,
}

impl Build {
    fn document(&mut self, scene: &Scene) -> Value {
        let mut root = Map::new();
        root.insert("asset".into(), json!({ "version": "2.0", "generator": "Heliodon" }));
        let mut carried = vec![false; scene.nodes.len()];
        scene.nodes.iter().flat_map(|node| &node.children).for_each(|&child| carried[child] = true);
        let tops: Vec<usize> = (0..scene.nodes.len()).filter(|&node| !carried[node]).collect();
        root.insert("scene".into(), json!(0));
        root.insert("scenes".into(), json!([{ "nodes": tops }]));
        // glTF knows no empty arrays
        let mut insert = |name: &str, values: Vec<Value>| {
            if !values.is_empty() {
                root.insert(name.into(), values.into());
            }
        };
        insert("nodes", scene.nodes.iter().map(node_json).collect());
        insert("materials", scene.meshes.iter().map(material_json).collect());
        insert("meshes", scene.meshes.iter().enumerate().map(|(index, mesh)| self.mesh(index, mesh)).collect());
        insert("skins", scene.skins.iter().map(|skin| self.skin(skin)).collect());
        insert("animations", scene.clips.iter().map(|clip| self.clip(clip)).collect());
        insert("accessors", std::mem::take(&mut self.accessors));
        insert("bufferViews", std::mem::take(&mut self.views));
        self.align();
        root.insert("buffers".into(), json!([{ "byteLength": self.bytes.len() }]));
        root.into()
    }

    pub fn align(&mut self) {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
    }

    pub fn view(&mut self, bytes: impl IntoIterator<Item = u8>, target: Option<u32>) -> usize {
        self.align();
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": self.bytes.len() - offset });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, view: usize, component: u32, kind: &str, count: usize) -> usize {
        self.accessors.push(json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }));
        self.accessors.len() - 1
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], target: Option<u32>) -> usize {
        let view = self.view(values.as_flattened().iter().flat_map(|x| x.to_le_bytes()), target);
        let kind = match N {
            1 => "SCALAR",
            2 => "VEC2",
            3 => "VEC3",
            4 => "VEC4",
            _ => "MAT4",
        };
        self.accessor(view, FLOAT, kind, values.len())
    }

    /// Floats with their bounds, which glTF wants of positions and times.
    fn bounded<const N: usize>(&mut self, values: &[[f32; N]], target: Option<u32>) -> usize {
        let accessor = self.floats(values, target);
        let bound = |start: f32, pick: fn(f32, f32) -> f32| {
            let bound = values.iter().fold([start; N], |bound, value| std::array::from_fn(|i| pick(bound[i], value[i])));
            // exact in f64, so that a validator that compares with the data finds them equal
            bound.map(f64::from).to_vec()
        };
        self.accessors[accessor]["min"] = json!(bound(f32::INFINITY, f32::min));
        self.accessors[accessor]["max"] = json!(bound(f32::NEG_INFINITY, f32::max));
        accessor
    }

    pub fn vectors(&mut self, values: &[Vec3]) -> usize {
        self.floats(&values.iter().map(Vec3::to_array).collect::<Vec<_>>(), Some(ARRAY_BUFFER))
    }

    pub fn positions(&mut self, values: &[Vec3]) -> usize {
        self.bounded(&values.iter().map(Vec3::to_array).collect::<Vec<_>>(), Some(ARRAY_BUFFER))
    }

    fn mesh(&mut self, index: usize, scene_mesh: &SceneMesh) -> Value {
        let mesh = &scene_mesh.mesh;
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), json!(self.positions(&mesh.positions)));
        if !mesh.normals.is_empty() {
            attributes.insert("NORMAL".into(), json!(self.vectors(&mesh.normals)));
        }
        if !mesh.uvs.is_empty() {
            let uvs: Vec<_> = mesh.uvs.iter().map(|uv| uv.to_array()).collect();
            attributes.insert("TEXCOORD_0".into(), json!(self.floats(&uvs, Some(ARRAY_BUFFER))));
        }
        if !mesh.colors_linear.is_empty() {
            attributes.insert("COLOR_0".into(), json!(self.vectors(&mesh.colors_linear)));
        }
        if !scene_mesh.joints.is_empty() {
            let view = self.view(scene_mesh.joints.iter().flatten().copied(), Some(ARRAY_BUFFER));
            let joints = self.accessor(view, UNSIGNED_BYTE, "VEC4", scene_mesh.joints.len());
            attributes.insert("JOINTS_0".into(), json!(joints));
            attributes.insert("WEIGHTS_0".into(), json!(self.floats(&scene_mesh.weights, Some(ARRAY_BUFFER))));
        }
        let indices = self.indices(&mesh.triangles, mesh.positions.len());
        let mut primitive = json!({ "attributes": attributes, "indices": indices, "material": index });
        let mut value = json!({ "name": scene_mesh.name });
        if !scene_mesh.targets.is_empty() {
            let targets = scene_mesh.targets.iter().map(|target| json!({ "POSITION": self.positions(&target.offsets) }));
            primitive["targets"] = targets.collect();
            value["weights"] = scene_mesh.targets.iter().map(|_| json!(0)).collect();
            value["extras"] = json!({ "targetNames": scene_mesh.targets.iter().map(|t| &t.name).collect::<Vec<_>>() });
        }
        value["primitives"] = json!([primitive]);
        value
    }

    pub fn indices(&mut self, triangles: &[[u32; 3]], vertices: usize) -> usize {
        let flat = triangles.as_flattened();
        // 65535 restarts a strip and names no vertex
        let (view, component) = if vertices <= 65_535 {
            (self.view(flat.iter().flat_map(|&i| (i as u16).to_le_bytes()), Some(ELEMENT_ARRAY_BUFFER)), UNSIGNED_SHORT)
        } else {
            (self.view(flat.iter().flat_map(|i| i.to_le_bytes()), Some(ELEMENT_ARRAY_BUFFER)), UNSIGNED_INT)
        };
        self.accessor(view, component, "SCALAR", flat.len())
    }

    fn skin(&mut self, skin: &Skin) -> Value {
        let matrices: Vec<[f32; 16]> = skin.inverse_bind.iter().map(|m| m.to_cols_array()).collect();
        json!({ "joints": skin.joints, "inverseBindMatrices": self.floats(&matrices, None) })
    }

    fn times(&mut self, times_s: &[f32]) -> usize {
        if let Some((_, known)) = self.times.iter().find(|(known, _)| known == times_s) {
            return *known;
        }
        let accessor = self.bounded(&times_s.iter().map(|&t| [t]).collect::<Vec<_>>(), None);
        self.times.push((times_s.to_vec(), accessor));
        accessor
    }

    fn clip(&mut self, clip: &Clip) -> Value {
        let mut samplers = Vec::new();
        let mut channels = Vec::new();
        for (sampler, channel) in clip.channels.iter().enumerate() {
            let (path, output) = self.track(channel);
            let interpolation = match channel.interpolation {
                Interpolation::Linear => "LINEAR",
                Interpolation::Step => "STEP",
                Interpolation::CubicSpline => "CUBICSPLINE",
            };
            let input = self.times(&channel.times_s);
            samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
            channels.push(json!({ "sampler": sampler, "target": { "node": channel.node, "path": path } }));
        }
        json!({ "name": clip.name, "samplers": samplers, "channels": channels })
    }

    fn track(&mut self, channel: &Channel) -> (&'static str, usize) {
        let vectors = |keys: &[Vec3]| keys.iter().map(Vec3::to_array).collect::<Vec<_>>();
        match &channel.track {
            Track::Translation(keys) => ("translation", self.floats(&vectors(keys), None)),
            Track::Scale(keys) => ("scale", self.floats(&vectors(keys), None)),
            Track::Rotation(keys) => {
                let keys: Vec<_> = keys.iter().map(|q: &Quat| q.to_array()).collect();
                ("rotation", self.floats(&keys, None))
            }
            Track::Weights(keys) => ("weights", self.floats(&keys.iter().map(|&w| [w]).collect::<Vec<_>>(), None)),
        }
    }
}

fn node_json(node: &Node) -> Value {
    let mut value = json!({ "name": node.name });
    let numbers = |numbers: &[f32]| numbers.iter().copied().map(f64::from).collect::<Vec<_>>();
    if node.translation != Vec3::ZERO {
        value["translation"] = json!(numbers(&node.translation.to_array()));
    }
    if node.rotation != Quat::IDENTITY {
        value["rotation"] = json!(numbers(&node.rotation.to_array()));
    }
    if node.scale != Vec3::ONE {
        value["scale"] = json!(numbers(&node.scale.to_array()));
    }
    if !node.children.is_empty() {
        value["children"] = json!(node.children);
    }
    for (name, index) in [("mesh", node.mesh), ("skin", node.skin)] {
        if let Some(index) = index {
            value[name] = json!(index);
        }
    }
    value
}

fn material_json(mesh: &SceneMesh) -> Value {
    let material = mesh.mesh.materials.first();
    let [r, g, b] = material.map_or(Vec3::ONE, |m| m.base_color_linear).to_array().map(f64::from);
    let name = material.map_or("", |m| m.name.as_str());
    json!({
        "name": if name.is_empty() { &mesh.name } else { name },
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0, "roughnessFactor": f64::from(ROUGHNESS) },
    })
}

#[cfg(test)]
mod tests {
    use super::super::scene::MorphTarget;
    use super::*;
    use crate::Mesh;

    fn flag() -> Scene {
        let mesh = Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let target = MorphTarget { name: "blown".into(), offsets: vec![Vec3::ZERO, Vec3::Z, Vec3::ZERO] };
        let mesh = SceneMesh { name: "flag".into(), mesh, targets: vec![target], ..SceneMesh::default() };
        let track = Track::Weights(vec![0.0, 1.0, 0.0]);
        let channel = Channel { node: 0, times_s: vec![0.0, 0.5, 1.0], track, interpolation: Interpolation::Linear };
        Scene {
            nodes: vec![Node { mesh: Some(0), ..Node::at("flag", Vec3::Y) }],
            meshes: vec![mesh],
            skins: Vec::new(),
            clips: vec![Clip { name: "wave".into(), channels: vec![channel] }],
        }
    }

    #[test]
    fn a_scene_with_targets_is_read_as_it_stands() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flag.glb");
        write_glb(&path, &flag()).unwrap();
        let mesh = crate::import::read(&path, &crate::import::ImportOptions::default()).unwrap();
        assert_eq!(mesh.positions, [Vec3::Y, Vec3::X + Vec3::Y, Vec3::Y * 2.0]);
    }

    fn spare_weight(scene: &mut Scene) {
        let target = scene.meshes[0].targets[0].clone();
        scene.meshes[0].targets.push(target);
        scene.clips[0].channels[0].track = Track::Weights(vec![0.5; 7]);
    }

    fn perspective(scene: &mut Scene) {
        let inverse_bind = vec![glam::Mat4::perspective_rh(1.0, 1.0, 0.1, 10.0)];
        scene.skins.push(Skin { joints: vec![0], inverse_bind });
    }

    #[test]
    fn a_spline_of_turns_has_tangents_of_any_length() {
        let mut scene = flag();
        let turn = Track::Rotation([Quat::IDENTITY * 0.0, Quat::IDENTITY, Quat::IDENTITY * 5.0].repeat(3));
        let channel = &mut scene.clips[0].channels[0];
        (channel.track, channel.interpolation) = (turn, Interpolation::CubicSpline);
        scene.validate().unwrap();
        scene.clips[0].channels[0].track = Track::Rotation([Quat::IDENTITY, Quat::IDENTITY * 5.0, Quat::IDENTITY].repeat(3));
        assert!(scene.validate().unwrap_err().to_string().contains("not unit"));
    }

    #[test]
    fn what_contradicts_itself_is_not_written() {
        let broken = |spoil: fn(&mut Scene)| {
            let mut scene = flag();
            spoil(&mut scene);
            let mut out = Vec::new();
            (glb(&mut out, &scene).unwrap_err().to_string(), out.len())
        };
        for (spoil, told) in [
            ((|s| s.nodes[0].children.push(0)) as fn(&mut Scene), "carries itself"),
            (|s| s.nodes[0].mesh = Some(1), "mesh that does not exist"),
            (|s| s.clips[0].channels[0].times_s[1] = 2.0, "do not rise"),
            (|s| s.clips[0].channels[0].interpolation = Interpolation::CubicSpline, "as many keys as times"),
            // two targets and a number too many for three times
            (spare_weight, "as many keys as times"),
            (|s| s.clips[0].channels[0].track = Track::Rotation(vec![Quat::IDENTITY * 2.0; 3]), "not unit"),
            (|s| s.clips[0].channels.clear(), "moves nothing"),
            (|s| s.nodes.clear(), "node 0: is missing"),
            (|s| s.meshes.clear(), "no mesh"),
            (perspective, "not affine"),
            (|s| s.nodes.push(Node { skin: Some(0), ..Node::at("bare", Vec3::ZERO) }), "skin that does not exist"),
            (|s| s.meshes[0].weights.push([1.0, 0.0, 0.0, 0.0]), "weight for each vertex"),
            (|s| s.meshes[0].targets[0].offsets.truncate(1), "target"),
            (|s| s.meshes[0].mesh.triangles[0][0] = 9, "vertex 9"),
        ] {
            let (text, written) = broken(spoil);
            assert!(text.contains(told) && written == 0, "{told}: {text}");
        }
    }
}
