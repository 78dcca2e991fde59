// What actors take from the stone's light, and from one another's: the direct sun behind them, and the sky that they hide. `ShadeUniform` in
// actors/shade.rs. Prepended to stone.wgsl where there are actors.
//
// Most of a picture is near no actor and behind none. A driver that draws on the processor leaves no branch out, but it does leave loops: whatever is
// dear is therefore one turn of a loop that is not entered again.

const ACTORS: u32 = 8u;
const SPHERES: u32 = 24u;
const MERGED: u32 = 6u;
const ALL_SPHERES: u32 = 30u;
const TILES_ACROSS: u32 = 4u;
const TILE_PX: f32 = 512.0;
// Half of a tile, without the margin into which nothing casts, for half a tile.
const INSIDE: f32 = 506.0 / 512.0;
const SHADOW_M: f32 = 200.0;

struct Shade {
    // rgb: the sun's irradiance at normal incidence / pi, times exposure.
    sun_over_pi: vec4<f32>,
    // Unit axes of the world: two across the sun's light, the tiles' right and up, and one along it.
    right: vec4<f32>,
    up: vec4<f32>,
    along: vec4<f32>,
    // xyz: an actor's middle in these axes; w: half the width of its tile in metres, below 0 where there is none.
    tiles: array<vec4<f32>, 8>,
    // xyz: the middle of an actor, w: the square of how far its darkness of the sky reaches.
    reach: array<vec4<f32>, 8>,
    // x: the square of how far from its middle its spheres are merged; y: how much of it is there.
    far: array<vec4<f32>, 8>,
    // Centres and radii, for each actor SPHERES and as many MERGED ones; the rest have no radius.
    spheres: array<vec4<f32>, 240>,
}

@group(1) @binding(0) var<uniform> shade: Shade;
@group(1) @binding(1) var sun_depth: texture_depth_2d;

// Sixteen samples around a point `part` of a texel beyond the one that they begin at, and what each weighs: a square of three texels around it.
fn tap_step(tap: u32) -> vec2<i32> {
    return vec2<i32>(vec2<u32>(tap % 4u, tap / 4u)) - 1;
}

fn tap_weight(tap: u32, part: vec2<f32>) -> f32 {
    let step = tap_step(tap);
    let weights = select(vec2<f32>(1.0), part, step == vec2<i32>(2)) - select(vec2<f32>(0.0), part, step == vec2<i32>(-1));
    return weights.x * weights.y / 9.0;
}

// How much of the sun passes an actor at a place in the sun's axes: three texels square, which is as wide as the sun's penumbra behind somebody's shoulder.
fn sun_passes(actor: u32, at: vec3<f32>) -> f32 {
    let middle = shade.tiles[actor];
    let off = (at - middle.xyz) / middle.w;
    let tile = vec2<f32>(f32(actor % TILES_ACROSS), f32(actor / TILES_ACROSS));
    let px = (tile + 0.5 + vec2<f32>(0.5, -0.5) * off.xy) * TILE_PX - 0.5;
    // Behind the map's last depth as in it.
    let depth = min((at.z - middle.z + middle.w) / SHADOW_M, 1.0);
    let first = floor(px);
    let part = px - first;
    let inside = all(abs(off.xy) < vec2<f32>(INSIDE));
    let taps = select(0u, 16u, inside);
    var lit = 0.0;
    for (var tap = 0u; tap < taps; tap += 1u) {
        let there = textureLoad(sun_depth, vec2<i32>(first) + tap_step(tap), 0);
        lit += select(0.0, tap_weight(tap, part), depth <= there);
    }
    return select(1.0, lit, inside);
}

// How much of the sky an actor leaves to a surface: each of its spheres takes the solid angle that it has there, weighted by its cosine
// (an even sky, and a sphere above the horizon: (r / d)^2 cos; spheres that the horizon cuts, by where their middle would be).
fn sky_passes(actor: u32, place: vec3<f32>, normal: vec3<f32>) -> f32 {
    let reach = shade.reach[actor];
    let off = reach.xyz - place;
    let square_off = dot(off, off);
    let edge = 1.0 - square_off / reach.w;
    // From afar four of them are one.
    let is_far = square_off > shade.far[actor].x;
    let first = actor * ALL_SPHERES + select(0u, SPHERES, is_far);
    let count = select(select(SPHERES, MERGED, is_far), 0u, edge <= 0.0);
    var taken = 0.0;
    for (var i = first; i < first + count; i += 1u) {
        let sphere = shade.spheres[i];
        let to = sphere.xyz - place;
        let nearness = inverseSqrt(max(dot(to, to), 1e-6));
        let sine = min(sphere.w * nearness, 1.0);
        let above = dot(normal, to);
        // below the horizon by its own radius it is gone
        let shown = clamp(0.5 + 0.5 * above / max(sphere.w, 1e-4), 0.0, 1.0);
        let cosine = above * nearness;
        taken += sine * sine * max(mix(0.5 * (cosine + sine), cosine, shown), 0.0) * shown;
    }
    // Spheres hide one another: what is left is not 1 - taken, but as if they lay there without order. It fades out where it would be cut off.
    return exp(-taken * clamp(4.0 * edge, 0.0, 1.0));
}

// What actors left of the sun where `shaded` was asked last.
var<private> sun_left: f32 = 1.0;

// `light` is all of it; `sun` of the sun's irradiance / pi in it comes straight from the sun. `own` is the number of the actor, from 1, on whose surface
// this is: what it takes from itself is in its light already. 0 for stone.
fn shaded(light: vec3<f32>, sun: f32, place: vec3<f32>, normal: vec3<f32>, own: u32) -> vec3<f32> {
    let at = vec3<f32>(dot(shade.right.xyz, place), dot(shade.up.xyz, place), dot(shade.along.xyz, place));
    var suns = 0u;
    var skies = 0u;
    for (var actor = 0u; actor < ACTORS; actor += 1u) {
        let bit = select(1u << actor, 0u, actor + 1u == own);
        let off = at - shade.tiles[actor].xyz;
        let half_width = shade.tiles[actor].w;
        let behind = max(abs(off.x), abs(off.y)) < half_width && off.z > -half_width;
        suns |= select(0u, bit, behind && sun > 0.0);
        let to = shade.reach[actor].xyz - place;
        skies |= select(0u, bit, dot(to, to) < shade.reach[actor].w);
    }
    var from_sun = 1.0;
    while (suns != 0u) {
        let actor = firstTrailingBit(suns);
        suns &= suns - 1u;
        from_sun = min(from_sun, mix(1.0, sun_passes(actor, at), shade.far[actor].y));
    }
    var from_sky = 1.0;
    while (skies != 0u) {
        let actor = firstTrailingBit(skies);
        skies &= skies - 1u;
        from_sky *= sky_passes(actor, place, normal);
    }
    sun_left = from_sun;
    let direct = min(sun * shade.sun_over_pi.rgb, light);
    return direct * from_sun + (light - direct) * from_sky;
}
