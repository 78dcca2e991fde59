// What single photographs saw of a part, shown to whoever stands where they were taken; heliodon_image::view_layers is its reference. After detail.wgsl, and
// before stone.wgsl's end, whose albedo_sampler it reads with.

@group(DETAIL_GROUP) @binding(3) var view_colors: texture_2d_array<f32>;
@group(DETAIL_GROUP) @binding(4) var view_directions: texture_2d_array<f32>;

const VIEWED_PLAIN: f32 = 1.0 / 64.0;
const VIEWED_HALF_RAD: f32 = 0.13;

// `plain` is the colour of the surface's own image.
fn viewed(plain: vec3<f32>, place: vec3<f32>, uv: vec2<f32>) -> vec3<f32> {
    let toward_eye = normalize(view.eye.xyz - place);
    var sum = plain * VIEWED_PLAIN;
    var weights = VIEWED_PLAIN;
    for (var layer = 0u; layer < detail.mapping.z; layer += 1u) {
        let seen = textureSample(view_colors, albedo_sampler, uv, layer);
        let toward_camera = normalize(textureSampleLevel(view_directions, albedo_sampler, uv, layer, 0.0).xyz * 2.0 - 1.0);
        let off = toward_camera - toward_eye;
        // a parallel projection has no eye to stand anywhere
        let weight = seen.a * view.eye.w * exp2(-dot(off, off) / (VIEWED_HALF_RAD * VIEWED_HALF_RAD));
        sum += weight * seen.rgb;
        weights += weight;
    }
    return sum / weights;
}
