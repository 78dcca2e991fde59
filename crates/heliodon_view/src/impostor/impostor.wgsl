// Image-based people: a quad for each, on which the views around the eye are blended, each where the eye's ray meets what it shows.
// heliodon_bundle::impostor::Look is the reference. Prepended: display.wgsl with its constants, and `MULTISAMPLED`, `STEPS`.

struct Camera {
    clip_from_world: mat4x4<f32>,
    // xyz: the eye; in parallel projections a point far away towards it.
    eye: vec4<f32>,
    // Metres along forward: dot(xyz, place) + w.
    forward: vec4<f32>,
    // What is at depth z is (x * z + y) / (z + w) metres along forward; z: pixels that one metre at one metre has.
    depth: vec4<f32>,
    sun_direction: vec4<f32>,
    // rgb: exposed irradiance of the sun at normal incidence / pi.
    sun_over_pi: vec4<f32>,
}

struct Person {
    // xyz: the model's middle in the world, w: its scale.
    place: vec4<f32>,
    // Sine and cosine of its turn about +Y; the corner of its frame in a layer, from 0 to 1.
    turn: vec4<f32>,
    // Exposed light on surfaces that face +X -X +Y -Y +Z -Z; w of the first three: how much of the sun reaches its feet, its middle, its head.
    light: array<vec4<f32>, 6>,
}

struct View {
    // Right, up, towards the view in the model's space; w of the first two: its window's left and top edge along them.
    right: vec4<f32>,
    up: vec4<f32>,
    toward: vec4<f32>,
    // x, y: 1 / the window's sides in metres.
    window: vec4<f32>,
}

struct Kind {
    // x: no part is farther from the middle, y: nor from the vertical through it, z: nor above or below; metres.
    reach: vec4<f32>,
    // x, y: sides of a frame in a layer; z: texels of a metre; w: the coarsest level.
    frame: vec4<f32>,
    views: array<View, 128>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
#ifdef ONE_SAMPLE
@group(0) @binding(1) var depth: texture_depth_2d;
#endif
#ifdef MANY_SAMPLES
@group(0) @binding(1) var depth: texture_depth_multisampled_2d;
#endif
@group(1) @binding(0) var<storage, read> people: array<Person>;
// A person's number, four views in eight bits each, four weights in sixteen.
@group(1) @binding(1) var<storage, read> order: array<vec4<u32>>;
@group(2) @binding(0) var<uniform> kind: Kind;
@group(2) @binding(1) var texels: texture_2d_array<f32>;
@group(2) @binding(2) var texel_sampler: sampler;

// Metres of depth over which somebody goes into the stone.
const SOFT_M: f32 = 0.04;
// Rays more aslant to a picture than this, as the cosine, are not followed to its depth.
const ASLANT: f32 = 0.3;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    // From the model's middle in its space: the place on the quad, and the eye.
    @location(0) at: vec3<f32>,
    @location(1) @interpolate(flat) eye: vec3<f32>,
    // Of `order`; its first is the texture's level as a float's bits.
    @location(2) @interpolate(flat) seen: vec4<u32>,
    // Of the person. A driver that draws on the processor reads these many times as fast as a buffer.
    @location(3) @interpolate(flat) turn: vec4<f32>,
    @location(4) @interpolate(flat) place: vec4<f32>,
    @location(5) @interpolate(flat) light_0: vec4<f32>,
    @location(6) @interpolate(flat) light_1: vec4<f32>,
    @location(7) @interpolate(flat) light_2: vec4<f32>,
    @location(8) @interpolate(flat) light_3: vec4<f32>,
    @location(9) @interpolate(flat) light_4: vec4<f32>,
    @location(10) @interpolate(flat) light_5: vec4<f32>,
}

// From the world's directions to the model's.
fn to_model(turn: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(turn.y * v.x - turn.x * v.z, v.y, turn.x * v.x + turn.y * v.z);
}

