//! The document around the new vertices: nodes and skins that undo the grids, accessors by their new numbers.

use super::Quantised;
use super::attributes::Encoded;
use super::grid::Grid;
use super::views::{MESHOPT, Views};
use crate::import::Component;
use crate::import::raw::{RawArray, RawScene};
use glam::{DMat4, DQuat, DVec3};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, HashMap};

type Root = Map<String, Value>;

const QUANTIZATION: &str = "KHR_mesh_quantization";
/// Keys of extensions that hold numbers of a buffer: these would point elsewhere afterwards.
const POINTING: [&str; 8] = ["bufferView", "accessor", "attributes", "indices", "input", "output", "values", "propertyTables"];

fn list<'r>(root: &'r mut Root, key: &str) -> &'r mut [Value] {
    root.get_mut(key).and_then(Value::as_array_mut).map_or(&mut [], Vec::as_mut_slice)
}

fn index(value: &Value, key: &str) -> Option<usize> {
    value.get(key)?.as_u64().map(|index| index as usize)
}

/// Refuses extensions that hold numbers of a buffer which are not known here.
///
/// # Errors
/// The place and the problem.
pub(super) fn check_extensions(root: &Root) -> Result<(), (String, String)> {
    // these are written anew
    let kept = root.iter().filter(|(key, _)| !matches!(key.as_str(), "bufferViews" | "buffers" | "accessors"));
    kept.into_iter().try_for_each(|(key, value)| look(value, key, key == "extensions"))
}

fn look(value: &Value, place: &str, is_extensions: bool) -> Result<(), (String, String)> {
    match value {
        Value::Object(map) if is_extensions => {
            let bad = map.iter().find(|(_, extension)| points(extension));
            bad.map_or(Ok(()), |(name, _)| {
                Err((place.to_owned(), format!("has {name}, which holds data that cannot be written anew here")))
            })
        }
        Value::Object(map) => {
            let inner = map.iter().filter(|(key, _)| *key != "extras");
            inner.into_iter().try_for_each(|(key, value)| look(value, &format!("{place}.{key}"), key == "extensions"))
        }
        Value::Array(all) => all.iter().enumerate().try_for_each(|(k, value)| look(value, &format!("{place}[{k}]"), false)),
        _ => Ok(()),
    }
}

fn points(value: &Value) -> bool {
    match value {
        Value::Object(map) => map.iter().any(|(key, value)| POINTING.contains(&key.as_str()) || points(value)),
        Value::Array(all) => all.iter().any(points),
        _ => false,
    }
}

/// Which meshes stand on a skin's node without joints, at least in part: a grid could not be undone for all of them.
pub(super) fn unbound_meshes(scene: &RawScene) -> Vec<bool> {
    let bare = |mesh: &Vec<crate::import::raw::RawPrimitive>| {
        mesh.iter().any(|p| !p.attributes.contains_key("JOINTS_0") || !p.attributes.contains_key("WEIGHTS_0"))
    };
    let mut unbound = vec![false; scene.meshes.len()];
    let nodes = scene.root.get("nodes").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    for mesh in nodes.iter().filter(|node| node.get("skin").is_some()).filter_map(|node| index(node, "mesh")) {
        if let Some(mesh) = unbound.get_mut(mesh).filter(|_| bare(&scene.meshes[mesh])) {
            *mesh = true;
        }
    }
    unbound
}

/// What glTF may hold of images, by their first bytes.
pub(super) fn image_kind(bytes: &[u8]) -> Option<&'static str> {
    let is = |start: &[u8]| bytes.starts_with(start);
    match () {
        () if is(b"\x89PNG\r\n\x1a\n") => Some("image/png"),
        () if is(&[0xff, 0xd8, 0xff]) => Some("image/jpeg"),
        () if is(b"\xABKTX 20\xBB\r\n\x1A\n") => Some("image/ktx2"),
        () if is(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => Some("image/webp"),
        () => None,
    }
}

