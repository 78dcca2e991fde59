// The light of lamps on surfaces. Prepended to stone.wgsl, after actors/shade.wgsl and lamps/shared.wgsl, where there are lamps.

// How far off the surface, in texels, a shadow is looked for: two, as far as samples are taken, where light grazes it, and a little for rounding.
const LAMP_OFFSET: vec2<f32> = vec2<f32>(0.3, 2.0);

@group(1) @binding(2) var<uniform> lamps: Lamps;
@group(1) @binding(3) var lamp_stone: texture_depth_2d;
@group(1) @binding(4) var lamp_actors: texture_depth_2d;

#ifdef COVERED
// What metal sends to the eye of it, where `lamp_light` was asked last.
var<private> lamp_shine: vec3<f32>;
#endif

// How much of a lamp's light passes stone and actors, `to` the lamp.
fn lamp_passes(lamp: u32, place: vec3<f32>, normal: vec3<f32>, to: vec3<f32>) -> f32 {
    let shadow = lamps.shadow[lamp];
    let casts = shadow.x >= 0.0;
    let tile = lamp_tile(shadow, -to);
    // The more obliquely light falls, the farther off the surface.
    let cosine = clamp(dot(normal, to) * inverseSqrt(dot(to, to)), 0.0, 1.0);
    let off = normal * (dot(LAMP_OFFSET, vec2<f32>(1.0, sqrt(1.0 - cosine * cosine))) * shadow.z * length(to));
    let clip = lamps.clip_from_world[tile] * vec4<f32>(place + off, 1.0);
    let at = clip.xyz / clip.w;
    let px = lamp_texel(tile, at.xy);
    let first = floor(px);
    let part = px - first;
    let depth = at.z - LAMP_BIAS;
    var lit = 0.0;
    for (var tap = 0u; tap < select(0u, 16u, casts); tap += 1u) {
        let texel = vec2<i32>(first) + tap_step(tap);
        let there = min(textureLoad(lamp_stone, texel, 0), textureLoad(lamp_actors, texel, 0));
        lit += select(0.0, tap_weight(tap, part), depth <= there);
    }
    return select(1.0, lit, casts);
}

// Irradiance / pi from all lamps on a surface with this unit normal.
#ifdef COVERED
fn lamp_light(place: vec3<f32>, normal: vec3<f32>, f0: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    lamp_shine = vec3<f32>(0.0);
#endif
#ifdef BARE
fn lamp_light(place: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
#endif
    var near = 0u;
    for (var lamp = 0u; lamp < LAMPS; lamp += 1u) {
        let to = lamps.place[lamp].xyz - place;
        let within = dot(to, to) * lamps.place[lamp].w < 1.0;
        let in_cone = -dot(to, lamps.cone[lamp].xyz) > lamps.cone[lamp].w * length(to);
        near |= select(0u, 1u << lamp, within && in_cone && dot(to, normal) > 0.0);
    }
    var sum = vec3<f32>(0.0);
    while (near != 0u) {
        let lamp = firstTrailingBit(near);
        near &= near - 1u;
        let to = lamps.place[lamp].xyz - place;
        let square = max(dot(to, to), 1e-4);
        let falls = max(dot(normal, to) * inverseSqrt(square), 0.0) * lamp_falls(lamp, to);
        let reaches = lamps.light[lamp].rgb * (falls * lamp_passes(lamp, place, normal, to));
        sum += reaches;
#ifdef COVERED
        lamp_shine += reaches * COVER_PI * cover_glint(f0, normal, to_eye, to * inverseSqrt(square));
#endif
    }
    return sum;
}
