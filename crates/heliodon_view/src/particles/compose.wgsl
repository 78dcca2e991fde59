// Lays what is in the air over the picture in scene light: what the display shows of the picture is taken back to light, some of that is taken away and some added, and the
// display shows the sum. Laid over display values, smoke would be too dark and fire too pale wherever the tone curve bends. `CURVE`, `ENCODE`, `DITHER`,
// display.wgsl and over_stone/camera.wgsl are prepended.

// x: pixels of the picture in one of the air's; y, z: one over the air's sides.
@group(0) @binding(2) var<uniform> scale: vec4<f32>;
@group(1) @binding(0) var picture: texture_2d<f32>;
@group(1) @binding(1) var air: texture_2d<f32>;
@group(1) @binding(2) var haze: texture_2d<f32>;
@group(1) @binding(3) var smooth_sampler: sampler;
// As `scale`, of the haze's picture.
@group(1) @binding(4) var<uniform> haze_scale: vec4<f32>;

// Depths that differ by this share, and by these metres, are alike: haze changes little on such a way.
const ALIKE: f32 = 0.02;
const ALIKE_M: f32 = 0.1;
// The sky is at some depth, too.
const FARTHEST_M: f32 = 1e5;

@vertex
fn vertex(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4<f32> {
    let xy = vec2<f32>(f32(corner & 1u), f32(corner >> 1u)) * 4.0 - 1.0;
    return vec4<f32>(xy, 0.0, 1.0);
}

fn linear_from_srgb(code: vec3<f32>) -> vec3<f32> {
    let high = pow((code + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, code / 12.92, code <= vec3<f32>(0.04045));
}

// Exposed light of what `display` shows: of white, the least that is.
fn exposed_of(shown: vec3<f32>) -> vec3<f32> {
    var linear = shown;
    if (ENCODE) {
        linear = linear_from_srgb(clamp(shown, vec3<f32>(0.0), vec3<f32>(1.0)));
    }
    if (CURVE == CURVE_FILMIC) {
        // hable(x) = v - 0.02 / 0.3 is a quadratic equation of x
        let v = clamp(linear, vec3<f32>(0.0), vec3<f32>(1.0)) * hable(vec3<f32>(11.2)) + 0.02 / 0.3;
        let a = 0.15 * (1.0 - v);
        let b = 0.05 - 0.5 * v;
        let c = 0.004 - 0.06 * v;
        let x = (-b + sqrt(max(b * b - 4.0 * a * c, vec3<f32>(0.0)))) / (2.0 * a);
        return max(x * 0.5, vec3<f32>(0.0));
    }
    return linear;
}

fn depth_at(pixel: vec2<f32>) -> f32 {
    return min(scene_depth(pixel), FARTHEST_M);
}

// The haze before a pixel: of the four places of its picture around it, the more of one the nearer it lies and the liker the depth is that it saw.
fn haze_at(pixel: vec2<f32>) -> vec3<f32> {
    let own = depth_at(pixel);
    let at = pixel / haze_scale.x - 0.5;
    let low = floor(at);
    let part = at - low;
    let last = vec2<f32>(textureDimensions(haze)) - 1.0;
    var sum = vec3<f32>(0.0);
    var whole = 0.0;
    for (var k = 0u; k < 4u; k += 1u) {
        let corner = vec2<f32>(f32(k & 1u), f32(k >> 1u));
        let place = clamp(low + corner, vec2<f32>(0.0), last);
        let near = mix(1.0 - part, part, corner);
        let off = (depth_at((place + 0.5) * haze_scale.x) - own) / (ALIKE_M + ALIKE * own);
        let weight = (near.x * near.y + 1e-3) / (1.0 + off * off);
        sum += textureLoad(haze, vec2<i32>(place), 0).rgb * weight;
        whole += weight;
    }
    return sum / whole;
}

@fragment
fn fragment(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let shown = textureLoad(picture, vec2<i32>(clip.xy), 0);
    let laid = textureSampleLevel(air, smooth_sampler, clip.xy / scale.x * scale.yz, 0.0);
    let hazy = textureSampleLevel(haze, smooth_sampler, clip.xy / haze_scale.x * haze_scale.yz, 0.0);
    var out = shown;
    // one turn of a loop where anything is: see air.wgsl
    for (var k = 0u; k < select(0u, 1u, any(laid + hazy != vec4<f32>(0.0))); k += 1u) {
        let light = exposed_of(shown.rgb) * (1.0 - laid.a) + laid.rgb + haze_at(clip.xy);
        out = vec4<f32>(display(light, clip.xy), shown.a);
    }
    return out;
}
