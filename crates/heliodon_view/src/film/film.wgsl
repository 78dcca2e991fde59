// Films on upright quads and on parts. Prepended: display.wgsl with its constants.
//
// G. Papaioannou, A. Gaitatzes, D. Christopoulos, "Enhancing Virtual Reality Walkthroughs of Archaeological Sites", VAST 2003, section 2.2, put an image onto what is
// there in two passes: what is there is multiplied by an inverted mask, then the image is added, black where nothing is. `mask_fragment` and `fragment` do that where they are blended so; blended as
// premultiplied colours, `fragment` does both at once. Cover and displayed colour are the same, so that only the rounding between the passes parts them.

struct Camera {
    clip_from_world: mat4x4<f32>,
    // xyz: the eye; in parallel projections a point far away towards it.
    eye: vec4<f32>,
    // Metres along forward: dot(xyz, place) + w.
    forward: vec4<f32>,
    // What is at depth z is (x * z + y) / (z + w) metres along forward.
    depth: vec4<f32>,
    sun_direction: vec4<f32>,
    sun_over_pi: vec4<f32>,
    shadow: vec4<f32>,
    world_from_clip: mat4x4<f32>,
    viewport: vec4<f32>,
}

struct Film {
    // xyz: the middle of its lower edge.
    place: vec4<f32>,
    // xyz: from there to its right edge; w: 0 opaque, 1 straight, 2 premultiplied.
    right: vec4<f32>,
    // xyz: to its upper edge.
    up: vec4<f32>,
    // rgb: exposed light at its lower edge, 1 as far as it shines by itself; w: how much it is lit.
    feet: vec4<f32>,
    // rgb: the same at its upper edge; w: the exposure's factor.
    head: vec4<f32>,
    // x, y: columns and rows of its texture; z: 1 where it repeats beyond its edges.
    size: vec4<f32>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
#ifdef ONE_SAMPLE
@group(0) @binding(1) var depth: texture_depth_2d;
#endif
#ifdef MANY_SAMPLES
@group(0) @binding(1) var depth: texture_depth_multisampled_2d;
#endif
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
const STRAIGHT: f32 = 1.0;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) world: vec3<f32>,
    @location(2) light: vec3<f32>,
    // Columns, rows, whether it repeats, kind.
    @location(3) @interpolate(flat) shape: vec4<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Fragment {
    let film = films[number];
    let side = vec2<f32>(f32(corner & 1u), f32(corner >> 1u));
    let world = film.place.xyz + film.right.xyz * (side.x * 2.0 - 1.0) + film.up.xyz * side.y;
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

// A texel, linear and premultiplied.
fn texel(place: vec2<i32>, size: vec2<i32>, repeats: bool) -> vec4<f32> {
    let around = ((place % size) + size) % size;
    let found = textureLoad(texels, select(clamp(place, vec2<i32>(0), size - 1), around, repeats), 0);
    return vec4<f32>(found.rgb * found.a, found.a);
}

// The film at a place, linear and premultiplied.
fn film_at(uv: vec2<f32>, shape: vec4<f32>) -> vec4<f32> {
    if (shape.w != STRAIGHT) {
        let found = textureSampleLevel(texels, texel_sampler, uv, 0.0);
        return vec4<f32>(found.rgb, select(found.a, 1.0, shape.w == OPAQUE));
    }
    // Straight colours mean nothing where nothing is, and are not to be mixed with those beside them.
    let size = vec2<i32>(shape.xy);
    let repeats = shape.z > 0.5;
    let at = uv * shape.xy - 0.5;
    let corner = vec2<i32>(floor(at));
    let part = at - floor(at);
    let upper = mix(texel(corner, size, repeats), texel(corner + vec2<i32>(1, 0), size, repeats), part.x);
    let lower = mix(texel(corner + vec2<i32>(0, 1), size, repeats), texel(corner + vec2<i32>(1, 1), size, repeats), part.x);
    return mix(upper, lower, part.y);
}

// What a pixel covers of the film: its mean over the pixel.
fn covered(uv: vec2<f32>, shape: vec4<f32>) -> vec4<f32> {
    let across = dpdx(uv);
    let down = dpdy(uv);
    let columns = clamp(ceil(length(across * shape.xy)), 1.0, MOST_TAPS);
    let rows = clamp(ceil(length(down * shape.xy)), 1.0, MOST_TAPS);
    var sum = vec4<f32>(0.0);
    for (var j = 0.0; j < rows; j += 1.0) {
        for (var i = 0.0; i < columns; i += 1.0) {
            sum += film_at(uv + across * ((i + 0.5) / columns - 0.5) + down * ((j + 0.5) / rows - 0.5), shape);
        }
    }
    return sum / (columns * rows);
}

fn scene_depth(pixel: vec2<f32>) -> f32 {
    let z = textureLoad(depth, vec2<i32>(pixel), 0);
    return (camera.depth.x * z + camera.depth.y) / (z + camera.depth.w);
}

// What is shown, premultiplied after the tone curve, for what is there has gone through it already: the curve of a sum is not the sum of curves.
fn shown(in: Fragment, before: f32) -> vec4<f32> {
    let found = covered(in.uv, in.shape);
    let whole = found.rgb / max(found.a, 1e-4);
    let cover = found.a * before;
    return vec4<f32>(display(whole * in.light, in.clip.xy) * cover, cover);
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
