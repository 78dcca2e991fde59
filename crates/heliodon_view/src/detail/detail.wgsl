// A part's detail, multiplied onto its albedo near the eye: `DetailUniform` in detail/mod.rs; heliodon_bundle::detail is its reference. Prepended to
// stone.wgsl. Drivers that draw on the processor leave no branch out, but they do leave loops: an axis that does not count is a turn that is not taken.

struct Detail {
    // x: tiles in a metre or in a unit of the texture coordinates; y: strength; z: 1 / the distance up to which it is full; w: the level on which it is flat.
    scale: vec4<f32>,
    // x: 1 where it goes by the texture coordinates; y: the axis, x 0, y 1, z 2, along which the image's columns run; z: photographs' views (viewed.wgsl).
    mapping: vec4<u32>,
}

@group(DETAIL_GROUP) @binding(0) var<uniform> detail: Detail;
@group(DETAIL_GROUP) @binding(1) var detail_texture: texture_2d<f32>;
@group(DETAIL_GROUP) @binding(2) var detail_sampler: sampler;

const AXIS_CUT: f32 = 0.03;

// The world with the axis of the image's columns as its y.
fn detail_turned(v: vec3<f32>) -> vec3<f32> {
    return select(select(v.xzy, v.yxz, detail.mapping.y == 0u), v, detail.mapping.y == 1u);
}

// The longer side of a pixel, by what changes across it and down.
fn longer(across: vec3<f32>, down: vec3<f32>) -> f32 {
    return sqrt(max(dot(across, across), dot(down, down)));
}

// What albedo is multiplied with. `pixel_m` and `pixel_uv`: the pixel's longer side on the surface; `base`: texels of the base colour texture along it, 0 without one.
fn detail_factor(place: vec3<f32>, normal: vec3<f32>, pixel_m: f32, uv: vec2<f32>, pixel_uv: f32, base: f32) -> f32 {
    let by_uv = detail.mapping.x == 1u;
    let texels = select(pixel_m, pixel_uv, by_uv) * detail.scale.x * f32(textureDimensions(detail_texture, 0).x);
    let level = log2(max(texels, 1e-6));
    let near = clamp(2.0 - length(place - view.eye.xyz) * view.eye.w * detail.scale.z, 0.0, 1.0);
    let denser = clamp(level - log2(max(base, 1e-6)), 0.0, 1.0);
    let weight = detail.scale.y * view.sky_weights.w * near * denser * clamp(detail.scale.w - level, 0.0, 1.0);
    let at = detail_turned(place);
    let squares = detail_turned(normal * normal);
    let weights = select(max(squares * squares - AXIS_CUT, vec3<f32>(0.0)), vec3<f32>(1.0, 0.0, 0.0), by_uv);
    let counts = (weights > vec3<f32>(0.0)) & vec3<bool>(weight > 0.0);
    var axes = select(0u, 1u, counts.x) | select(0u, 2u, counts.y) | select(0u, 4u, counts.z);
    var sum = 0.0;
    while (axes != 0u) {
        let axis = firstTrailingBit(axes);
        axes &= axes - 1u;
        let seen = select(select(vec2<f32>(at.x, -at.y), at.xz, axis == 1u), vec2<f32>(at.z, -at.y), axis == 0u);
        let where_to = select(seen, uv, by_uv) * detail.scale.x;
        let code = textureSampleLevel(detail_texture, detail_sampler, where_to, max(level, 0.0)).r;
        sum += select(select(weights.z, weights.y, axis == 1u), weights.x, axis == 0u) * (code * (255.0 / 128.0) - 1.0);
    }
    return max(1.0 + weight * sum * inverseSqrt(max(dot(weights, weights), 1e-6)), 0.0);
}
