// Normals of a pose, from its triangles, where nothing else says them; and how rough the triangles around each corner are, for depth maps.

struct Normals {
    corners: u32,
    weights: u32,
    // Workgroups in a row of a dispatch.
    row: u32,
    // Whether depth maps are asked.
    spread: u32,
}

@group(0) @binding(0) var<uniform> constants: Normals;
@group(0) @binding(1) var<storage, read> sources: array<u32>;
@group(0) @binding(2) var<storage, read> rules: array<Rule>;
@group(0) @binding(3) var<storage, read> levers: array<f32>;
// For each vertex where its corners of triangles begin, and the end of the last; then those: the corner k of triangle t is 4 t + k.
@group(0) @binding(4) var<storage, read> around: array<u32>;
@group(0) @binding(5) var<storage, read> triangles: array<u32>;
@group(0) @binding(6) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> normals: array<vec4<f32>>;

// As points.rs has it.
const MOST_SPREAD: f32 = 1.7;

// The place of a triangle's corner, k after k = 2 from the first on.
fn place(t: u32, k: u32) -> vec3<f32> {
    return positions[triangles[3u * t + k % 3u]].xyz;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let corner = (group.y * constants.row + group.x) * 64u + lane;
    if (corner >= constants.corners) {
        return;
    }
    let vertex = sources[corner] & 0x7fffffffu;
    let side = select(1.0, -1.0, sources[corner] >> 31u == 1u);
    let rule = rules[vertex];
    var n = normals[corner].xyz;
    if (rule.renews != 0u) {
        n = rule.rest_normal * side;
        if (levers[constants.weights + rule.part] != 0.0) {
            var sum = vec3<f32>(0.0);
            for (var i = around[vertex]; i < around[vertex + 1u]; i++) {
                let t = around[i] / 4u;
                let k = around[i] % 4u;
                let own = place(t, k);
                let b = place(t, k + 1u) - own;
                let c = place(t, k + 2u) - own;
                let normal = cross(b, c);
                let double_area = length(normal);
                if (double_area > 0.0) {
                    sum += normal * (atan2(double_area, dot(b, c)) / double_area);
                }
            }
            let length2 = dot(sum, sum);
            if (length2 > 0.0) {
                n = sum * (inverseSqrt(length2) * side);
            }
        }
    }
    var spread = 0.0;
    if (constants.spread != 0u) {
        var least = 1.0;
        for (var i = around[vertex]; i < around[vertex + 1u]; i++) {
            let t = around[i] / 4u;
            let a = place(t, 0u);
            let face = cross(place(t, 1u) - a, place(t, 2u) - a);
            let size = length(face);
            if (size > 0.0) {
                least = min(least, abs(dot(face, n)) / size);
            }
        }
        spread = min(sqrt(max(1.0 - least * least, 0.0)) / max(least, 1e-3), MOST_SPREAD);
    }
    normals[corner] = vec4<f32>(n, spread);
}
