// The stone: light comes per vertex, albedo is met in the fragment, exposure is already in the light.
// Prepended: display.wgsl with its constants, view.wgsl, where actors shade it actors/shade.wgsl, where lamps light it lamps/lamps.wgsl, and where light comes
// from texels texels.wgsl and texel_light.wgsl, and where a panorama is shown panorama.wgsl too. Lines between `#ifdef` and `#endif` are kept where
// they apply (pipelines.rs).
// Where something is worn (covering/mod.rs), cover.wgsl comes after view.wgsl, and an instance's upper bits say what.

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) light: vec4<f32>,
    // Square roots of linear albedo, so that ten bits are enough for dark stone.
    @location(2) albedo_root: vec4<f32>,
#ifdef TEXTURED
    @location(3) uv: vec2<f32>,
#endif
#ifdef NORMALS
    // On the octahedron.
    @location(4) normal: vec2<f32>,
#endif
#ifdef TEXELS
    @location(5) texel_uv: vec2<f32>,
#endif
}

struct Fragment {
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) light: vec3<f32>,
    @location(1) albedo: vec3<f32>,
#ifdef TEXTURED
    @location(2) uv: vec2<f32>,
#endif
#ifdef PLACED
    // xyz: the place in the world; w: the share of the sun's light, and twice the number of the actor.
    @location(3) place: vec4<f32>,
#endif
#ifdef NORMALS
    @location(4) normal: vec3<f32>,
#endif
#ifdef TEXELS
    // within the triangle also where only a part of the pixel is: beyond it lies another chart
    @location(5) @interpolate(perspective, centroid) texel_uv: vec2<f32>,
#endif
#ifdef COVERED
    @location(6) @interpolate(flat) slot: u32,
#endif
}

#ifdef TEXTURED
@group(1) @binding(0) var albedo_texture: texture_2d<f32>;
@group(1) @binding(1) var albedo_sampler: sampler;
#endif

