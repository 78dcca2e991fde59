// One eye's layer of what was drawn for both (multiview.rs): its colour and its depth, sample by sample. Lines between `#ifdef` and `#endif` are kept where they
// apply (pipelines.rs).

#ifdef ONE_SAMPLE
@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var depths: texture_depth_2d;
#endif
#ifdef SAMPLES
@group(0) @binding(0) var picture: texture_multisampled_2d<f32>;
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
#endif

struct Fragment {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let xy = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    return vec4<f32>(xy, 0.0, 1.0);
}

@fragment
fn fragment(
    @builtin(position) clip: vec4<f32>,
#ifdef SAMPLES
    @builtin(sample_index) number: u32,
#endif
) -> Fragment {
    let pixel = vec2<i32>(clip.xy);
#ifdef ONE_SAMPLE
    let number = 0;
#endif
    return Fragment(textureLoad(picture, pixel, number), textureLoad(depths, pixel, number));
}
