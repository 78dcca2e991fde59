// Image-based people: a quad for each, on which the views around the eye are blended, each where the eye's ray meets what it shows.
// heliodon_bundle::impostor::Look is the reference. Prepended: display.wgsl with its constants, `STEPS`, `MARK`, over_stone/camera.wgsl.

struct Person {
    // xyz: the model's middle in the world, w: its scale.
    place: vec4<f32>,
    // Sine and cosine of its turn about +Y; the corner of its frame in a layer, from 0 to 1.
    turn: vec4<f32>,
    // Exposed light on surfaces that face +X -X +Y -Y +Z -Z; w of the first three: how much of the sun reaches its feet, its middle, its head.
    light: array<vec4<f32>, 6>,
    // The view that its shadow is taken from; half of what that shows upwards, and of what the sun sees, metres; how far shadows reach, metres.
    shadow: vec4<f32>,
    // x: how much of it is there, y: how much it is marked, z: the mark's pulse.
    worn: vec4<f32>,
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
    @location(11) @interpolate(flat) worn: vec4<f32>,
    // Where the nearest view shows the place, from 0 to 1 in its window.
    @location(12) uv: vec2<f32>,
}

// From the world's directions to the model's.
fn to_model(turn: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(turn.y * v.x - turn.x * v.z, v.y, turn.x * v.x + turn.y * v.z);
}

fn to_world(turn: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(turn.y * v.x + turn.x * v.z, v.y, turn.y * v.z - turn.x * v.x);
}

// A corner of somebody's quad.
fn corner_of(corner: u32, number: u32) -> Fragment {
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
    // Sideways no farther than the nearest view shows, and what turning from it to the eye brings out of the depth.
    let view = kind.views[seen.y & 255u];
    let turned = cross(to_model(turn, right), view.right.xyz).y;
    let aside = vec2<f32>(view.right.w, view.right.w + 1.0 / view.window.x) * place.w + vec2<f32>(-1.0, 1.0) * abs(turned) * reach.y;
    let wide = clamp(aside, vec2<f32>(-reach.y), vec2<f32>(reach.y)) * grown;
    let high = (reach.z * upright + reach.y * abs(facing.y)) * grown;
    let xy = vec2<f32>(select(wide.x, wide.y, (corner & 1u) == 1u), (f32(corner >> 1u) * 2.0 - 1.0) * high);
    let at = right * xy.x + up * xy.y;
    var out: Fragment;
    out.clip = camera.clip_from_world * vec4<f32>(place.xyz + at, 1.0);
    // As near as any of it may be, so that the depth test spares what is wholly hidden and nothing else.
    let front = camera.clip_from_world * vec4<f32>(place.xyz + at + facing * reach.x, 1.0);
    out.clip.z = select(out.clip.w, front.z / front.w * out.clip.w, front.w > 0.0 && front.z < front.w);
    out.at = to_model(turn, at) / place.w;
    out.uv = window_of(view, out.at);
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
    out.worn = people[seen.x].worn;
    return out;
}

@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Fragment {
    return corner_of(corner, number);
}

