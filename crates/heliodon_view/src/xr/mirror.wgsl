// What an eye sees, in a window of another shape: the middle of the picture, as much as fills the window.

@group(0) @binding(0) var eye: texture_2d<f32>;
@group(0) @binding(1) var eye_sampler: sampler;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let xy = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    var out: Fragment;
    out.clip = vec4<f32>(xy * vec2<f32>(2.0, -2.0) + vec2<f32>(-1.0, 1.0), 0.0, 1.0);
    out.uv = xy;
    return out;
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    // Pixels of the window for each of uv, by the slopes: no uniform is needed.
    let window = 1.0 / vec2<f32>(dpdx(in.uv.x), dpdy(in.uv.y));
    let size = vec2<f32>(textureDimensions(eye, 0));
    let fits = window / size;
    let part = fits / max(fits.x, fits.y);
    return vec4<f32>(textureSampleLevel(eye, eye_sampler, (in.uv - 0.5) * part + 0.5, 0.0).rgb, 1.0);
}
