// What parts and actors are covered with, how much of them is there, and how they are marked: `CoversUniform` in covering/uniform.rs. Prepended to stone.wgsl for
// what wears any of it. Drivers that draw on the processor leave no branch out, but they do leave loops: what is dear is a turn of a loop.

struct Cover {
    // Rows: from the world to its own space, in which what spreads over it stays where it is while it is carried.
    local_from_world: array<vec4<f32>, 3>,
    // Of two layers. xyz: where it began, w: 1 / how far it goes; where w is below 0 it rises from y, over -1 / w metres.
    front: array<vec4<f32>, 2>,
    // rgb: albedo, a: how far it has come.
    coat: array<vec4<f32>, 2>,
    // x: grain, y: metal.
    kind: array<vec4<f32>, 2>,
    // x: opacity, y: how much it is marked, z: mean luminance of its own albedo without a texture, w: 1 / the size of the patches in which a layer spreads.
    look: vec4<f32>,
    // Exposed radiance around it: the mean, and along each axis how it rises and how it bends.
    around: array<vec4<f32>, 7>,
}

struct Covers {
    // xyz: unit direction to the sun.
    sun_direction: vec4<f32>,
    // rgb: the sun's exposed irradiance at normal incidence / pi.
    sun_over_pi: vec4<f32>,
    // rgb: what marks shine in, exposed; a: their pulse, 0 to 1.
    mark: vec4<f32>,
    each: array<Cover, COVERS>,
}

@group(0) @binding(1) var<uniform> covers: Covers;

// Half of the breadth of a layer's edge, as a part of its way; and how much of the way is left to chance.
const COVER_EDGE: f32 = 0.008;
const COVER_CHANCE: f32 = 0.22;
// Burnished gold leaf: the square of its roughness, a, and the square of that (B. Walter, S. Marschner, H. Li, K. Torrance: "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007).
const COVER_ROUGH: f32 = 0.1225;
const COVER_ROUGH2: f32 = COVER_ROUGH * COVER_ROUGH;
// Sheets are beaten, not cast: dents a metre, and how steep they are.
const COVER_DENTS: f32 = 34.0;
const COVER_DENT_SLOPE: f32 = 0.055;
const COVER_PI: f32 = 3.14159265;

// A number in [0, 1) for each cell.
fn cover_chance(cell: vec3<i32>) -> f32 {
    let c = vec3<u32>(cell);
    var h = c.x * 0x9e3779b1u ^ c.y * 0x85ebca77u ^ c.z * 0xc2b2ae3du;
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12u)) * 0x297a2d39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

fn cover_noise(at: vec3<f32>) -> f32 {
    let first = floor(at);
    let off = at - first;
    let part = off * off * (3.0 - 2.0 * off);
    let cell = vec3<i32>(first);
    var sum = 0.0;
    for (var corner = 0; corner < 8; corner += 1) {
        let step = vec3<i32>(corner & 1, (corner >> 1u) & 1, corner >> 2u);
        let weights = select(1.0 - part, part, step == vec3<i32>(1));
        sum += weights.x * weights.y * weights.z * cover_chance(cell + step);
    }
    return sum;
}

fn cover_local(slot: u32, place: vec3<f32>) -> vec3<f32> {
    let at = vec4<f32>(place, 1.0);
    return vec3<f32>(
        dot(covers.each[slot].local_from_world[0], at),
        dot(covers.each[slot].local_from_world[1], at),
        dot(covers.each[slot].local_from_world[2], at),
    );
}

// How much of a layer is at a place: exactly 0 before it begins and 1 once it is all over.
fn cover_came(slot: u32, layer: u32, local: vec3<f32>) -> f32 {
    let amount = covers.each[slot].coat[layer].a;
    let front = covers.each[slot].front[layer];
    let risen = (local.y - front.y) * -front.w;
    let way = clamp(select(risen, length(local - front.xyz) * front.w, front.w > 0.0), 0.0, 1.0);
    var chance = 0.5;
    for (var turn = 0u; turn < select(0u, 1u, amount > 0.0 && amount < 1.0); turn += 1u) {
        let at = local * covers.each[slot].look.w;
        chance = 0.7 * cover_noise(at) + 0.3 * cover_noise(at * 3.1 + 17.0);
    }
    let turned = mix(way, chance, COVER_CHANCE);
    let reached = amount * (1.0 + 2.0 * COVER_EDGE) - COVER_EDGE;
    return smoothstep(turned - COVER_EDGE, turned + COVER_EDGE, reached);
}

fn cover_luminance(color: vec3<f32>) -> f32 {
    return dot(color, vec3<f32>(0.2126, 0.7152, 0.0722));
}

// rgb: an albedo beneath its covers, a: how much of it is metal. `mean`: of the texture that is in `own`.
fn cover_coated(slot: u32, own: vec3<f32>, mean: vec3<f32>, local: vec3<f32>) -> vec4<f32> {
    let shade = cover_luminance(own) / max(covers.each[slot].look.z * cover_luminance(mean), 1e-3);
    var coated = vec4<f32>(own, 0.0);
    for (var layer = 0u; layer < 2u; layer += 1u) {
        let kind = covers.each[slot].kind[layer];
        let coat = min(covers.each[slot].coat[layer].rgb * mix(1.0, shade, kind.x), vec3<f32>(1.0));
        coated = mix(coated, vec4<f32>(coat, kind.y), cover_came(slot, layer, local));
    }
    return coated;
}

