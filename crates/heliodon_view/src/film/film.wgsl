// Films on upright quads and on parts. Prepended: display.wgsl with its constants, over_stone/camera.wgsl.
//
// G. Papaioannou, A. Gaitatzes, D. Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.2, put an image onto what is
// there in two passes: what is there is multiplied by an inverted mask, then the image is added, black where nothing is. `mask_fragment` and `fragment` do that where they are blended so; blended as
// premultiplied colours, `fragment` does both at once. Cover and displayed colour are the same, so that only the rounding between the passes parts them.

struct Film {
    // xyz: the middle of its lower edge.
    place: vec4<f32>,
    // xyz: from there to its right edge; w: 0 where it is opaque.
    right: vec4<f32>,
    // xyz: to its upper edge.
    up: vec4<f32>,
    // rgb: exposed light at its lower edge, 1 as far as it shines by itself; w: how much it is lit.
    feet: vec4<f32>,
    // rgb: the same at its upper edge; w: the exposure's factor.
    head: vec4<f32>,
    // rgb: exposed light of the sky on the ground beneath it; w: how far its shadow reaches, metres.
    sky: vec4<f32>,
    // rgb: exposed light of the sun (irradiance / pi) that reaches its feet, at normal incidence; w: how much of a shadow it casts.
    sun: vec4<f32>,
    // x, y: columns and rows of its texture; z: 1 where it repeats beyond its edges.
    size: vec4<f32>,
}

@group(1) @binding(0) var<storage, read> films: array<Film>;
@group(2) @binding(0) var texels: texture_2d<f32>;
@group(2) @binding(1) var texel_sampler: sampler;

// Metres of depth over which a film goes into the stone.
const SOFT_M: f32 = 0.04;
// Samples along each side of a pixel at the most: the texture has no coarser levels, which would have to be made for every picture.
const MOST_TAPS: f32 = 4.0;
// A part's film lies so much nearer to the eye than the part, as a share of its distance.
const ABOVE: f32 = 3e-4;

const OPAQUE: f32 = 0.0;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) world: vec3<f32>,
    @location(2) light: vec3<f32>,
    // Columns, rows, whether it repeats, kind.
    @location(3) @interpolate(flat) shape: vec4<f32>,
}

fn side_of_corner(corner: u32) -> vec2<f32> {
    return vec2<f32>(f32(corner & 1u), f32(corner >> 1u));
}

