// Prepended to stone.wgsl where a panorama is shown; heliodon_bundle::panorama tells what it is.

// rgb: the normal; a: 1 over how far along the face's axis what is drawn lies, 0 where the panorama says nothing.
@group(1) @binding(8) var panorama_surface: texture_2d<f32>;
// a: 0 where what is drawn has a texture of its own.
@group(1) @binding(9) var panorama_albedo: texture_2d<f32>;

const PANORAMA_TOLERANCE: f32 = 0.01;
// Texels from which sky and bounced sun are still filtered.
const PANORAMA_REACH: f32 = 3.0;
const PANORAMA_FACES: vec2<f32> = vec2<f32>(3.0, 2.0);

// What the panorama shows of a place.
struct Seen {
    uv: vec2<f32>,
    // Its way per pixel.
    across: vec2<f32>,
    down: vec2<f32>,
    albedo: vec4<f32>,
    // How much of the place it shows: the rest is that of the vertices.
    share: f32,
}

// A vector along u, v and the axis of a face.
fn panorama_local(axis: u32, way: f32, v: vec3<f32>) -> vec3<f32> {
    let turned = select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
    return vec3<f32>(turned.xy, way * turned.z);
}

// Of the four texels around the line from the middle those count that lie in the plane of the triangle that is drawn: what is in front of it is another surface.
fn panorama_seen(place: vec3<f32>, across: vec3<f32>, down: vec3<f32>) -> Seen {
    let off = place - texel_moment.middle.xyz;
    let far = abs(off);
    let axis = select(select(1u, 2u, far.z > far.y), 0u, far.x >= far.y && far.x >= far.z);
    let along = select(select(off.z, off.y, axis == 1u), off.x, axis == 0u);
    let way = select(1.0, -1.0, along < 0.0);
    let local = panorama_local(axis, way, off);
    let local_across = panorama_local(axis, way, across);
    let local_down = panorama_local(axis, way, down);
    let ratio = local.xy / local.z;
    let scale = 0.5 * texel_moment.middle.w / PANORAMA_FACES;
    let centre = (vec2<f32>(f32(axis), select(0.0, 1.0, way < 0.0)) + 0.5) / PANORAMA_FACES;
    let size = vec2<f32>(textureDimensions(panorama_surface, 0));
    let at = (centre + ratio * scale) * size - 0.5;
    let low = floor(at);
    let part = at - low;
    let facing = normalize(cross(local_across, local_down));
    let height = dot(facing, local);
    var share = 0.0;
    var continues = 1.0;
    var sum = vec2<f32>(0.0);
    for (var corner = 0u; corner < 4u; corner += 1u) {
        let step = vec2<f32>(vec2<u32>(corner % 2u, corner / 2u));
        let texel = low + step + 0.5;
        let near = textureLoad(panorama_surface, vec2<i32>(low + step), 0).a;
        let line = vec3<f32>((texel / size - centre) / scale, 1.0);
        let apart = abs(dot(facing, line) - height * near);
        let most = PANORAMA_TOLERANCE * local.z * near;
        let agrees = clamp(2.0 - apart / max(most, 1e-12), 0.0, 1.0);
        let weights = 1.0 - abs(part - step);
        let weight = weights.x * weights.y * select(0.0, agrees, near > 0.0 && abs(near * local.z - 1.0) < 0.5);
        share += weight;
        sum += weight * texel;
    }
    // Where another surface begins within the reach of what is filtered more coarsely, that would shine through.
    for (var side = 0u; side < 4u; side += 1u) {
        let texel = floor(at + PANORAMA_REACH * (2.0 * vec2<f32>(vec2<u32>(side % 2u, side / 2u)) - 1.0)) + 0.5;
        let near = textureLoad(panorama_surface, vec2<i32>(texel), 0).a;
        let line = vec3<f32>((texel / size - centre) / scale, 1.0);
        let apart = abs(dot(facing, line) - height * near) / max(3.0 * PANORAMA_TOLERANCE * local.z * near, 1e-12);
        continues *= select(1.0, clamp(2.0 - apart, 0.0, 1.0), near > 0.0);
    }
    var seen: Seen;
    // Their common middle, so that the others are not filtered with them.
    seen.uv = sum / max(share, 1e-6) / size;
    seen.across = (local_across.xy - ratio * local_across.z) / local.z * scale;
    seen.down = (local_down.xy - ratio * local_down.z) / local.z * scale;
    seen.share = continues * smoothstep(0.0, 0.5, share);
    seen.albedo = textureSampleLevel(panorama_albedo, texel_sampler, seen.uv, texel_level(seen.across, seen.down));
    return seen;
}

// As texel_light.
fn panorama_light(seen: Seen) -> vec4<f32> {
    let normal = textureSampleLevel(panorama_surface, texel_sampler, seen.uv, texel_level(seen.across, seen.down)).rgb;
    // Where nothing is said there is none.
    return texel_light(seen.uv, seen.across, seen.down, normal / max(length(normal), 1e-6));
}