// Where in its window a view shows a place, from 0 to 1 within it.
fn window_of(view: View, at: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot(at, view.right.xyz) - view.right.w, view.up.w - dot(at, view.up.xyz)) * view.window.xy;
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
    // Most of a quad shows nothing. A driver that draws on the processor leaves no branch out, but it does leave loops.
    let first = in.seen.y & 255u;
    let whole_uv = clamp(in.uv, vec2<f32>(0.0), vec2<f32>(1.0));
    let any = textureSampleLevel(texels, texel_sampler, turn.zw + whole_uv * kind.frame.xy, 2u * first, kind.frame.w).a;
    let count = select(0u, 4u, any > 0.0);
    // From far away a step is less than a pixel.
    let steps = min(STEPS, max(STEPS, 1u + u32(level)) - u32(level));
    for (var k = 0u; k < count; k += 1u) {
        let packed = unpack2x16unorm(select(in.seen.w, in.seen.z, k < 2u));
        let weight = select(packed.y, packed.x, (k & 1u) == 0u);
        // The largest come first.
        if (weight <= 0.0) {
            break;
        }
        let number = (in.seen.y >> (8u * k)) & 255u;
        let view = kind.views[number];
        let slope = dot(ray, view.toward.xyz);
        let follows = select(0.0, 1.0 / slope, slope < -ASLANT);
        // how far along the ray, and what that is in the window and before it
        var along = 0.0;
        let first_uv = window_of(view, in.at);
        let uv_along = vec2<f32>(dot(ray, view.right.xyz), -dot(ray, view.up.xyz)) * view.window.xy;
        let before = dot(in.at, view.toward.xyz);
        var uv = first_uv;
        for (var step = 0u; step < steps; step += 1u) {
            let inside = all(abs(uv - 0.5) <= vec2<f32>(0.5));
            let there = turn.zw + clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * kind.frame.xy;
            let found = textureSampleLevel(texels, texel_sampler, there, 2u * number + 1u, level).a;
            let way = ((found * 2.0 - 1.0) * kind.reach.x - before - along * slope) * follows;
            along += select(0.0, clamp(way, -kind.reach.x, kind.reach.x), inside);
            uv = first_uv + uv_along * along;
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
        place += (in.at + ray * along) * part;
        openness += shape.b * part;
        covered += part;
    }
    // How much of what is around a pixel is covered, where it is marked.
    var coarse = 1.0;
    for (var turns = 0u; turns < select(0u, 1u, in.worn.y > 0.0); turns += 1u) {
        coarse = textureSampleLevel(texels, texel_sampler, turn.zw + whole_uv * kind.frame.xy, 2u * first, min(level + 2.0, kind.frame.w)).a;
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
    // What hides the sky of a place hides the sun of it too, where that shines on it aslant (D. Chan, "Material Advances in Call of Duty: WWII", SIGGRAPH 2018 courses).
    let open = openness * whole;
    let cosine = max(dot(n, camera.sun_direction.xyz), 0.0);
    let direct = cosine * clamp(cosine + 2.0 * open * open - 1.0, 0.0, 1.0) * reached;
    let light = around + direct * camera.sun_over_pi.rgb;

    let own = dot(camera.forward.xyz, world) + camera.forward.w;
    let before = clamp((scene_depth(in.clip.xy) - own) / SOFT_M + 0.5, 0.0, 1.0);
    // Marked: as other things are (covering/cover.wgsl), and bright where its picture ends.
    let rim = clamp(2.0 - 2.0 * coarse, 0.0, 1.0);
    let lit = light * color * whole;
    let within = min(lit, vec3<f32>(select(65504.0, 1.5, in.worn.y > 0.0)));
    let tinted = MARK * min(0.16 + 1.2 * dot(within, vec3<f32>(0.2126, 0.7152, 0.0722)), 1.0);
    let filled = mix(within, tinted, in.worn.y * (0.1 + 0.25 * in.worn.z));
    let shown = mix(filled, MARK, in.worn.y * 0.85 * rim);
    return vec4<f32>(display(shown, in.clip.xy), min(covered, 1.0) * before * in.worn.x);
}

struct Solid {
    @builtin(position) clip: vec4<f32>,
    @location(0) at: vec3<f32>,
    // Of `order`, as above; its last is 1 for who is there.
    @location(1) @interpolate(flat) seen: vec3<u32>,
    @location(2) @interpolate(flat) frame: vec2<f32>,
}

// For what is drawn later: the upright plane through somebody's middle, where the nearest view shows them.
@vertex
fn solid_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Solid {
    let in = corner_of(corner, number);
    var out: Solid;
    out.clip = camera.clip_from_world * vec4<f32>(in.place.xyz + to_world(in.turn, in.at) * in.place.w, 1.0);
    out.at = in.at;
    out.seen = vec3<u32>(in.seen.xy, select(0u, 1u, in.worn.x >= 0.5));
    out.frame = in.turn.zw;
    return out;
}

@fragment
fn solid_fragment(in: Solid) {
    let first = in.seen.y & 255u;
    let uv = window_of(kind.views[first], in.at);
    let there = in.frame + clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * kind.frame.xy;
    let covered = textureSampleLevel(texels, texel_sampler, there, 2u * first, bitcast<f32>(in.seen.x)).a;
    if (in.seen.z == 0u || covered < 0.5 || any(abs(uv - 0.5) > vec2<f32>(0.5))) {
        discard;
    }
}

// Around feet the sky is darker so far, metres.
const FEET_M: f32 = 0.4;
// How far below the feet a shadow is looked for, metres.
const BELOW_M: f32 = 0.5;

// Places are in the light's space from somebody's middle: to the right and up for who looks back along the light, and along it; one is the model's metre.
struct Shadow {
    @builtin(position) clip: vec4<f32>,
    // On the volume's side, w: metres along forward in the world.
    @location(0) at: vec4<f32>,
    // The eye, w: as above.
    @location(1) @interpolate(flat) eye: vec4<f32>,
    @location(2) @interpolate(flat) turn: vec4<f32>,
    // Place to where the view shows it, from 0 to 1 in its window: factors and offsets.
    @location(3) @interpolate(flat) window: vec4<f32>,
    @location(4) @interpolate(flat) light_0: vec4<f32>,
    @location(5) @interpolate(flat) light_1: vec4<f32>,
    @location(6) @interpolate(flat) light_2: vec4<f32>,
    @location(7) @interpolate(flat) light_3: vec4<f32>,
    @location(8) @interpolate(flat) light_4: vec4<f32>,
    @location(9) @interpolate(flat) light_5: vec4<f32>,
    // x: how much of it is there, y: the farthest along, z: half of what the light sees upwards, w: the view.
    @location(10) @interpolate(flat) there: vec4<f32>,
}

// Across the light that casts shadows, to the right and up for who looks back along it.
fn shadow_right() -> vec3<f32> {
    let across = vec2<f32>(camera.shadow.z, -camera.shadow.x);
    let length = length(across);
    return select(vec3<f32>(across.x / length, 0.0, across.y / length), vec3<f32>(1.0, 0.0, 0.0), length < 1e-3);
}

// A volume around what lies behind somebody, as the light sees it: as wide as their picture, from their upright middle to just below the ground. Where the sun does not reach their feet
// there is only what they hide of the sky around those.
@vertex
fn shadow_vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Shadow {
    let person = order[number].x;
    let place = people[person].place;
    let shadow = people[person].shadow;
    let first = people[person].light[0];
    let view = kind.views[u32(shadow.x + 0.5)];
    let right = shadow_right();
    let up = cross(camera.shadow.xyz, right);
    let rise = camera.shadow.y;
    let side = vec3<f32>(vec3<u32>(corner, corner >> 1u, corner >> 2u) & vec3<u32>(1u));
    let scale = max(place.w, 1e-3);
    let shone = any(camera.sun_over_pi.rgb * first.a > vec3<f32>(0.0));
    // the picture, and the disc about the feet
    let feet = -kind.reach.z * up.y;
    let disc = length(vec2<f32>(rise, 2.0 * up.y)) * FEET_M;
    let wide = vec2<f32>(view.right.w, view.right.w + 1.0 / view.window.x);
    let left = min(select(0.0, max(wide.x, -kind.reach.y), shone), -FEET_M);
    let to_right = max(select(0.0, min(wide.y, kind.reach.y), shone), FEET_M);
    let low = min(select(0.0, -shadow.z, shone), feet - rise * FEET_M) - 0.1 / scale;
    let high = select(feet + disc, min(shadow.z, view.up.w * shadow.z / max(shadow.y, 1e-3)), shone);
    // along the light, before the body's upright middle
    let around = max(kind.reach.y, FEET_M);
    let flat_way = max(up.y, 0.05);
    let before = (vec2<f32>(low, high) + around * rise) * (rise / flat_way) + around * flat_way;
    let front = select(vec2<f32>(0.5 * kind.reach.x), before, before.x + before.y < kind.reach.x);
    // and to the ground
    let farthest = -shadow.w / scale;
    let beneath = (-(kind.reach.z + BELOW_M / scale) - vec2<f32>(low, high) * up.y) / max(rise, 1e-3);
    let back = vec2<f32>(max(beneath.x, farthest), beneath.y);
    let upward = mix(low, high, side.y);
    let along = mix(mix(back.x, back.y, side.y), mix(front.x, front.y, side.y), side.z);
    let across = mix(left, to_right, side.x);
    let world = place.xyz + (right * across + up * upward + camera.shadow.xyz * along) * place.w;
    let to_eye = (camera.eye.xyz - place.xyz) / scale;
    var out: Shadow;
    out.clip = camera.clip_from_world * vec4<f32>(world, 1.0);
    out.at = vec4<f32>(across, upward, along, dot(camera.forward.xyz, world) + camera.forward.w);
    out.eye = vec4<f32>(dot(to_eye, right), dot(to_eye, up), dot(to_eye, camera.shadow.xyz), dot(camera.forward.xyz, camera.eye.xyz) + camera.forward.w);
    out.turn = people[person].turn;
    // what the view shows stands for what the light sees, stretched to the same height
    let shown = vec2<f32>(1.0, -shadow.y / max(shadow.z, 1e-3)) * view.window.xy;
    out.window = vec4<f32>(shown, vec2<f32>(-view.right.w, view.up.w) * view.window.xy);
    out.light_0 = first;
    out.light_1 = people[person].light[1];
    out.light_2 = people[person].light[2];
    out.light_3 = people[person].light[3];
    out.light_4 = people[person].light[4];
    out.light_5 = people[person].light[5];
    out.there = vec4<f32>(people[person].worn.x, farthest, shadow.z, shadow.x);
    return out;
}

// What somebody leaves of the light of what is behind: the sun's, that has not passed, and some of the sky's at the feet. What is already there is multiplied by it.
@fragment
fn shadow_fragment(in: Shadow) -> @location(0) vec4<f32> {
    // what is seen there lies on the eye's ray through the volume's side
    let place = in.at.xyz + (in.at.xyz - in.eye.xyz) * ((scene_depth(in.clip.xy) - in.at.w) / (in.at.w - in.eye.w));
    // towards the eye: the picture's y points down
    let facing = cross(dpdy(place), dpdx(place));
    let height = place.y * length(camera.shadow.xz) + place.z * camera.shadow.y;
    let stretched = (height + kind.reach.z) * 0.5;
    let far = sqrt(max(dot(place, place) - height * height, 0.0) + stretched * stretched) / FEET_M;
    let behind = all(abs(place.xy) < vec2<f32>(kind.reach.y, in.there.z)) && place.z < 0.5 * kind.reach.x && place.z > in.there.y;
    // Most of a volume is behind nobody: one turn of a loop, as above.
    var cover = 0.0;
    for (var k = 0u; k < select(0u, 1u, behind); k += 1u) {
        let uv = place.xy * in.window.xy + in.window.zw;
        let there = in.turn.zw + clamp(uv, vec2<f32>(0.0), vec2<f32>(1.0)) * kind.frame.xy;
        // the penumbra is as wide as the way is long
        let level = clamp(log2(max(0.01 * abs(place.z) * kind.frame.z, 1.0)), 0.0, kind.frame.w);
        cover = select(0.0, textureSampleLevel(texels, texel_sampler, there, 2u * u32(in.there.w + 0.5), level).a, all(abs(uv - 0.5) <= vec2<f32>(0.5)));
    }
    var left = vec3<f32>(1.0);
    for (var k = 0u; k < select(0u, 1u, cover > 0.0 || far < 1.0); k += 1u) {
        let right = shadow_right();
        let up = cross(camera.shadow.xyz, right);
        let n = (right * facing.x + up * facing.y + camera.shadow.xyz * facing.z) * inverseSqrt(max(dot(facing, facing), 1e-20));
        let squares = n * n;
        let x = select(in.light_1.rgb, in.light_0.rgb, n.x >= 0.0);
        let y = select(in.light_3.rgb, in.light_2.rgb, n.y >= 0.0);
        let z = select(in.light_5.rgb, in.light_4.rgb, n.z >= 0.0);
        let around = x * squares.x + y * squares.y + z * squares.z;
        let direct = camera.sun_over_pi.rgb * (max(dot(n, camera.sun_direction.xyz), 0.0) * in.light_0.a);
        let feet = 0.5 * pow(max(1.0 - far, 0.0), 2.0);
        left = (around * (1.0 - feet) + direct * (1.0 - cover)) / max(around + direct, vec3<f32>(1e-6));
    }
    return vec4<f32>(mix(vec3<f32>(1.0), clamp(left, vec3<f32>(0.0), vec3<f32>(1.0)), in.there.x), 1.0);
}