fn place_on(film: Film, side: vec2<f32>) -> vec3<f32> {
    return film.place.xyz + film.right.xyz * (side.x * 2.0 - 1.0) + film.up.xyz * side.y;
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Fragment {
    let film = films[number];
    let side = side_of_corner(corner);
    let world = place_on(film, side);
    let to_eye = camera.eye.xyz - world;
    let nearer = world + to_eye * (min(SOFT_M * 0.5, 0.5 * length(to_eye)) / max(length(to_eye), 1e-4));
    var out: Fragment;
    out.clip = camera.clip_from_world * vec4<f32>(world, 1.0);
    // As near as it still shows, so that the depth test leaves the soft edge.
    let front = camera.clip_from_world * vec4<f32>(nearer, 1.0);
    out.clip.z = select(out.clip.w, front.z / front.w * out.clip.w, front.w > 0.0 && front.z < front.w);
    out.uv = vec2<f32>(side.x, 1.0 - side.y);
    out.world = world;
    out.light = mix(film.feet.rgb, film.head.rgb, side.y);
    out.shape = vec4<f32>(film.size.xyz, film.right.w);
    return out;
}

@vertex
fn surface_vertex(
    @location(0) position: vec3<f32>,
    @location(1) uv: vec2<f32>,
    @location(2) light: vec3<f32>,
    @builtin(instance_index) number: u32,
) -> Fragment {
    let film = films[number];
    var out: Fragment;
    out.clip = camera.clip_from_world * vec4<f32>(position, 1.0);
    out.clip.z = min(out.clip.z * (1.0 + ABOVE), out.clip.w);
    out.uv = uv;
    out.world = position;
    out.light = mix(vec3<f32>(1.0), light * film.head.w, film.feet.w);
    out.shape = vec4<f32>(film.size.xyz, film.right.w);
    return out;
}

#ifdef STRAIGHT
// A texel, linear and premultiplied.
fn texel(place: vec2<i32>, size: vec2<i32>, repeats: bool) -> vec4<f32> {
    let around = ((place % size) + size) % size;
    let found = textureLoad(texels, select(clamp(place, vec2<i32>(0), size - 1), around, repeats), 0);
    return vec4<f32>(found.rgb * found.a, found.a);
}

// Straight colours mean nothing where nothing is, and are not to be mixed with those beside them.
fn film_at(uv: vec2<f32>, shape: vec4<f32>) -> vec4<f32> {
    let size = vec2<i32>(shape.xy);
    let repeats = shape.z > 0.5;
    let at = uv * shape.xy - 0.5;
    let corner = vec2<i32>(floor(at));
    let part = at - floor(at);
    let upper = mix(texel(corner, size, repeats), texel(corner + vec2<i32>(1, 0), size, repeats), part.x);
    let lower = mix(texel(corner + vec2<i32>(0, 1), size, repeats), texel(corner + vec2<i32>(1, 1), size, repeats), part.x);
    return mix(upper, lower, part.y);
}
#endif
#ifdef READY
fn film_at(uv: vec2<f32>, shape: vec4<f32>) -> vec4<f32> {
    let found = textureSampleLevel(texels, texel_sampler, uv, 0.0);
    return vec4<f32>(found.rgb, select(found.a, 1.0, shape.w == OPAQUE));
}
#endif

// What a pixel covers of the film: its mean over the pixel.
fn covered(uv: vec2<f32>, shape: vec4<f32>) -> vec4<f32> {
    let across = dpdx(uv);
    let down = dpdy(uv);
    // each tap is the mean of what lies between four texels
    let columns = clamp(ceil(0.5 * length(across * shape.xy)), 1.0, MOST_TAPS);
    let rows = clamp(ceil(0.5 * length(down * shape.xy)), 1.0, MOST_TAPS);
    var sum = vec4<f32>(0.0);
    for (var j = 0.0; j < rows; j += 1.0) {
        for (var i = 0.0; i < columns; i += 1.0) {
            sum += film_at(uv + across * ((i + 0.5) / columns - 0.5) + down * ((j + 0.5) / rows - 0.5), shape);
        }
    }
    return sum / (columns * rows);
}

// What is shown, premultiplied after the tone curve, for what is there has gone through it already: the curve of a sum is not the sum of curves.
fn shown(in: Fragment, before: f32) -> vec4<f32> {
    let found = covered(in.uv, in.shape);
    let cover = found.a * before;
    var seen = vec4<f32>(0.0);
    // Most of a film covers nothing: one turn of a loop, which processors leave out where a branch is always walked.
    let turns = select(0u, 1u, cover > 0.0);
    for (var k = 0u; k < turns; k += 1u) {
        seen = vec4<f32>(display(found.rgb / max(found.a, 1e-4) * in.light, in.clip.xy) * cover, cover);
    }
    return seen;
}

fn softened(in: Fragment) -> vec4<f32> {
    let own = dot(camera.forward.xyz, in.world) + camera.forward.w;
    return shown(in, clamp((scene_depth(in.clip.xy) - own) / SOFT_M + 0.5, 0.0, 1.0));
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    return softened(in);
}

@fragment
fn mask_fragment(in: Fragment) -> @location(0) vec4<f32> {
    return vec4<f32>(1.0 - softened(in).a);
}

@fragment
fn surface_fragment(in: Fragment) -> @location(0) vec4<f32> {
    return shown(in, 1.0);
}

@fragment
fn surface_mask_fragment(in: Fragment) -> @location(0) vec4<f32> {
    return vec4<f32>(1.0 - shown(in, 1.0).a);
}

struct Solid {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) kind: f32,
}

// For what is drawn later: where a film that stands covers what is behind it.
@vertex
fn solid_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Solid {
    let film = films[number];
    let side = side_of_corner(corner);
    return Solid(camera.clip_from_world * vec4<f32>(place_on(film, side), 1.0), vec2<f32>(side.x, 1.0 - side.y), film.right.w);
}

@fragment
fn solid_fragment(in: Solid) {
    if (in.kind != OPAQUE && textureSampleLevel(texels, texel_sampler, in.uv, 0.0).a < 0.5) {
        discard;
    }
}

// Around what stands on the ground the sky is darker so far, metres.
const FEET_M: f32 = 0.35;
// Of the lower edge so much counts as standing, metres: soles are seen from above.
const SOLE_M: f32 = 0.12;

struct Shadow {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) number: u32,
}

fn side_of(film: Film) -> vec3<f32> {
    return film.right.xyz / max(length(film.right.xyz), 1e-4);
}

