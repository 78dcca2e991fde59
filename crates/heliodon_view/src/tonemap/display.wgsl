// From scene light to what the display shows. Mirrors tonemap/mod.rs and codes.rs; `CURVE`, `ENCODE` and `DITHER` are
// prepended.
//
// Filmic curve: John Hable, "Filmic Tonemapping Operators", 2010 (as used in Uncharted 2), with its published constants.

const CURVE_CLAMP: u32 = 0u;
const CURVE_FILMIC: u32 = 1u;
const CURVE_LINEAR: u32 = 2u;

fn hable(x: vec3<f32>) -> vec3<f32> {
    return ((x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06)) - 0.02 / 0.3;
}

// The transfer function of sRGB in [0, 1], at most 0.01 of an 8-bit code off: the power by its best polynomial in the fourth root,
// for a processor takes three times as long for logarithm and exponential.
fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let low = linear * 12.92;
    let root = sqrt(sqrt(linear));
    let high = (((0.08133 * root - 0.3355016) * root + 1.1226817) * root + 0.1961358) * root - 0.0646115;
    return select(high, low, linear <= vec3<f32>(0.0031308));
}

// Interleaved gradient noise in [-1/2, 1/2): Jorge Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare",
// 2014. One 8-bit code of it (a hair less, so that white stays white) before the target rounds leaves no bands in slow gradients.
fn dither(pixel: vec2<f32>) -> f32 {
    return (0.99 / 255.0) * (fract(52.9829189 * fract(dot(pixel, vec2<f32>(0.06711056, 0.00583715)))) - 0.5);
}

// `exposed` is radiance times 2^stops, `pixel` the fragment's place in the target.
fn display(exposed: vec3<f32>, pixel: vec2<f32>) -> vec3<f32> {
    if (CURVE == CURVE_LINEAR) {
        return min(exposed, vec3<f32>(65504.0));
    }
    var shown = clamp(exposed, vec3<f32>(0.0), vec3<f32>(1.0));
    if (CURVE == CURVE_FILMIC) {
        let white = hable(vec3<f32>(11.2));
        shown = clamp(hable(2.0 * max(exposed, vec3<f32>(0.0))) / white, vec3<f32>(0.0), vec3<f32>(1.0));
    }
    if (ENCODE) {
        return srgb_from_linear(shown) + dither(pixel);
    }
    if (DITHER) {
        // The target encodes: a code spans as much linear light as the inverse of its encoding is steep, 2.275 v^(7/12) above
        // the straight part, here within a tenth from v = 0.01 on, and a fifth more at the least.
        let root = sqrt(shown);
        return shown + dither(pixel) * max(2.275 * root * (0.725 + 0.275 * root), vec3<f32>(1.0 / 12.92));
    }
    return shown;
}
