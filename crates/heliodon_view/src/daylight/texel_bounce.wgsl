// The bounced sunlight of a moment at every texel of it. Prepended: texels.wgsl.

@group(0) @binding(0) var<uniform> texel_moment: TexelMoment;
@group(0) @binding(1) var baked: texture_2d_array<f32>;
@group(0) @binding(2) var bounced: texture_storage_2d<rgba16float, write>;

const HALF_MAX: vec3<f32> = vec3<f32>(65504.0);

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (any(id.xy >= textureDimensions(bounced))) {
        return;
    }
    var sum = vec3<f32>(0.0);
    for (var layer = 0u; layer < texel_moment.layers.y; layer += 1u) {
        sum += textureLoad(baked, id.xy, layer, 0) * texel_moment.bounce[layer];
    }
    // As it is, below nothing too: it is filtered before it is cut off, as the reference has it.
    let light = clamp(texel_moment.sun.rgb * sum, -HALF_MAX, HALF_MAX);
    textureStore(bounced, id.xy, vec4<f32>(light, 0.0));
}