@vertex
fn vertex(
    in: Vertex,
    @builtin(instance_index) instance: u32,
#ifdef BOTH_EYES
    @builtin(view_index) eye: u32,
#endif
) -> Fragment {
#ifdef BOTH_EYES
    view = views[eye];
#endif
#ifdef BARE
    let own = instance;
#endif
#ifdef COVERED
    let own = instance & ((1u << OWN_BITS) - 1u);
#endif
    var out: Fragment;
    out.clip = view.clip_from_world * vec4<f32>(in.position, 1.0);
    out.light = in.light.rgb;
    out.albedo = in.albedo_root.rgb * in.albedo_root.rgb;
#ifdef TEXTURED
    out.uv = in.uv;
#endif
#ifdef PLACED
    out.place = vec4<f32>(in.position, in.light.a + f32(2u * own));
#endif
#ifdef COVERED
    out.slot = instance >> OWN_BITS;
#endif
#ifdef TEXELS
    out.texel_uv = in.texel_uv;
#endif
#ifdef NORMALS
    let fold = max(abs(in.normal.x) + abs(in.normal.y) - 1.0, 0.0);
    let flat = vec3<f32>(in.normal, 1.0 - abs(in.normal.x) - abs(in.normal.y));
    out.normal = normalize(vec3<f32>(flat.xy - select(vec2<f32>(-fold), vec2<f32>(fold), flat.xy >= vec2<f32>(0.0)), flat.z));
#endif
    return out;
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
    var albedo = in.albedo;
#ifdef TEXTURED
    let texel = textureSample(albedo_texture, albedo_sampler, in.uv);
    var image = texel.rgb;
#endif
#ifdef DETAIL TEXTURED
    image = viewed(image, in.place.xyz, in.uv);
#endif
#ifdef TEXTURED
    // blue where alpha says that nobody saw it
    albedo = mix(albedo * image, vec3<f32>(0.03, 0.12, 0.55), 0.85 * view.sky_weights.z * saturate(2.0 - 2.0 * texel.a));
#endif
#ifdef PANORAMA
    let seen = panorama_seen(in.place.xyz, dpdx(in.place.xyz), dpdy(in.place.xyz));
    albedo = mix(albedo, seen.albedo.rgb, seen.share * seen.albedo.a);
#endif
#ifdef COVERED
    let local = cover_local(in.slot, in.place.xyz);
    let across_m = dpdx(in.place.xyz);
    let down_m = dpdy(in.place.xyz);
    let facet = normalize(cross(down_m, across_m));
#endif
#ifdef COVERED PLAIN
    let mean = vec3<f32>(1.0);
#endif
#ifdef COVERED TEXTURED
    // its coarsest level is one texel
    let mean = textureSampleLevel(albedo_texture, albedo_sampler, vec2<f32>(0.5), 16.0).rgb;
#endif
#ifdef COVERED
    let coated = cover_coated(in.slot, albedo, mean, local);
    albedo = coated.rgb;
#endif
#ifdef DETAIL
    let pixel_m = longer(dpdx(in.place.xyz), dpdy(in.place.xyz));
#endif
#ifdef DETAIL TEXTURED
    let uv_across = vec3<f32>(dpdx(in.uv), 0.0);
    let uv_down = vec3<f32>(dpdy(in.uv), 0.0);
    let base_size = vec3<f32>(vec2<f32>(textureDimensions(albedo_texture, 0)), 0.0);
    let base = longer(uv_across * base_size, uv_down * base_size);
    albedo *= detail_factor(in.place.xyz, normalize(in.normal), pixel_m, in.uv, longer(uv_across, uv_down), base);
#endif
#ifdef DETAIL PLAIN
    albedo *= detail_factor(in.place.xyz, normalize(in.normal), pixel_m, vec2<f32>(0.0), 0.0, 0.0);
#endif
#ifdef TEXELS
    let across = dpdx(in.texel_uv);
    let down = dpdy(in.texel_uv);
    albedo = texel_weathered(albedo, in.texel_uv, across, down);
#endif
#ifdef VERTICES
    var light = in.light;
#endif
#ifdef PANORAMA
    let lit = panorama_light(seen);
    light = mix(light, lit.rgb, seen.share);
#endif
#ifdef TEXELS
    let lit = texel_light(in.texel_uv, across, down, normalize(in.normal));
    var light = lit.rgb;
#endif
#ifdef SHADED
    // of the triangle, towards the eye: the picture's y points down
    let normal = normalize(cross(dpdy(in.place.xyz), dpdx(in.place.xyz)));
#endif
#ifdef SUNNED
    let own = floor(0.5 * in.place.w + 1e-3);
#endif
#ifdef SUNNED VERTICES
    var direct = max(in.place.w - 2.0 * own, 0.0);
#endif
#ifdef SUNNED PANORAMA
    direct = mix(direct, lit.a, seen.share);
#endif
#ifdef SUNNED TEXELS
    let direct = lit.a;
#endif
#ifdef SHADED
    light = shaded(light, direct, in.place.xyz, normal, u32(own));
#endif
#ifdef LAMPS BARE
    light += lamp_light(in.place.xyz, normalize(in.normal));
#endif
#ifdef COVERED
    let smooth_normal = normalize(in.normal);
    // open surfaces are seen from both sides; in parallel projections all look along one way
    let to_eye = normalize(select(facet, view.eye.xyz - in.place.xyz, view.eye.w > 0.5));
    let outward = select(-smooth_normal, smooth_normal, dot(smooth_normal, facet) >= 0.0);
    var dented = outward;
    for (var turn = 0u; turn < select(0u, 1u, coated.a > 0.0); turn += 1u) {
        dented = cover_dented(outward, local, max(length(across_m), length(down_m)));
    }
#endif
#ifdef COVERED ALONE
    let sun_left = 1.0;
#endif
#ifdef COVERED
    let sunlit = direct * sun_left * covers.sun_over_pi.rgb;
    var shine = cover_glint(albedo, dented, to_eye, covers.sun_direction.xyz) * COVER_PI * sunlit;
    let rest = max(light - sunlit, vec3<f32>(0.0));
    var around = rest;
#endif
#ifdef LAMPS COVERED
    let lamps_lit = lamp_light(in.place.xyz, dented, albedo, to_eye);
    light += lamps_lit;
    shine += lamp_shine;
    // what lamps light beside it is as bright as it would be itself, by and large
    around += 0.35 * lamps_lit;
#endif
#ifdef COVERED
    shine += cover_reflected(in.slot, albedo, around, dented, to_eye);
    let matte = light * albedo;
    let shown = cover_marked(in.slot, mix(matte, shine, coated.a), dot(outward, to_eye));
    if (cover_gone(in.slot, in.clip.xy)) {
        discard;
    }
    return vec4<f32>(display(shown, in.clip.xy), 1.0);
#endif
#ifdef BARE
    return vec4<f32>(display(light * albedo, in.clip.xy), 1.0);
#endif
}
