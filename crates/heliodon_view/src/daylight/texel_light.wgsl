// Prepended to stone.wgsl where light comes from texels.

@group(1) @binding(2) var<uniform> texel_moment: TexelMoment;
@group(1) @binding(3) var texel_sun: texture_2d_array<u32>;
// rgb: the light of the moment from the sky, and what is bounced of the sun's.
@group(1) @binding(4) var texel_sky: texture_2d<f32>;
@group(1) @binding(5) var texel_bounced: texture_2d<f32>;
@group(1) @binding(6) var texel_sampler: sampler;
// rgb: the colour of what has settled, times how much of the surface it covers; a: that part.
@group(1) @binding(7) var texel_weathering: texture_2d<f32>;

// The level of the masks whose texels are about as large as a pixel.
fn texel_level(across: vec2<f32>, down: vec2<f32>) -> f32 {
    let size = vec2<f32>(textureDimensions(texel_sun, 0));
    return max(0.5 * log2(max(dot(across * size, across * size), dot(down * size, down * size))), 0.0);
}

// The part of the sun that reaches a place: the bits of nine texels, mixed by a quadratic B-spline, whose edges are smooth, and made as steep as texels allow.
fn texel_reached(uv: vec2<f32>, level: u32) -> f32 {
    let size = vec2<i32>(textureDimensions(texel_sun, level));
    let at = uv * vec2<f32>(size);
    let middle = floor(at);
    let off = at - middle - 0.5;
    let before = 0.5 * (0.5 - off) * (0.5 - off);
    let after = 0.5 * (0.5 + off) * (0.5 + off);
    let own = 1.0 - before - after;
    var reached = vec2<f32>(0.0);
    for (var tap = 0u; tap < 9u; tap += 1u) {
        let step = vec2<i32>(vec2<u32>(tap % 3u, tap / 3u)) - 1;
        let texel = clamp(vec2<i32>(middle) + step, vec2<i32>(0), size - 1);
        let weights = select(select(after, own, step == vec2<i32>(0)), before, step < vec2<i32>(0));
        let first = (textureLoad(texel_sun, texel, texel_moment.mask.x, level).r >> texel_moment.mask.y) & 1u;
        let second = (textureLoad(texel_sun, texel, texel_moment.mask.z, level).r >> texel_moment.mask.w) & 1u;
        reached += weights.x * weights.y * vec2<f32>(vec2<u32>(first, second));
    }
    return dot(texel_moment.mask_weights.xy, smoothstep(vec2<f32>(0.25), vec2<f32>(0.75), reached));
}

// An albedo beneath what the weather has left on it.
fn texel_weathered(albedo: vec3<f32>, uv: vec2<f32>, across: vec2<f32>, down: vec2<f32>) -> vec3<f32> {
    let coarser = log2(f32(textureDimensions(texel_sun, 0).x) / f32(textureDimensions(texel_weathering, 0).x));
    let layer = textureSampleLevel(texel_weathering, texel_sampler, uv, texel_level(across, down) - coarser);
    return albedo * (1.0 - layer.a) + layer.rgb;
}

// rgb: the light at a place; a: how much of the sun's irradiance / pi in it comes straight from the sun.
fn texel_light(uv: vec2<f32>, across: vec2<f32>, down: vec2<f32>, normal: vec3<f32>) -> vec4<f32> {
    let level = texel_level(across, down);
    let coarsest = textureNumLevels(texel_sun) - 1u;
    // Half way between two levels they are mixed, so that no line is seen where one ends.
    let finer = min(u32(level), coarsest);
    let passed = clamp(2.0 * (level - f32(finer)) - 0.5, 0.0, 1.0);
    var reached = 0.0;
    if passed < 1.0 || finer == coarsest {
        reached = texel_reached(uv, finer);
    }
    if passed > 0.0 && finer < coarsest {
        reached = mix(reached, texel_reached(uv, finer + 1u), passed);
    }
    let direct = reached * max(dot(normal, texel_moment.sun_direction.xyz), 0.0);
    // Of coloured light the sky has fewer levels than the masks: its texels are as large as theirs on the next.
    let above = f32(coarsest + 1u - textureNumLevels(texel_sky));
    let sky = textureSampleLevel(texel_sky, texel_sampler, uv, level - above).rgb;
    let bounced = textureSampleLevel(texel_bounced, texel_sampler, uv, 0.0).rgb;
    return vec4<f32>(direct * texel_moment.sun_over_pi.rgb + max(sky, vec3<f32>(0.0)) + max(bounced, vec3<f32>(0.0)), direct);
}
