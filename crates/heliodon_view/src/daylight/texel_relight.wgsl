// The sky's light and the bounced sunlight of a moment at every texel of theirs. Prepended: texels.wgsl.

@group(0) @binding(0) var<uniform> texel_moment: TexelMoment;
@group(0) @binding(1) var baked: texture_2d_array<f32>;
@group(0) @binding(2) var lit: texture_storage_2d<rgba16float, write>;

const HALF_MAX: vec3<f32> = vec3<f32>(65504.0);

// Light may be below nothing: it is filtered before it is cut off, as the reference has it.
fn store(texel: vec2<u32>, light: vec3<f32>) {
    textureStore(lit, texel, vec4<f32>(clamp(light, -HALF_MAX, HALF_MAX), 0.0));
}

@compute @workgroup_size(16, 16)
fn sky(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= textureDimensions(lit))) {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var layer = 0u; layer < texel_moment.layers.x; layer += 1u) {
        sum += textureLoad(baked, id.xy, layer, 0) * texel_moment.sky[layer];
    }
    store(id.xy, sum);
}

@compute @workgroup_size(16, 16)
fn bounce(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= textureDimensions(lit))) {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var layer = 0u; layer < texel_moment.layers.y; layer += 1u) {
        sum += textureLoad(baked, id.xy, layer, 0) * texel_moment.bounce[layer];
    }
    store(id.xy, texel_moment.sun.rgb * sum);
}
