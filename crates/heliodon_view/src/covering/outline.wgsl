// The outline of what is marked: its backs, moved out along their normals as far as an angle at the eye, so that it is as broad from everywhere and for both eyes. A dark
// line around a bright one shows on any ground. Prepended: display.wgsl with its constants, view.wgsl, cover.wgsl.

const OUTLINE_RAD: f32 = 0.0032;
const OUTLINE_PARALLEL_M: f32 = 0.02;

struct Fragment {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) own: u32,
}

@vertex
fn vertex(
    @location(0) position: vec3<f32>,
    @location(4) octahedral: vec2<f32>,
    @builtin(instance_index) own: u32,
#ifdef BOTH_EYES
    @builtin(view_index) eye: u32,
#endif
) -> Fragment {
#ifdef BOTH_EYES
    view = views[eye];
#endif
    let fold = max(abs(octahedral.x) + abs(octahedral.y) - 1.0, 0.0);
    let flat = vec3<f32>(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
    let normal = normalize(vec3<f32>(flat.xy - select(vec2<f32>(-fold), vec2<f32>(fold), flat.xy >= vec2<f32>(0.0)), flat.z));
    let far = (view.clip_from_world * vec4<f32>(position, 1.0)).w;
    let unit = select(OUTLINE_PARALLEL_M, OUTLINE_RAD * far, view.eye.w > 0.5);
    let breadth = unit * covers.each[own >> OWN_BITS].look.y * f32(1u + (own & 1u));
    return Fragment(view.clip_from_world * vec4<f32>(position + normal * breadth, 1.0), own);
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let bright = covers.mark.rgb * (0.75 + 0.25 * covers.mark.a);
    return vec4<f32>(display(select(bright, vec3<f32>(0.004), (in.own & 1u) == 1u), in.clip.xy), 1.0);
}
