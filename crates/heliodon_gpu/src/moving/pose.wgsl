// Where the vertices of a moving mesh are: as heliodon_mesh::motion::rules says.

struct Pose {
    corners: u32,
    weights: u32,
    // Workgroups in a row of a dispatch.
    row: u32,
    farthest: f32,
}

struct Delta {
    position: vec3<f32>,
    weight: u32,
    normal: vec3<f32>,
}

struct Influence {
    matrix: u32,
    share: f32,
}

@group(0) @binding(0) var<uniform> pose: Pose;
// The vertex of each corner, and above it whether it is seen from the back.
@group(0) @binding(1) var<storage, read> sources: array<u32>;
@group(0) @binding(2) var<storage, read> rules: array<Rule>;
@group(0) @binding(3) var<storage, read> influences: array<Influence>;
@group(0) @binding(4) var<storage, read> deltas: array<Delta>;
@group(0) @binding(5) var<storage, read> palette: array<mat4x4<f32>>;
// Weights, then for each part whether it moves.
@group(0) @binding(6) var<storage, read> levers: array<f32>;
@group(0) @binding(7) var<storage, read_write> positions: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> normals: array<vec4<f32>>;

const STAYS: u32 = 0xffffffffu;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let corner = (group.y * pose.row + group.x) * 64u + lane;
    if (corner >= pose.corners) {
        return;
    }
    let vertex = sources[corner] & 0x7fffffffu;
    let side = select(1.0, -1.0, sources[corner] >> 31u == 1u);
    let rule = rules[vertex];
    var placed = rule.rest;
    var turned = rule.rest_normal;
    var moves = false;
    if (rule.part != STAYS) {
        moves = levers[pose.weights + rule.part] != 0.0;
    }
    if (moves) {
        var p = rule.position;
        var n = rule.normal;
        for (var i = rule.deltas; i < rules[vertex + 1u].deltas; i++) {
            let weight = levers[deltas[i].weight];
            p += deltas[i].position * weight;
            n += deltas[i].normal * weight;
        }
        var x = vec3<f32>(0.0);
        var y = vec3<f32>(0.0);
        var z = vec3<f32>(0.0);
        var offset = vec3<f32>(0.0);
        for (var i = rule.influences; i < rules[vertex + 1u].influences; i++) {
            let share = influences[i].share;
            let matrix = palette[influences[i].matrix];
            x += matrix[0].xyz * share;
            y += matrix[1].xyz * share;
            z += matrix[2].xyz * share;
            offset += matrix[3].xyz * share;
        }
        let q = x * p.x + y * p.y + z * p.z + offset;
        // False for what is no number.
        if (all(abs(q) <= vec3<f32>(pose.farthest))) {
            placed = q;
        }
        // The cofactors are the inverse transpose times the determinant, of which only the sign matters. Columns of one size, for their products must
        // neither vanish nor overflow.
        let size = max(max(dot(x, x), dot(y, y)), dot(z, z));
        if (size > 0.0) {
            let scale = inverseSqrt(size);
            let yz = cross(y * scale, z * scale);
            let m = yz * n.x + cross(z * scale, x * scale) * n.y + cross(x * scale, y * scale) * n.z;
            let length2 = dot(m, m);
            if (length2 > 1e-30) {
                turned = m * (inverseSqrt(length2) * select(1.0, -1.0, dot(x, yz) < 0.0));
            }
        }
    }
    positions[corner] = vec4<f32>(placed, 1.0);
    normals[corner] = vec4<f32>(turned * side, 0.0);
}
