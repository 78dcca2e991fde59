// What is in the air: quads that face the eye, from the farthest on, into a picture of their own: exposed radiance, and the share of what is behind
// that they take away. compose.wgsl lays it over the picture. Written by particles/quad.rs and render.rs. Prepended: over_stone/camera.wgsl, and
// LEAST_PX and FORWARD of quad.rs.

struct Quad {
    // Its middle, w: half its width.
    place: vec4<f32>,
    // Unit direction along which it is longer, w: how many times; zero where it is round.
    along: vec4<f32>,
    // Exposed radiance, w: share of what is behind that it takes away in its middle.
    glow: vec4<f32>,
    // Exposed radiance that the sun adds, w: metres over which it goes into what is behind.
    sun: vec4<f32>,
    // Shape, random number, age, map of the sun or -1.
    what: vec4<f32>,
    // How much of what lamps send to it it sends on, as radiance of irradiance / pi.
    given: vec4<f32>,
}

// Where the sun shines in a box: `SunMap` of sun_map.rs.
struct Map {
    // Texels from the world.
    x: vec4<f32>,
    y: vec4<f32>,
    // Metres towards the sun.
    depth: vec4<f32>,
    // Columns, rows, first texel.
    size: vec4<u32>,
}

// x: pixels of the picture in one of ours.
@group(0) @binding(2) var<uniform> scale: vec4<f32>;
@group(1) @binding(0) var<storage, read> quads: array<Quad>;
@group(1) @binding(1) var<storage, read> order: array<u32>;
@group(1) @binding(2) var<storage, read> maps: array<Map>;
@group(1) @binding(3) var<storage, read> texels: array<f32>;

const MOTE: u32 = 0u;
const FLAME: u32 = 1u;
const SMOKE: u32 = 2u;
const HAZE: u32 = 3u;
const MARK: u32 = 4u;

// How far above and below its middle a disc on the ground is laid, as a part of its radius.
const MARK_HEIGHT: f32 = 0.8;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    // From the middle, one at the sides.
    @location(0) at: vec2<f32>,
    @location(1) world: vec3<f32>,
    @location(2) @interpolate(flat) glow: vec4<f32>,
    @location(3) @interpolate(flat) sun: vec4<f32>,
    @location(4) @interpolate(flat) what: vec4<f32>,
    // To the sun, across the quad, and towards the eye.
    @location(5) @interpolate(flat) sunward: vec3<f32>,
    @location(6) @interpolate(flat) place: vec4<f32>,
#ifdef LAMPS
    // Lamps that may light a disc of haze, a bit each, and what it gives of their light.
    @location(7) @interpolate(flat) lamps: u32,
    @location(8) @interpolate(flat) given: vec3<f32>,
#endif
}