/// The file.
///
/// # Errors
/// In words, where it would be larger than the format allows.
pub(super) fn glb(scene: RawScene, meshes: &[Quantised], compress: bool) -> Result<Vec<u8>, String> {
    let mut views = Views::new(compress);
    let RawScene { mut root, arrays, images, .. } = scene;
    let number = write_meshes(&mut root, meshes, &mut views);
    write_animations(&mut root, &arrays, &mut views);
    write_nodes(&mut root, meshes, &number);
    write_skins(&mut root, meshes, &number, &arrays, &mut views);
    for (image, bytes) in list(&mut root, "images").iter_mut().zip(&images) {
        let Some(bytes) = bytes else { continue };
        let declared = image.get("mimeType").and_then(Value::as_str).map(str::to_owned);
        let Some(kind) = image_kind(bytes).map(str::to_owned).or(declared) else { continue };
        image["bufferView"] = json!(views.view(bytes));
        image["mimeType"] = json!(kind);
        if let Some(image) = image.as_object_mut() {
            image.remove("uri");
        }
    }
    let quantised = meshes.iter().flat_map(|mesh| &mesh.primitives).flatten().flat_map(|p| &p.streams).any(|s| s.is_extended());
    set_extensions(&mut root, quantised, views.is_packed());
    let buffers = views.buffers();
    root.insert("buffers".to_owned(), buffers);
    root.insert("bufferViews".to_owned(), std::mem::take(&mut views.views).into());
    root.insert("accessors".to_owned(), std::mem::take(&mut views.accessors).into());
    let mut asset = root.remove("asset").unwrap_or_else(|| json!({}));
    asset["version"] = json!("2.0");
    asset["generator"] = json!(super::GENERATOR);
    root.insert("asset".to_owned(), asset);
    container(&root.into(), &views.bytes)
}

