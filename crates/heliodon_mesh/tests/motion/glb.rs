//! Small animated files, written here.

use serde_json::{Value, json};

pub const F32: u32 = 5126;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;

/// The data of a binary glTF file in the making.
#[derive(Default)]
pub struct Glb {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Glb {
    pub fn raw(&mut self, kind: &str, component: u32, normalized: bool, count: usize, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()}));
        self.bin.extend(bytes);
        self.accessors.push(json!({"bufferView": self.views.len() - 1, "componentType": component, "normalized": normalized, "count": count, "type": kind}));
        self.accessors.len() - 1
    }

    pub fn floats<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = rows.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        self.raw(kind, F32, false, rows.len(), &bytes)
    }

    pub fn scalars(&mut self, values: &[f32]) -> usize {
        self.floats("SCALAR", &values.iter().map(|v| [*v]).collect::<Vec<_>>())
    }

    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.raw("SCALAR", 5123, false, values.len(), &bytes)
    }

    /// The file: what was gathered, and the rest of the document.
    pub fn finish(self, mut document: Value) -> Vec<u8> {
        document["asset"] = json!({"version": "2.0"});
        document["buffers"] = json!([{"byteLength": self.bin.len()}]);
        document["bufferViews"] = self.views.into();
        document["accessors"] = self.accessors.into();
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bin = self.bin;
        bin.resize(bin.len().next_multiple_of(4), 0);
        let word = |n: usize| (n as u32).to_le_bytes();
        let length = 12 + 8 + json.len() + 8 + bin.len();
        [&b"glTF"[..], &word(2), &word(length), &word(json.len()), b"JSON", &json, &word(bin.len()), b"BIN\0", &bin].concat()
    }
}

pub const HALF: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// An arm of two joints along +X: vertices at x = 0, 1 and 2 and y = 0.5 and -0.5, normals along +Y. The first pair hangs on the
/// shoulder, the last on the elbow (at x = 1), the middle one on both. The clip "bend" turns the elbow by 90 degrees about +Z in two
/// seconds. The skinned node's own transform is to be ignored.
pub fn arm(weights: impl FnOnce(&mut Glb) -> usize) -> Vec<u8> {
    arm_with(weights, |_, document| document)
}

pub fn arm_with(weights: impl FnOnce(&mut Glb) -> usize, change: impl FnOnce(&mut Glb, Value) -> Value) -> Vec<u8> {
    let mut glb = Glb::default();
    let positions: Vec<[f32; 3]> = (0..6).map(|i| [(i / 2) as f32, if i % 2 == 0 { 0.5 } else { -0.5 }, 0.0]).collect();
    let position = glb.floats("VEC3", &positions);
    let normal = glb.floats("VEC3", &[[0.0, 1.0, 0.0]; 6]);
    let joints = glb.raw("VEC4", U8, false, 6, &[0, 1, 0, 0].repeat(6));
    let weights = weights(&mut glb);
    let indices = glb.indices(&[1, 3, 0, 0, 3, 2, 3, 5, 2, 2, 5, 4]);
    let identity = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    let mut elbow = identity;
    elbow[12] = -1.0;
    let binds = glb.floats("MAT4", &[identity, elbow]);
    let times = glb.scalars(&[0.0, 2.0]);
    let turns = glb.floats("VEC4", &[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, HALF, HALF]]);
    let document = json!({
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "skin": 0, "translation": [7.0, 7.0, 7.0]},
            {"children": [2]},
            {"translation": [1.0, 0.0, 0.0]},
        ],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights},
            "indices": indices,
        }]}],
        "skins": [{"joints": [1, 2], "inverseBindMatrices": binds}],
        "animations": [{
            "name": "bend",
            "samplers": [{"input": times, "output": turns}],
            "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}],
        }],
    });
    let document = change(&mut glb, document);
    glb.finish(document)
}

/// The arm's weights as floats; they do not add to 1.
pub fn float_weights(glb: &mut Glb) -> usize {
    let row = |a: f32, b: f32| [[a, b, 0.0, 0.0]; 2];
    glb.floats("VEC4", &[row(2.0, 0.0), row(0.25, 0.25), row(0.0, 1.0)].concat())
}

/// Two triangles on two nodes: "slide" moves the first by steps along +X, "turn" the second and with it its child, the first's mesh
/// again, about +Y.
pub fn objects() -> Vec<u8> {
    let mut glb = Glb::default();
    let position = glb.floats("VEC3", &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]);
    let times = glb.scalars(&[0.5, 1.0, 2.0]);
    let steps = glb.floats("VEC3", &[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
    // as normalised 16-bit numbers: 0, a quarter turn, the same as its negative
    let half = (HALF * 32767.0).round() as i16;
    let turns = [[0, 0, 0, 32767], [0, half, 0, half], [0, -half, 0, -half]];
    let bytes: Vec<u8> = turns.as_flattened().iter().flat_map(|v: &i16| v.to_le_bytes()).collect();
    let turns = glb.raw("VEC4", I16, true, 3, &bytes);
    glb.finish(json!({
        "nodes": [
            {"mesh": 0, "translation": [1.0, 0.0, 0.0]},
            {"mesh": 0, "translation": [0.0, 2.0, 0.0], "children": [2]},
            {"mesh": 0, "translation": [0.0, 1.0, 0.0], "scale": [2.0, 2.0, 2.0]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": position}}]}],
        "animations": [
            {
                "name": "slide",
                "samplers": [{"input": times, "output": steps, "interpolation": "STEP"}],
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            },
            {
                "samplers": [{"input": times, "output": turns, "interpolation": "LINEAR"}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}}],
            },
        ],
    }))
}

/// A flat square whose first target lifts one corner by 2 and tilts all normals, at weights 0 to 1 in one second; the second target,
/// shifting all by 10 along +Z, stands at a quarter by default.
pub fn morphing(normals: bool) -> Vec<u8> {
    let mut glb = Glb::default();
    let position = glb.floats("VEC3", &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0], [0.0, 0.0, -1.0]]);
    let normal = glb.floats("VEC3", &[[0.0, 1.0, 0.0]; 4]);
    let lift = glb.floats("VEC3", &[[0.0; 3], [0.0; 3], [0.0, 2.0, 0.0], [0.0; 3]]);
    let tilt = glb.floats("VEC3", &[[1.0, -1.0, 0.0]; 4]);
    let shift = glb.floats("VEC3", &[[0.0, 0.0, 10.0]; 4]);
    let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
    let times = glb.scalars(&[0.0, 1.0]);
    let weights = glb.scalars(&[0.0, 0.25, 1.0, 0.25]);
    let mut attributes = json!({"POSITION": position});
    let mut first = json!({"POSITION": lift});
    if normals {
        attributes["NORMAL"] = normal.into();
        first["NORMAL"] = tilt.into();
    }
    let second = if normals {
        json!({"POSITION": shift, "NORMAL": glb.floats("VEC3", &[[0.0; 3]; 4])})
    } else {
        json!({"POSITION": shift})
    };
    glb.finish(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"weights": [0.0, 0.25], "primitives": [{"attributes": attributes, "indices": indices, "targets": [first, second]}]}],
        "animations": [{
            "name": "lift",
            "samplers": [{"input": times, "output": weights}],
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
        }],
    }))
}
