// Which points the light of each direction reaches: one invocation for a point and 32 directions, one word of the matrix.
//
// A point is compared with the four texels around it, each taken at its own middle: there the surface through the point, by its
// normal, has another depth (receiver plane). It is occluded if the map is nearer, by the bias, on more than half of the weight.

@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(5) var depth: texture_depth_2d;
@group(0) @binding(6) var<storage, read_write> bits: array<u32>;

// The steepest slope that is followed, in radii of depth for each radius across: 85 degrees.
const STEEPEST: f32 = 11.4;

// What rounding and the map's own interpolation ask for, in texels.
const FLAT_BIAS: f32 = 0.25;

// How much rougher than the triangles around a point the surface is taken to be within the texels around it. Of the bunny's entries at 66
// directions and 1024 pixels, 1 leaves 0.8 % dark that rays find lit, 1.5 lights 0.4 % that rays find dark (and 0.5 more of ambient
// occlusion beneath a ball that touches the ground); 1.2 leaves 0.2 % and 0.4 %.
const ROUGHNESS: f32 = 1.2;

// `spread` is the tangent of an angle by which the surface may fall away more steeply than the plane by which it is compared.
fn reaches(tile: u32, p: vec3<f32>, n: vec3<f32>, spread: f32) -> bool {
    let axes = basis(directions[maps.first + tile].xyz);
    let facing = n * axes;
    if (!(facing.z > 0.0)) {
        return false;
    }
    let q = light_space(axes, p);
    let px = atlas_px(tile, q.xy);
    // Depth falls by half of what the surface rises towards the light; rows go down.
    let tangent = vec2<f32>(facing.x, -facing.y) / facing.z;
    let steep = min(length(tangent), STEEPEST);
    let slope = 0.5 * tangent * (steep / max(length(tangent), 1e-6)) / radius_px();
    // The tangent of the sum of both angles, as far as it is followed.
    let steeper = select(STEEPEST, min((steep + spread) / (1.0 - steep * spread), STEEPEST), steep * spread < 0.9);
    // What is steeper than is followed is not known, and has next to no weight.
    let bias = maps.bias * (FLAT_BIAS + steeper - steep) + (length(tangent) - steep);
    let own = 0.5 - 0.5 * q.z - 0.5 * bias / radius_px();
    let low = floor(px - 0.5);
    let part = px - 0.5 - low;
    var nearer = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let step = vec2<f32>(vec2<u32>(i & 1u, i >> 1u));
        let texel = low + step;
        let weights = mix(1.0 - part, part, step);
        let surface = own + dot(slope, texel + 0.5 - px);
        nearer += weights.x * weights.y * f32(textureLoad(depth, vec2<i32>(texel), 0) < surface);
    }
    return nearer <= 0.5;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let point = (group.y * maps.row + group.x) * 64u + lane;
    if (point >= maps.points) {
        return;
    }
    let p = positions[point].xyz;
    let n = normals[point];
    let first = group.z * 32u;
    // A batch is whole words, or a part of one, which is written from its first bit on.
    let at = (maps.first / 32u + group.z) * maps.points + point;
    let shift = maps.first % 32u;
    var word = 0u;
    if (shift > 0u) {
        word = bits[at];
    }
    for (var i = 0u; i < min(32u, maps.count - first); i++) {
        word |= u32(reaches(first + i, p, n.xyz, ROUGHNESS * n.w)) << (shift + i);
    }
    bits[at] = word;
}