fn container(json: &Value, bin: &[u8]) -> Result<Vec<u8>, String> {
    let mut json = serde_json::to_vec(json).map_err(|error| error.to_string())?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() + 8 + bin.len();
    let length = u32::try_from(total).map_err(|_| "becomes larger than the 4 GiB that a GLB file holds".to_owned())?;
    let mut file = Vec::with_capacity(total);
    file.extend_from_slice(b"glTF");
    [2, length, json.len() as u32].iter().for_each(|word| file.extend_from_slice(&word.to_le_bytes()));
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&json);
    file.extend_from_slice(&(bin.len() as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(bin);
    Ok(file)
}

/// Writes what is left of the meshes; answers the new number of each.
fn write_meshes(root: &mut Root, meshes: &[Quantised], views: &mut Views) -> Vec<Option<usize>> {
    let mut number = vec![None; meshes.len()];
    let mut left = Vec::new();
    for (m, (value, mesh)) in list(root, "meshes").iter_mut().zip(meshes).enumerate() {
        let primitives = value.get_mut("primitives").and_then(Value::as_array_mut).map(std::mem::take).unwrap_or_default();
        let primitives = primitives.into_iter().zip(&mesh.primitives);
        let primitives: Vec<Value> =
            primitives.filter_map(|(value, encoded)| Some(write_primitive(value, encoded.as_ref()?, views))).collect();
        if !primitives.is_empty() {
            value["primitives"] = primitives.into();
            number[m] = Some(left.len());
            left.push(value.take());
        }
    }
    root.insert("meshes".to_owned(), left.into());
    number
}

fn write_primitive(mut value: Value, encoded: &Encoded, views: &mut Views) -> Value {
    let mut attributes = Map::new();
    let mut targets: Vec<Map<String, Value>> = Vec::new();
    let corners = views.corners(encoded);
    for stream in &encoded.streams {
        let accessor = json!(views.stream(stream));
        let named = match stream.target {
            Some(target) => {
                targets.resize_with(targets.len().max(target + 1), Map::new);
                &mut targets[target]
            }
            None => &mut attributes,
        };
        named.insert(stream.name.clone(), accessor);
    }
    value["attributes"] = attributes.into();
    if let Some(value) = value.as_object_mut() {
        value.remove("indices");
        value.remove("mode");
        if !targets.is_empty() {
            value.insert("targets".to_owned(), targets.into_iter().map(Value::from).collect());
        }
    }
    if let Some(corners) = corners {
        value["indices"] = json!(corners);
    }
    if encoded.mode != super::attributes::TRIANGLES {
        value["mode"] = json!(encoded.mode);
    }
    value
}

/// Animations whose keyframes are there.
fn write_animations(root: &mut Root, arrays: &BTreeMap<u32, RawArray>, views: &mut Views) {
    let mut known: HashMap<(u32, bool), usize> = HashMap::new();
    let mut left = Vec::new();
    for animation in list(root, "animations") {
        let samplers = animation.get_mut("samplers").map(Value::take);
        let samplers = samplers.as_ref().and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let mut number: Vec<Option<usize>> = Vec::new();
        let mut written = Vec::new();
        for sampler in samplers {
            let mut write = |key: &str| {
                let old = sampler.get(key)?.as_u64()? as u32;
                let bounded = key == "input";
                let array = arrays.get(&old)?;
                Some(*known.entry((old, bounded)).or_insert_with(|| views.array(array, bounded)))
            };
            number.push(write("input").zip(write("output")).map(|(input, output)| {
                let mut sampler = sampler.clone();
                (sampler["input"], sampler["output"]) = (json!(input), json!(output));
                written.push(sampler);
                written.len() - 1
            }));
        }
        let channels = animation.get_mut("channels").map(Value::take);
        let mut channels = channels.and_then(|c| c.as_array().cloned()).unwrap_or_default();
        channels.retain_mut(|channel| {
            let new = index(channel, "sampler").and_then(|old| *number.get(old)?);
            if let Some(new) = new {
                channel["sampler"] = json!(new);
            }
            new.is_some()
        });
        if !channels.is_empty() {
            (animation["samplers"], animation["channels"]) = (written.into(), channels.into());
            left.push(animation.take());
        }
    }
    root.remove("animations");
    if !left.is_empty() {
        root.insert("animations".to_owned(), left.into());
    }
}

/// Hangs meshes on a grid below their nodes, in nodes of their own that undo it; morph weights and what moves them go along.
fn write_nodes(root: &mut Root, meshes: &[Quantised], number: &[Option<usize>]) {
    if root.get("nodes").and_then(Value::as_array).is_none_or(Vec::is_empty) {
        // no scene at all: the meshes as they are
        let nodes: Vec<Value> = (0..meshes.len()).map(|mesh| json!({ "mesh": mesh })).collect();
        let all: Vec<usize> = (0..nodes.len()).collect();
        root.insert("scenes".to_owned(), json!([{ "nodes": all }]));
        root.insert("scene".to_owned(), json!(0));
        root.insert("nodes".to_owned(), nodes.into());
    }
    let count = list(root, "nodes").len();
    let mut added = Vec::new();
    let mut moved: HashMap<u64, u64> = HashMap::new();
    for (k, node) in list(root, "nodes").iter_mut().enumerate() {
        let Some(mesh) = index(node, "mesh") else { continue };
        let Some(new) = number.get(mesh).copied().flatten() else {
            if let Some(node) = node.as_object_mut() {
                ["mesh", "skin", "weights"].iter().for_each(|key| drop(node.remove(*key)));
            }
            continue;
        };
        node["mesh"] = json!(new);
        let Some(grid) = meshes[mesh].grid.filter(|_| node.get("skin").is_none()) else { continue };
        let mut child =
            json!({ "mesh": new, "translation": grid.offset.to_array(), "scale": DVec3::splat(grid.side).to_array() });
        if let Some(node) = node.as_object_mut() {
            node.remove("mesh");
            if let Some(weights) = node.remove("weights") {
                child["weights"] = weights;
            }
        }
        let place = count + added.len();
        let children = node.get_mut("children").and_then(Value::as_array_mut);
        match children {
            Some(children) => children.push(json!(place)),
            None => node["children"] = json!([place]),
        }
        moved.insert(k as u64, place as u64);
        added.push(child);
    }
    if let Some(nodes) = root.get_mut("nodes").and_then(Value::as_array_mut) {
        nodes.extend(added);
    }
    let channels = list(root, "animations").iter_mut().filter_map(|animation| animation.get_mut("channels")?.as_array_mut());
    for target in channels.flatten().filter_map(|channel| channel.get_mut("target")) {
        let weights = target.get("path").and_then(Value::as_str) == Some("weights");
        let to = target.get("node").and_then(Value::as_u64).filter(|_| weights).and_then(|node| moved.get(&node));
        if let Some(&to) = to {
            target["node"] = json!(to);
        }
    }
}

/// Undoes grids in inverse bind matrices: a skin for each grid that hangs on it.
fn write_skins(
    root: &mut Root,
    meshes: &[Quantised],
    number: &[Option<usize>],
    arrays: &BTreeMap<u32, RawArray>,
    views: &mut Views,
) {
    let mut skins: Vec<Value> = list(root, "skins").to_vec();
    let originals = skins.clone();
    let old_mesh = |new: usize| number.iter().position(|&number| number == Some(new));
    let mut known: HashMap<(usize, Option<[u64; 4]>), usize> = HashMap::new();
    let mut written = vec![false; skins.len()];
    for node in list(root, "nodes") {
        let Some(skin) = index(node, "skin").filter(|&skin| skin < originals.len()) else { continue };
        let grid = index(node, "mesh").and_then(old_mesh).and_then(|mesh| meshes[mesh].grid);
        let key = (skin, grid.map(|grid| grid.key()));
        let place = *known.entry(key).or_insert_with(|| {
            let value = with_binds(&originals[skin], grid, arrays, views);
            if std::mem::replace(&mut written[skin], true) {
                skins.push(value);
                return skins.len() - 1;
            }
            skins[skin] = value;
            skin
        });
        node["skin"] = json!(place);
    }
    for skin in (0..originals.len()).filter(|&skin| !written[skin]) {
        skins[skin] = with_binds(&originals[skin], None, arrays, views);
    }
    if !skins.is_empty() {
        root.insert("skins".to_owned(), skins.into());
    }
}

fn with_binds(skin: &Value, grid: Option<Grid>, arrays: &BTreeMap<u32, RawArray>, views: &mut Views) -> Value {
    let mut skin = skin.clone();
    let own = index(&skin, "inverseBindMatrices").and_then(|accessor| arrays.get(&(accessor as u32)));
    let own = own.filter(|array| array.width == 16 && array.component == Component::F32);
    let joints = skin.get("joints").and_then(Value::as_array).map_or(0, Vec::len);
    let binds = match (own, grid) {
        (None, None) => {
            if let Some(skin) = skin.as_object_mut() {
                skin.remove("inverseBindMatrices");
            }
            return skin;
        }
        (Some(own), None) => own.clone(),
        (own, Some(grid)) => {
            let mesh_from_grid = DMat4::from_scale_rotation_translation(DVec3::splat(grid.side), DQuat::IDENTITY, grid.offset);
            let bind = |i: usize| {
                let bind = own.map_or(DMat4::IDENTITY, |own| DMat4::from_cols_array(&std::array::from_fn(|k| own.get(i, k))));
                (bind * mesh_from_grid).to_cols_array().map(|x| x as f32)
            };
            RawArray::floats(16, (0..own.map_or(joints, |own| own.count)).flat_map(bind))
        }
    };
    skin["inverseBindMatrices"] = json!(views.array(&binds, false));
    skin
}

/// Names what the file uses now.
fn set_extensions(root: &mut Root, quantised: bool, packed: bool) {
    let ours = [QUANTIZATION, MESHOPT, "KHR_meshopt_compression", "KHR_draco_mesh_compression"];
    for key in ["extensionsUsed", "extensionsRequired"] {
        let old = root.remove(key).and_then(|old| old.as_array().cloned()).unwrap_or_default();
        let mut names: Vec<Value> =
            old.into_iter().filter(|name| !name.as_str().is_some_and(|name| ours.contains(&name))).collect();
        names.extend(quantised.then(|| json!(QUANTIZATION)));
        names.extend(packed.then(|| json!(MESHOPT)));
        if !names.is_empty() {
            root.insert(key.to_owned(), names.into());
        }
    }
}
