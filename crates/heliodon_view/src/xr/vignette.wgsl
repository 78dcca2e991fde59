// Darkens the edge of an eye's view while its owner is carried. The angle counts, not the place in the picture, so that both eyes darken the same
// directions although their pictures are cut differently.

struct Vignette {
    // From clip coordinates to tangents of angles: xy scale, zw offset.
    tangent_from_clip: vec4<f32>,
    // x: tangent within which nothing is darkened; y: beyond which all is; z: how far, 0 to 1.
    edge: vec4<f32>,
}

@group(0) @binding(0) var<uniform> vignette: Vignette;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) tangent: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let xy = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    var out: Fragment;
    out.clip = vec4<f32>(xy, 0.0, 1.0);
    out.tangent = xy * vignette.tangent_from_clip.xy + vignette.tangent_from_clip.zw;
    return out;
}

// Blended over the picture: black, as far as alpha says.
@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let dark = smoothstep(vignette.edge.x, vignette.edge.y, length(in.tangent));
    return vec4<f32>(0.0, 0.0, 0.0, dark * vignette.edge.z);
}
