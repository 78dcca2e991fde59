// Lamps' light on what is in the air. Prepended to air.wgsl after lamps/shared.wgsl, where there are lamps.

@group(2) @binding(0) var<uniform> lamps: Lamps;
@group(2) @binding(1) var lamp_stone: texture_depth_2d;
@group(2) @binding(2) var lamp_actors: texture_depth_2d;

// A flame is no point: square metres that are added to the square of the distance. `FLAME_M` of particles/light.rs.
const LAMP_FLAME_M2: f32 = 0.1225;

// Lamps that may light something within `radius` of a place, a bit each.
fn lamps_near(place: vec3<f32>, radius: f32) -> u32 {
    var near = 0u;
    for (var lamp = 0u; lamp < LAMPS; lamp += 1u) {
        let away = place - lamps.place[lamp].xyz;
        let square = dot(away, away);
        let beyond = max(sqrt(square) - radius, 0.0);
        let edge = lamps.cone[lamp].w;
        let ahead = dot(away, lamps.cone[lamp].xyz);
        // how far outside the cone's side
        let outside = sqrt(max(square - ahead * ahead, 0.0)) * edge - ahead * sqrt(max(1.0 - edge * edge, 0.0));
        near |= select(0u, 1u << lamp, beyond * beyond * lamps.place[lamp].w < 1.0 && outside < radius);
    }
    return near;
}

// Whether a lamp's light reaches a place that is `away` from it, past stone and actors.
fn lamp_reaches(lamp: u32, place: vec3<f32>, away: vec3<f32>) -> f32 {
    let shadow = lamps.shadow[lamp];
    let tile = lamp_tile(shadow, away);
    let clip = lamps.clip_from_world[tile] * vec4<f32>(place, 1.0);
    let at = clip.xyz / max(clip.w, 1e-6);
    let texel = vec2<i32>(lamp_texel(tile, at.xy) + 0.5);
    let there = min(textureLoad(lamp_stone, texel, 0), textureLoad(lamp_actors, texel, 0));
    return select(0.0, 1.0, shadow.x < 0.0 || clip.w <= 0.0 || at.z - LAMP_BIAS <= there);
}

// Exposed irradiance / pi at normal incidence from a lamp, on its way to the eye as much as `phase` says.
fn lamp_scattered(lamp: u32, place: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    let away = place - lamps.place[lamp].xyz;
    let square = max(dot(away, away), 1e-4);
    let falls = lamp_falls(lamp, -away) * square / (square + LAMP_FLAME_M2) * lamp_reaches(lamp, place, away);
    let cosine = dot(away, to_eye) * inverseSqrt(square * max(dot(to_eye, to_eye), 1e-6));
    return lamps.light[lamp].rgb * (falls * phase(cosine));
}

// From all of these lamps.
fn lamps_scattered(near: u32, place: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    var left = near;
    while (left != 0u) {
        let lamp = firstTrailingBit(left);
        left &= left - 1u;
        sum += lamp_scattered(lamp, place, to_eye);
    }
    return sum;
}

// The same for a ball: the mean of its middle and eight places in it, so that it goes into the shade by and by.
fn lamps_scattered_in(near: u32, place: vec3<f32>, radius: f32, to_eye: vec3<f32>) -> vec3<f32> {
    var sum = lamps_scattered(near, place, to_eye);
    for (var corner = 0u; corner < select(0u, 8u, near != 0u); corner += 1u) {
        let side = vec3<f32>(vec3<u32>(corner, corner >> 1u, corner >> 2u) & vec3<u32>(1u)) - 0.5;
        sum += lamps_scattered(near, place + side * radius, to_eye);
    }
    return sum / 9.0;
}
