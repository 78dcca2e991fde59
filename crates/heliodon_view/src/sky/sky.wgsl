// The dome behind everything: two lat-long maps, cross-faded, and the sun's disc where the maps leave it out.
// Prepended: display.wgsl with its constants, view.wgsl.

@group(1) @binding(0) var map_a: texture_2d<f32>;
@group(1) @binding(1) var map_b: texture_2d<f32>;
@group(1) @binding(2) var map_sampler: sampler;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) direction: vec3<f32>,
}

@vertex
fn vertex(
    @builtin(vertex_index) index: u32,
#ifdef BOTH_EYES
    @builtin(view_index) eye: u32,
#endif
) -> Fragment {
#ifdef BOTH_EYES
    view = views[eye];
#endif
    // One triangle over the whole screen on the far plane, which is 0 with reversed depth.
    let xy = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0;
    var out: Fragment;
    out.clip = vec4<f32>(xy, 0.0, 1.0);
    out.direction = (view.direction_from_clip * vec4<f32>(xy, 1.0, 1.0)).xyz;
    return out;
}

// Columns: the middle looks north (-Z), east (+X) is to its right. Rows: the top is up (DESIGN.md section 7).
fn lat_long(d: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(0.5 + atan2(d.x, -d.z) * 0.15915494, acos(clamp(d.y, -1.0, 1.0)) * 0.31830987);
}

@fragment
fn fragment(
    in: Fragment,
#ifdef BOTH_EYES
    @builtin(view_index) eye: u32,
#endif
) -> @location(0) vec4<f32> {
#ifdef BOTH_EYES
    view = views[eye];
#endif
    let d = normalize(in.direction);
    let uv = lat_long(d);
    var radiance = vec3<f32>(0.0);
    if (view.sky_weights.x > 0.0) {
        radiance += view.sky_weights.x * textureSampleLevel(map_a, map_sampler, uv, 0.0).rgb;
    }
    if (view.sky_weights.y > 0.0) {
        radiance += view.sky_weights.y * textureSampleLevel(map_b, map_sampler, uv, 0.0).rgb;
    }
    // By the chord, not by the cosine, which has only two digits left over half a degree.
    let inside = clamp((view.sun_direction.w - distance(d, view.sun_direction.xyz)) * view.sun_disc.w, 0.0, 1.0);
    // The horizon hides what of the disc is below it.
    radiance += select(0.0, inside, d.y >= 0.0) * view.sun_disc.rgb;
    return vec4<f32>(display(radiance, in.clip.xy), 1.0);
}