// A normal with the dents of beaten metal, where a pixel is smaller than they are.
fn cover_dented(normal: vec3<f32>, local: vec3<f32>, pixel_m: f32) -> vec3<f32> {
    let fine = clamp(1.5 - 2.0 * pixel_m * COVER_DENTS, 0.0, 1.0);
    var slope = vec3<f32>(0.0);
    for (var axis = 0u; axis < select(0u, 3u, fine > 0.0); axis += 1u) {
        let step = 0.35 * select(vec3<f32>(0.0), vec3<f32>(1.0), vec3<u32>(0u, 1u, 2u) == vec3<u32>(axis));
        let at = local * COVER_DENTS;
        let rise = cover_noise(at + step) - cover_noise(at - step);
        slope += step * (rise / (0.7 * 0.35));
    }
    return normalize(normal - slope * (COVER_DENT_SLOPE * fine));
}

// Radiance from a direction.
fn cover_around(slot: u32, d: vec3<f32>) -> vec3<f32> {
    var sum = covers.each[slot].around[0].rgb;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        sum += (covers.each[slot].around[1u + axis].rgb + covers.each[slot].around[4u + axis].rgb * d[axis]) * d[axis];
    }
    return max(sum, vec3<f32>(0.0));
}

// Irradiance / pi that it gives a surface in the open (R. Ramamoorthi, P. Hanrahan, 2001: the bands count 1, 2/3 and 1/4).
fn cover_around_diffuse(slot: u32, n: vec3<f32>) -> vec3<f32> {
    var sum = covers.each[slot].around[0].rgb;
    for (var axis = 0u; axis < 3u; axis += 1u) {
        let slope = covers.each[slot].around[1u + axis].rgb * (2.0 / 3.0);
        sum += (slope + covers.each[slot].around[4u + axis].rgb * (0.25 * n[axis])) * n[axis];
    }
    return max(sum, vec3<f32>(0.0));
}

// What metal that reflects `f0` head on sends to the eye of light from one direction, for an irradiance of 1 (times its cosine).
fn cover_glint(f0: vec3<f32>, n: vec3<f32>, to_eye: vec3<f32>, to_light: vec3<f32>) -> vec3<f32> {
    let h = normalize(to_eye + to_light + n * 1e-4);
    let n_h = clamp(dot(n, h), 0.0, 1.0);
    let n_e = max(dot(n, to_eye), 1e-3);
    let n_l = max(dot(n, to_light), 1e-3);
    let spread = n_h * n_h * (COVER_ROUGH2 - 1.0) + 1.0;
    let facets = COVER_ROUGH2 / (COVER_PI * spread * spread);
    let shadows = 0.5 / (n_l * sqrt(n_e * n_e * (1.0 - COVER_ROUGH2) + COVER_ROUGH2) + n_e * sqrt(n_l * n_l * (1.0 - COVER_ROUGH2) + COVER_ROUGH2));
    return cover_fresnel(f0, clamp(dot(to_eye, h), 0.0, 1.0)) * (facets * shadows);
}

// C. Schlick: "An Inexpensive BRDF Model for Physically-based Rendering", 1994.
fn cover_fresnel(f0: vec3<f32>, cosine: f32) -> vec3<f32> {
    let left = 1.0 - cosine;
    let square = left * left;
    return f0 + (1.0 - f0) * (square * square * left);
}

// What metal reflects of what is around it. `rest`: the light of a surface there but for the direct sun and lamps' own shine. In the open that is the radiance around
// it; where most of that is hidden, its own light tells the brightness and the colour, and what is around only where it is brighter and darker: of a room with one
// bright side metal shows that side as a light. There metal also sees itself, and its colour deepens.
fn cover_reflected(slot: u32, f0: vec3<f32>, rest: vec3<f32>, n: vec3<f32>, to_eye: vec3<f32>) -> vec3<f32> {
    let r = normalize(2.0 * dot(n, to_eye) * n - to_eye);
    let open = cover_around_diffuse(slot, n);
    let seen = cover_around(slot, r);
    let brightness = max(cover_luminance(open), 1e-4);
    let left = min(cover_luminance(rest) / brightness, 1.0);
    let contrast = clamp(cover_luminance(seen) / brightness, 0.2, 3.0);
    let inside = rest * contrast * sqrt(contrast);
    let outside = max(rest + seen - open, 0.12 * rest) * mix(1.0, contrast, 0.4);
    let around = mix(inside, outside, left * left);
    let tint = mix(f0 * mix(vec3<f32>(1.0), f0, 0.45), f0, left * left);
    // rough metal brightens less at its edges (S. Lagarde, 2011)
    let edge = 1.0 - max(dot(n, to_eye), 1e-3);
    let edge2 = edge * edge;
    return (tint + (max(vec3<f32>(0.5), tint) - tint) * (edge2 * edge2 * edge)) * around;
}

// What is shown of something that is marked: its rim goes towards the mark's own brightness, so that it is seen in the dark and in the sun, the rest towards its
// colour; `facing`: the cosine to the eye.
fn cover_marked(slot: u32, shown: vec3<f32>, facing: f32) -> vec3<f32> {
    let mark = covers.each[slot].look.y;
    let rim = 1.0 - clamp(facing, 0.0, 1.0);
    let within = min(shown, vec3<f32>(mix(65504.0, 1.5, min(8.0 * mark, 1.0))));
    let tinted = covers.mark.rgb * min(0.16 + 1.2 * cover_luminance(within), 1.0);
    let filled = mix(within, tinted, mark * (0.1 + 0.25 * covers.mark.a));
    return mix(filled, covers.mark.rgb, mark * 0.55 * rim * rim);
}

// Whether a pixel of something faded is not there. Each thing has its own pattern, so that what stands behind is seen through what stands before it.
fn cover_gone(slot: u32, pixel: vec2<f32>) -> bool {
    let noise = fract(52.9829189 * fract(dot(floor(pixel), vec2<f32>(0.06711056, 0.00583715))) + 0.61803399 * f32(slot));
    return noise >= covers.each[slot].look.x;
}