fn to_world(turn: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(turn.y * v.x + turn.x * v.z, v.y, turn.y * v.z - turn.x * v.x);
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Fragment {
    let seen = order[number];
    let turn = people[seen.x].turn;
    let place = people[seen.x].place;
    let to_eye = camera.eye.xyz - place.xyz;
    let distance = max(length(to_eye), 1e-3);
    let facing = to_eye / distance;
    let level_right = vec3<f32>(facing.z, 0.0, -facing.x);
    let upright = length(level_right);
    let right = select(level_right / upright, vec3<f32>(1.0, 0.0, 0.0), upright < 1e-3);
    let up = cross(facing, right);
    // What is nearer to the eye than the middle looks larger.
    let reach = kind.reach * place.w;
    let grown = distance / max(distance - reach.x, 0.1 * distance);
    let half = vec2<f32>(reach.y, reach.z * upright + reach.y * abs(facing.y)) * grown;
    let xy = (vec2<f32>(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0) * half;
    let at = right * xy.x + up * xy.y;
    var out: Fragment;
    out.clip = camera.clip_from_world * vec4<f32>(place.xyz + at, 1.0);
    // As near as any of it may be, so that the depth test spares what is wholly hidden and nothing else.
    let front = camera.clip_from_world * vec4<f32>(place.xyz + at + facing * reach.x, 1.0);
    out.clip.z = select(out.clip.w, front.z / front.w * out.clip.w, front.w > 0.0 && front.z < front.w);
    out.at = to_model(turn, at) / place.w;
    out.eye = to_model(turn, to_eye) / place.w;
    let level = clamp(log2(kind.frame.z / place.w * distance / camera.depth.z), 0.0, kind.frame.w);
    out.seen = vec4<u32>(bitcast<u32>(level), seen.yzw);
    out.turn = turn;
    out.place = place;
    out.light_0 = people[seen.x].light[0];
    out.light_1 = people[seen.x].light[1];
    out.light_2 = people[seen.x].light[2];
    out.light_3 = people[seen.x].light[3];
    out.light_4 = people[seen.x].light[4];
    out.light_5 = people[seen.x].light[5];
    return out;
}

fn scene_depth(pixel: vec2<f32>) -> f32 {
    let z = textureLoad(depth, vec2<i32>(pixel), 0);
    return (camera.depth.x * z + camera.depth.y) / (z + camera.depth.w);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let turn = in.turn;
    let level = bitcast<f32>(in.seen.x);
    let ray = normalize(in.at - in.eye);
    var color = vec3<f32>(0.0);
    var normal = vec3<f32>(0.0);
    var place = vec3<f32>(0.0);
    var openness = 0.0;
    var covered = 0.0;
    for (var k = 0u; k < 4u; k += 1u) {
        let packed = unpack2x16unorm(select(in.seen.w, in.seen.z, k < 2u));
        let weight = select(packed.y, packed.x, (k & 1u) == 0u);
        // The largest come first.
        if (weight <= 0.0) {
            break;
        }
        let number = (in.seen.y >> (8u * k)) & 255u;
        let view = kind.views[number];
        var at = in.at;
        let slope = dot(ray, view.toward.xyz);
        let follows = select(0.0, 1.0 / slope, slope < -ASLANT);
        var uv = vec2<f32>(dot(at, view.right.xyz) - view.right.w, view.up.w - dot(at, view.up.xyz)) * view.window.xy;
        for (var step = 0u; step < STEPS; step += 1u) {
            let inside = all(abs(uv - 0.5) <= vec2<f32>(0.5));
            let there = turn.zw + clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * kind.frame.xy;
            let found = textureSampleLevel(texels, texel_sampler, there, 2u * number + 1u, level).a;
            let way = ((found * 2.0 - 1.0) * kind.reach.x - dot(at, view.toward.xyz)) * follows;
            at += ray * select(0.0, clamp(way, -kind.reach.x, kind.reach.x), inside);
            uv = vec2<f32>(dot(at, view.right.xyz) - view.right.w, view.up.w - dot(at, view.up.xyz)) * view.window.xy;
        }
        let inside = all(abs(uv - 0.5) <= vec2<f32>(0.5));
        let there = turn.zw + clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * kind.frame.xy;
        let look = textureSampleLevel(texels, texel_sampler, there, 2u * number, level);
        let shape = textureSampleLevel(texels, texel_sampler, there, 2u * number + 1u, level);
        let part = select(0.0, weight * look.a, inside);
        let across = shape.xy * 2.0 - 1.0;
        let out = sqrt(max(1.0 - dot(across, across), 0.0));
        color += look.rgb * look.rgb * part;
        normal += (view.right.xyz * across.x + view.up.xyz * across.y + view.toward.xyz * out) * part;
        place += at * part;
        openness += shape.b * part;
        covered += part;
    }
    let whole = 1.0 / max(covered, 1e-4);
    let n = to_world(turn, normalize(normal + vec3<f32>(0.0, 1e-6, 0.0)));
    let at = place * whole;
    let world = in.place.xyz + to_world(turn, at) * in.place.w;

    let squares = n * n;
    let x = select(in.light_1.rgb, in.light_0.rgb, n.x >= 0.0);
    let y = select(in.light_3.rgb, in.light_2.rgb, n.y >= 0.0);
    let z = select(in.light_5.rgb, in.light_4.rgb, n.z >= 0.0);
    let around = (x * squares.x + y * squares.y + z * squares.z) * (openness * whole);
    let height = clamp(at.y / kind.reach.z, -1.0, 1.0);
    let beyond = select(in.light_0.a, in.light_2.a, height >= 0.0);
    let reached = mix(in.light_1.a, beyond, abs(height));
    let direct = max(dot(n, camera.sun_direction.xyz), 0.0) * reached;
    let light = around + direct * camera.sun_over_pi.rgb;

    let own = dot(camera.forward.xyz, world) + camera.forward.w;
    let before = clamp((scene_depth(in.clip.xy) - own) / SOFT_M + 0.5, 0.0, 1.0);
    return vec4<f32>(display(light * color * whole, in.clip.xy), min(covered, 1.0) * before);
}