// Henyey and Greenstein, "Diffuse radiation in the galaxy", 1941: of an isotropic medium 1 in every direction.
fn phase(cosine: f32) -> f32 {
    let g = FORWARD;
    let below = max(1.0 + g * g - 2.0 * g * cosine, 1e-4);
    return (1.0 - g * g) / (below * sqrt(below));
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Fragment {
    let quad = quads[order[number]];
    let shape = u32(quad.what.x);
    let to_eye = camera.eye.xyz - quad.place.xyz;
    let distance = max(length(to_eye), 1e-3);
    let facing = to_eye / distance;
    let upright = abs(facing.y) < 0.999;
    let level = normalize(select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(facing.z, 0.0, -facing.x), upright));
    var right = level;
    var up = cross(facing, right);
    var times = 1.0;
    if (quad.along.w > 1.0) {
        // as long as it is seen
        let seen = quad.along.xyz - facing * dot(quad.along.xyz, facing);
        let length_seen = length(seen);
        if (length_seen > 1e-3) {
            up = seen / length_seen;
            right = cross(up, facing);
        }
        times = max(1.0, quad.along.w * length_seen);
    } else if (shape == SMOKE) {
        let turn = 6.2831853 * quad.what.y + (quad.what.y - 0.5) * 3.0 * quad.what.z;
        right = level * cos(turn) + up * sin(turn);
        up = cross(facing, right);
    }
    var radius = quad.place.w;
    var fainter = 1.0;
    if (shape == MOTE) {
        let pixels = radius * camera.depth.z / distance;
        let grown = max(1.0, LEAST_PX * scale.x / max(pixels, 1e-4));
        radius *= grown;
        times = max(1.0, times / grown);
        fainter = 1.0 / (grown * select(grown, 1.0, times > 1.0));
    } else if (shape == MARK) {
        // the box around what it may be laid upon
        radius *= 1.3;
    }
    let xy = vec2<f32>(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0;
    let world = quad.place.xyz + (right * xy.x + up * (xy.y * times)) * radius;
    var out: Fragment;
    out.clip = camera.clip_from_world * vec4<f32>(world, 1.0);
    out.at = xy;
    out.world = world;
    let sun = camera.sun_direction.xyz;
    // light goes on to the eye as it came, more than aside
    let scattered = phase(dot(-facing, sun));
    // what is wholly about the eye would fill the picture
    let near = clamp(distance / max(2.0 * radius, 0.02) - 0.25, 0.0, 1.0);
    var glow = quad.glow;
#ifdef LAMPS
    out.lamps = 0u;
    if (any(quad.given.rgb > vec3<f32>(0.0))) {
        let lit_by = lamps_near(quad.place.xyz, radius * 1.42);
        if (shape == HAZE) {
            out.lamps = lit_by;
        } else if (shape == SMOKE) {
            glow += vec4<f32>(quad.given.rgb * lamps_scattered_in(lit_by, quad.place.xyz, radius, to_eye), 0.0);
        } else {
            glow += vec4<f32>(quad.given.rgb * lamps_scattered(lit_by, quad.place.xyz, to_eye), 0.0);
        }
    }
    out.given = quad.given.rgb * (fainter * near);
#endif
    out.glow = glow * (fainter * near);
    let by_phase = select(select(scattered, 0.55 + 0.45 * scattered, shape == SMOKE), 1.0, shape == MARK);
    out.sun = vec4<f32>(quad.sun.rgb * (by_phase * fainter * near), quad.sun.w);
    out.what = quad.what;
    out.sunward = vec3<f32>(dot(sun, right), dot(sun, up), dot(sun, facing));
    out.place = quad.place;
    return out;
}

// The part of the sun that reaches a place, between the four texels around it.
fn sun_at(number: i32, place: vec3<f32>) -> f32 {
    let map = maps[number];
    let world = vec4<f32>(place, 1.0);
    let at = vec2<f32>(dot(map.x, world), dot(map.y, world));
    let most = vec2<f32>(map.size.xy) - 1.0;
    if (any(at < vec2<f32>(0.0)) || any(at >= most)) {
        return 1.0;
    }
    let own = dot(map.depth, world);
    let low = vec2<u32>(at);
    let part = fract(at);
    let first = map.size.z + low.y * map.size.x + low.x;
    let below = vec2<f32>(texels[first], texels[first + 1u]);
    let above = vec2<f32>(texels[first + map.size.x], texels[first + map.size.x + 1u]);
    let lit = select(vec4<f32>(0.0), vec4<f32>(1.0), vec4<f32>(own) >= vec4<f32>(below, above));
    let across = mix(lit.xz, lit.yw, vec2<f32>(part.x));
    return mix(across.x, across.y, part.y);
}

// Dave Hoskins, "Hash without Sine", 2014.
fn hash(p: vec2<f32>) -> f32 {
    var q = fract(p.xyx * 0.1031);
    q += dot(q, q.yzx + 33.33);
    return fract((q.x + q.y) * q.z);
}

fn noise(p: vec2<f32>) -> f32 {
    let whole = floor(p);
    let part = fract(p);
    let eased = part * part * (3.0 - 2.0 * part);
    let below = mix(hash(whole), hash(whole + vec2<f32>(1.0, 0.0)), eased.x);
    let above = mix(hash(whole + vec2<f32>(0.0, 1.0)), hash(whole + vec2<f32>(1.0, 1.0)), eased.x);
    return mix(below, above, eased.y);
}

fn turbulence(p: vec2<f32>) -> f32 {
    return 0.57 * noise(p) + 0.29 * noise(p * 2.03 + 17.1) + 0.14 * noise(p * 4.1 + 5.7);
}

// A disc that is laid on the ground.
fn mark(in: Fragment, pixel: vec2<f32>) -> vec4<f32> {
    let off = (scene_place(pixel) - in.place.xyz) / in.place.w;
    let flat_r = length(off.xz);
    let above = clamp(1.0 - abs(off.y) / MARK_HEIGHT, 0.0, 1.0);
    // a bright rim and a soft middle
    let rim = (1.0 - smoothstep(0.86, 1.0, flat_r)) * smoothstep(0.55, 0.86, flat_r);
    let laid = (0.30 * (1.0 - smoothstep(0.2, 1.0, flat_r)) + 0.85 * rim) * above;
    return vec4<f32>(in.glow.rgb * laid, in.glow.a * laid);
}

// A tongue: round below, pointed above, torn by the air that streams past it, the more the higher and the older.
fn flame(in: Fragment, r: f32, before: f32) -> vec4<f32> {
    let seed = in.what.y * 61.0;
    let age = in.what.z;
    let lick = 0.5 + 0.5 * in.at.y;
    let flow = vec2<f32>(in.at.x * 1.3 + seed, in.at.y * 1.2 - 2.6 * age + seed * 1.7);
    let bent = turbulence(flow) - 0.5;
    let torn = turbulence(flow * 2.3 + 9.2) - 0.5;
    let wide = max(1.75 * sqrt(lick) * (1.0 - lick), 0.02);
    let inside = 1.0 - abs(in.at.x + 1.3 * bent * lick * (0.5 + age)) / wide;
    let rim = 1.0 - smoothstep(0.7, 1.0, r);
    // what has just begun to burn is clear
    let foot = smoothstep(0.0, 0.5 - 0.3 * age, lick);
    let heat = foot * rim * smoothstep(0.0, 0.75, inside + torn * (0.9 + 1.4 * age) - 0.35 * age);
    let hot = heat * (1.0 - 0.65 * age);
    let color = vec3<f32>(1.0, 0.12 + 0.42 * hot, 0.004 + 0.13 * hot * hot * hot) * (0.35 + 0.8 * hot);
    return vec4<f32>(in.glow.rgb * color * (0.6 * heat * before), in.glow.a * heat * before);
}

fn smoke(in: Fragment, r: f32, before: f32) -> vec4<f32> {
    let seed = in.what.y * 61.0;
    let torn = turbulence(in.at * 1.7 + vec2<f32>(seed, seed * 1.7 + in.what.z * 1.5));
    let profile = (1.0 - r * r);
    let cover = clamp(profile * (0.35 + 1.3 * torn) - 0.22 * (1.0 - profile), 0.0, 1.0);
    let whole = in.glow.a * cover * before;
    // lit as a ball is, softly: light goes through it and around
    let ball = vec3<f32>(in.at, sqrt(profile));
    let facing = clamp(0.5 + 0.5 * dot(ball, in.sunward) + 0.5 * (torn - 0.5), 0.0, 1.0);
    let light = in.glow.rgb * (0.8 + 0.4 * torn) + in.sun.rgb * (0.25 + 1.1 * facing);
    return vec4<f32>(light * whole, whole);
}

fn haze(in: Fragment, r: f32, before: f32) -> vec4<f32> {
    var lit = 1.0;
    if (in.what.w >= 0.0) {
        lit = sun_at(i32(in.what.w), in.world);
    }
    var light = in.sun.rgb * lit;
#ifdef LAMPS
    light += in.given * lamps_scattered(in.lamps, in.world, camera.eye.xyz - in.world);
#endif
    let soft = 1.0 - r * r;
    return vec4<f32>(light * (soft * soft * before), 0.0);
}

fn mote(in: Fragment, r: f32, before: f32) -> vec4<f32> {
    let soft = 1.0 - r * r;
    let spot = soft * soft;
    return vec4<f32>((in.glow.rgb + in.sun.rgb) * (spot * before), in.glow.a * spot * before);
}

fn turns(is_so: bool) -> u32 {
    return select(0u, 1u, is_so);
}

// A driver that draws on the processor walks every branch for every pixel, but leaves out a loop that none of some pixels goes through: each shape is one turn of one.
@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let pixel = in.clip.xy * scale.x;
    let shape = u32(in.what.x);
    let r = length(in.at);
    let own = dot(camera.forward.xyz, in.world) + camera.forward.w;
    let before = clamp((scene_depth(pixel) - own) / in.sun.w * 0.5 + 0.5, 0.0, 1.0);
    let is_seen = r < 1.0 && before > 0.0;
    var shown = vec4<f32>(0.0);
    for (var k = 0u; k < turns(shape == MARK); k += 1u) {
        shown = mark(in, pixel);
    }
    for (var k = 0u; k < turns(shape == FLAME && is_seen); k += 1u) {
        shown = flame(in, r, before);
    }
    for (var k = 0u; k < turns(shape == SMOKE && is_seen); k += 1u) {
        shown = smoke(in, r, before);
    }
    for (var k = 0u; k < turns(shape == HAZE && is_seen); k += 1u) {
        shown = haze(in, r, before);
    }
    for (var k = 0u; k < turns(shape == MOTE && is_seen); k += 1u) {
        shown = mote(in, r, before);
    }
    return shown;
}