// The upright plane that stands for the film where the sun is concerned: half turned to the sun, so that it never casts a line, and feet stay where they are by and large.
fn caster(side: vec3<f32>) -> vec3<f32> {
    let own = vec3<f32>(-side.z, 0.0, side.x);
    let sun = vec3<f32>(camera.sun_direction.x, 0.0, camera.sun_direction.z);
    let toward = sun * inverseSqrt(max(dot(sun, sun), 1e-8));
    return normalize(select(-own, own, dot(own, toward) >= 0.0) + toward);
}

@vertex
fn shadow_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Shadow {
    let film = films[number];
    let normal = caster(side_of(film));
    let right = vec3<f32>(normal.z, 0.0, -normal.x);
    let sun = camera.sun_direction.xyz;
    let side = box_corner(corner);
    let before = FEET_M / max(dot(normal, sun), 0.3);
    let across = (side.x * 2.0 - 1.0) * (length(film.right.xyz) + FEET_M);
    let upward = mix(-before * sun.y - 0.1, film.up.y, side.y);
    let along = mix(-film.sky.w, before, side.z);
    var out: Shadow;
    out.clip = camera.clip_from_world * vec4<f32>(film.place.xyz + right * across + vec3<f32>(0.0, upward, 0.0) + sun * along, 1.0);
    out.number = number;
    return out;
}

// The film's cover around a place on it, in metres from the middle of its lower edge: the mean over a cross of this half width.
fn cover_around(film: Film, at: vec2<f32>, wide_m: vec2<f32>) -> f32 {
    let size = vec2<f32>(2.0 * length(film.right.xyz), film.up.y);
    var sum = 0.0;
    for (var k = 0; k < 9; k += 1) {
        let tap = at + wide_m * vec2<f32>(f32(k % 3 - 1), f32(k / 3 - 1));
        let uv = vec2<f32>(tap.x / size.x + 0.5, 1.0 - tap.y / size.y);
        let inside = all(abs(uv - 0.5) <= vec2<f32>(0.5));
        let found = select(textureSampleLevel(texels, texel_sampler, uv, 0.0).a, 1.0, film.right.w == OPAQUE);
        sum += select(0.0, found, inside);
    }
    return sum / 9.0;
}

// What a film leaves of the light of what is behind: the sun's, that has not passed, and some of the sky's where it stands. What is already there is multiplied by it.
@fragment
fn shadow_fragment(in: Shadow) -> @location(0) vec4<f32> {
    let world = scene_place(in.clip.xy);
    // of what is seen there, towards the eye: the picture's y points down
    let across = cross(dpdy(world), dpdx(world));
    let film = films[in.number];
    let off = world - film.place.xyz;
    let side = side_of(film);
    let normal = caster(side);
    let sun = camera.sun_direction.xyz;
    // where the way to the sun meets the plane, and how long it is
    let way = -dot(off, normal) / max(dot(normal, sun), 1e-3);
    let met = off + sun * way;
    let right = vec3<f32>(normal.z, 0.0, -normal.x);
    let turned = select(-1.0, 1.0, dot(right, side) >= 0.0);
    // the sun is half a degree wide
    let penumbra = vec2<f32>(0.006 + 0.0045 * way);
    let own = vec3<f32>(-side.z, 0.0, side.x);
    let far = length(vec2<f32>(dot(off, own), 1.5 * off.y)) / FEET_M;
    var left = vec3<f32>(1.0);
    let turns = select(0u, 1u, far < 1.0 || (way > 0.0 && way < film.sky.w && met.y < film.up.y));
    for (var k = 0u; k < turns; k += 1u) {
        let n = across * inverseSqrt(max(dot(across, across), 1e-20));
        let cover = select(0.0, cover_around(film, vec2<f32>(dot(met, right) * turned, met.y), penumbra), way > 0.0);
        let sole = cover_around(film, vec2<f32>(dot(off, side), 0.5 * SOLE_M), vec2<f32>(0.3 * FEET_M, 0.45 * SOLE_M));
        let stands = 0.75 * min(1.6 * sole, 1.0) * pow(max(1.0 - far, 0.0), 2.0);
        let direct = film.sun.rgb * max(dot(n, sun), 0.0);
        left = (film.sky.rgb * (1.0 - stands) + direct * (1.0 - cover)) / max(film.sky.rgb + direct, vec3<f32>(1e-6));
    }
    return vec4<f32>(mix(vec3<f32>(1.0), clamp(left, vec3<f32>(0.0), vec3<f32>(1.0)), film.sun.w), 1.0);
}
