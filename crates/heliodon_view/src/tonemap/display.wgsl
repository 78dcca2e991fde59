// From scene light to what the display shows. Mirrors tonemap/mod.rs; `CURVE` and `ENCODE` are prepended.
//
// Filmic curve: John Hable, "Filmic Tonemapping Operators", 2010 (as used in Uncharted 2), with its published constants.

const CURVE_CLAMP: u32 = 0u;
const CURVE_FILMIC: u32 = 1u;
const CURVE_LINEAR: u32 = 2u;

fn hable(x: vec3<f32>) -> vec3<f32> {
    return ((x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06)) - 0.02 / 0.3;
}

fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let low = linear * 12.92;
    let high = 1.055 * pow(linear, vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3<f32>(0.0031308));
}

// `exposed` is radiance times 2^stops.
fn display(exposed: vec3<f32>) -> vec3<f32> {
    if (CURVE == CURVE_LINEAR) {
        return min(exposed, vec3<f32>(65504.0));
    }
    var shown = clamp(exposed, vec3<f32>(0.0), vec3<f32>(1.0));
    if (CURVE == CURVE_FILMIC) {
        let white = hable(vec3<f32>(11.2));
        shown = clamp(hable(2.0 * max(exposed, vec3<f32>(0.0))) / white, vec3<f32>(0.0), vec3<f32>(1.0));
    }
    if (ENCODE) {
        return srgb_from_linear(shown);
    }
    return shown;
}
