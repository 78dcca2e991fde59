// Brings both eyes' pictures of a screen to its output: packed for stereo, its edges blended, its colours corrected.
// `Compose` in display/compose.rs.

struct Compose {
    // x: how the eyes share the output (MODE_...), y: 1 where text and timeline lie over the picture; zw: the output's size in pixels.
    how: vec4<u32>,
    // Parts of the picture that overlap at the left, right, upper and lower edge.
    blend: vec4<f32>,
    // rgb: factor, a: the projector's gamma.
    gain: vec4<f32>,
    // rgb: power.
    power: vec4<f32>,
    // rgb: value of black.
    black: vec4<f32>,
}

const MODE_LEFT: u32 = 0u;
const MODE_SIDE_BY_SIDE: u32 = 1u;
const MODE_TOP_BOTTOM: u32 = 2u;
const MODE_ROWS: u32 = 3u;
const MODE_COLUMNS: u32 = 4u;
const MODE_CHECKERBOARD: u32 = 5u;
const MODE_ANAGLYPH: u32 = 6u;

@group(0) @binding(0) var<uniform> compose: Compose;
@group(0) @binding(1) var left_eye: texture_2d<f32>;
@group(0) @binding(2) var right_eye: texture_2d<f32>;
@group(0) @binding(3) var overlay: texture_2d<f32>;
@group(0) @binding(4) var linear_sampler: sampler;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Fragment {
    let xy = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    var out: Fragment;
    out.clip = vec4<f32>(xy * 2.0 - 1.0, 0.0, 1.0);
    out.uv = vec2<f32>(xy.x, 1.0 - xy.y);
    return out;
}

// Text over a picture; its colours are multiplied by its alpha.
fn with_overlay(picture: vec3<f32>, uv: vec2<f32>) -> vec3<f32> {
    let over = textureSampleLevel(overlay, linear_sampler, uv, 0.0) * f32(compose.how.y);
    return over.rgb + picture * (1.0 - over.a);
}

fn left_at(uv: vec2<f32>) -> vec3<f32> {
    return with_overlay(textureSampleLevel(left_eye, linear_sampler, uv, 0.0).rgb, uv);
}

fn right_at(uv: vec2<f32>) -> vec3<f32> {
    return with_overlay(textureSampleLevel(right_eye, linear_sampler, uv, 0.0).rgb, uv);
}

fn codes(light: vec3<f32>) -> vec3<f32> {
    let low = light * 12.92;
    let high = 1.055 * pow(max(light, vec3<f32>(0.0)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, light <= vec3<f32>(0.0031308));
}

fn light_of(code: vec3<f32>) -> vec3<f32> {
    let low = code / 12.92;
    let high = pow((code + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, code <= vec3<f32>(0.04045));
}

// How much of its light a picture keeps `at` from an edge of which it shares `width` with a neighbour: what this one loses the other has.
fn ramp(at: f32, width: f32) -> f32 {
    if (width <= 0.0) {
        return 1.0;
    }
    let t = clamp(at / width, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.clip.xy);
    var uv = in.uv;
    var right = false;
    switch (compose.how.x) {
        case MODE_SIDE_BY_SIDE: {
            right = uv.x >= 0.5;
            uv.x = fract(uv.x * 2.0);
        }
        case MODE_TOP_BOTTOM: {
            right = uv.y >= 0.5;
            uv.y = fract(uv.y * 2.0);
        }
        case MODE_ROWS: {
            right = pixel.y % 2u == 1u;
        }
        case MODE_COLUMNS: {
            right = pixel.x % 2u == 1u;
        }
        case MODE_CHECKERBOARD: {
            right = (pixel.x + pixel.y) % 2u == 1u;
        }
        default: {}
    }
    var light: vec3<f32>;
    if (compose.how.x == MODE_ANAGLYPH) {
        light = vec3<f32>(left_at(uv).r, right_at(uv).gb);
    } else if (right) {
        light = right_at(uv);
    } else {
        light = left_at(uv);
    }
    // The projector makes light of codes by its own gamma: there the edges are blended.
    let kept = ramp(uv.x, compose.blend.x) * ramp(1.0 - uv.x, compose.blend.y)
        * ramp(uv.y, compose.blend.z) * ramp(1.0 - uv.y, compose.blend.w);
    var code = codes(clamp(light, vec3<f32>(0.0), vec3<f32>(1.0)));
    code = pow(clamp(compose.gain.rgb * code, vec3<f32>(0.0), vec3<f32>(1.0)), compose.power.rgb);
    code = compose.black.rgb + (1.0 - compose.black.rgb) * code;
    code *= pow(kept, 1.0 / compose.gain.a);
    return vec4<f32>(light_of(code), 1.0);
}
