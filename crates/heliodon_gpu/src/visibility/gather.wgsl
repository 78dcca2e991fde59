// What the matrix makes of the light of each direction: M_ij = n_i.l_j is recomputed where the bit says that light j reaches point i.

struct Sums {
    points: u32,
    count: u32,
    // Workgroups in a row of a dispatch.
    row: u32,
}

@group(0) @binding(0) var<uniform> sums: Sums;
@group(0) @binding(1) var<storage, read> directions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> bits: array<u32>;
// rgb: weight times radiance over pi. w: weight.
@group(0) @binding(4) var<storage, read> quantities: array<vec4<f32>>;
// rgb: light. w: ambient occlusion.
@group(0) @binding(5) var<storage, read_write> light: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> open_sums: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let point = (group.y * sums.row + group.x) * 64u + lane;
    if (point >= sums.points) {
        return;
    }
    let n = normals[point].xyz;
    var seen = vec4<f32>(0.0);
    var open = 0.0;
    for (var first = 0u; first < sums.count; first += 32u) {
        let word = bits[first / 32u * sums.points + point];
        for (var i = 0u; i < min(32u, sums.count - first); i++) {
            let cosine = max(dot(n, directions[first + i].xyz), 0.0);
            let quantity = quantities[first + i] * cosine;
            open += quantity.w;
            if ((word >> i & 1u) == 1u) {
                seen += quantity;
            }
        }
    }
    // Summed alike, both are equal where nothing occludes.
    open_sums[point] = open;
    light[point] = vec4<f32>(seen.rgb, select(0.0, seen.w / open, open > 0.0));
}
