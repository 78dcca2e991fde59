// Lays what is in the air over the picture in scene light: what the display shows of the picture is taken back to light, some of that is taken away and some added, and the
// display shows the sum. Laid over display values, smoke would be too dark and fire too pale wherever the tone curve bends. `CURVE`, `ENCODE`, `DITHER`
// and display.wgsl are prepended.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var air: texture_2d<f32>;
@group(0) @binding(2) var smooth_sampler: sampler;
// x: pixels of the picture in one of the air's; y, z: one over the air's sides.
@group(0) @binding(3) var<uniform> scale: vec4<f32>;

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

@fragment
fn fragment(@builtin(position) clip: vec4<f32>) -> @location(0) vec4<f32> {
    let shown = textureLoad(picture, vec2<i32>(clip.xy), 0);
    let laid = textureSampleLevel(air, smooth_sampler, clip.xy / scale.x * scale.yz, 0.0);
    if (all(laid == vec4<f32>(0.0))) {
        return shown;
    }
    let light = exposed_of(shown.rgb) * (1.0 - laid.a) + laid.rgb;
    return vec4<f32>(display(light, clip.xy), shown.a);
}
