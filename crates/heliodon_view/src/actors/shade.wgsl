// What actors take from the stone's light: the direct sun behind them, and the sky that they hide. `ShadeUniform` in actors/shade.rs.
// Prepended to stone.wgsl where there are actors.

const ACTORS: u32 = 8u;
const SPHERES: u32 = 24u;

struct Shade {
    // rgb: the sun's irradiance at normal incidence / pi, times exposure.
    sun_over_pi: vec4<f32>,
    // xyz: unit direction to the sun.
    sun_direction: vec4<f32>,
    // x: actors.
    count: vec4<u32>,
    // World to a tile of the map: x and y in texture coordinates, z the depth from the sun.
    tile_from_world: array<mat4x4<f32>, 8>,
    // xyz: the middle of an actor, w: the square of how far its darkness of the sky reaches.
    reach: array<vec4<f32>, 8>,
    // x: the square of the radius around an actor.
    radius: array<vec4<f32>, 8>,
    // The tile's least and greatest texture coordinates.
    tile: array<vec4<f32>, 8>,
    // Centres and radii, SPHERES for each actor; the rest have no radius.
    spheres: array<vec4<f32>, 192>,
}

@group(1) @binding(0) var<uniform> shade: Shade;
@group(1) @binding(1) var sun_depth: texture_depth_2d;
@group(1) @binding(2) var sun_compare: sampler_comparison;

// How much of the sun passes an actor: a disc of samples as wide as the sun's penumbra behind somebody's shoulder.
fn sun_passes(actor: u32, place: vec3<f32>) -> f32 {
    let at = shade.tile_from_world[actor] * vec4<f32>(place, 1.0);
    let tile = shade.tile[actor];
    if (any(at.xy < tile.xy) || any(at.xy > tile.zw) || at.z > 1.0) {
        return 1.0;
    }
    let texel = 1.25 / vec2<f32>(textureDimensions(sun_depth));
    var sum = 0.0;
    for (var y = -1; y <= 1; y += 1) {
        for (var x = -1; x <= 1; x += 1) {
            sum += textureSampleCompareLevel(sun_depth, sun_compare, at.xy + vec2<f32>(f32(x), f32(y)) * texel, at.z);
        }
    }
    return sum / 9.0;
}

// How much of the sky an actor leaves to a surface: each of its spheres takes the solid angle that it has there, weighted by its cosine
// (an even sky, and a sphere above the horizon: (r / d)^2 cos; spheres that the horizon cuts, by where their middle would be).
fn sky_passes(actor: u32, place: vec3<f32>, normal: vec3<f32>, square_off: f32) -> f32 {
    var taken = 0.0;
    for (var i = actor * SPHERES; i < (actor + 1u) * SPHERES; i += 1u) {
        let sphere = shade.spheres[i];
        let to = sphere.xyz - place;
        let square = max(dot(to, to), 1e-6);
        let size = sphere.w * sphere.w / max(square, sphere.w * sphere.w);
        let cosine = dot(normal, to) * inverseSqrt(square);
        let sine = sqrt(size);
        // below the horizon by its own radius it is gone
        let shown = clamp((cosine + sine) / max(2.0 * sine, 1e-4), 0.0, 1.0);
        taken += size * max(mix(0.5 * (cosine + sine), cosine, shown), 0.0) * shown;
    }
    // Spheres hide one another: what is left is not 1 - taken, but as if they lay there without order. It fades out where it would be cut off.
    let edge = 1.0 - square_off / shade.reach[actor].w;
    return exp(-taken * clamp(4.0 * edge, 0.0, 1.0));
}

// `light` is all of it; `sun` of the sun's irradiance / pi in it comes straight from the sun.
fn shaded(light: vec3<f32>, sun: f32, place: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let direct = min(sun * shade.sun_over_pi.rgb, light);
    var from_sun = 1.0;
    var from_sky = 1.0;
    for (var actor = 0u; actor < shade.count.x; actor += 1u) {
        // Most of the stone is near no actor, and behind none.
        let off = shade.reach[actor].xyz - place;
        let square_off = dot(off, off);
        let along = dot(off, shade.sun_direction.xyz);
        let near = along > 0.0 || square_off < shade.radius[actor].x;
        if (sun > 0.0 && near && square_off - along * along < shade.radius[actor].x) {
            from_sun = min(from_sun, sun_passes(actor, place));
        }
        if (square_off < shade.reach[actor].w) {
            from_sky *= sky_passes(actor, place, normal, square_off);
        }
    }
    return direct * from_sun + (light - direct) * from_sky;
}
