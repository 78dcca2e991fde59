// Where the vertices of a mesh with a cache are: where the cache says.

struct Cached {
    corners: u32,
    // Workgroups in a row of a dispatch.
    row: u32,
}

@group(0) @binding(0) var<uniform> cached: Cached;
// The vertex of each corner, and above it whether it is seen from the back.
@group(0) @binding(1) var<storage, read> sources: array<u32>;
// Three numbers a vertex.
@group(0) @binding(2) var<storage, read> places: array<f32>;
@group(0) @binding(3) var<storage, read_write> positions: array<vec4<f32>>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let corner = (group.y * cached.row + group.x) * 64u + lane;
    if (corner >= cached.corners) {
        return;
    }
    let at = 3u * (sources[corner] & 0x7fffffffu);
    positions[corner] = vec4<f32>(places[at], places[at + 1u], places[at + 2u], 1.0);
}
