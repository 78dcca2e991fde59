// The number of the triangle that each pixel shows (sight.rs). Prepended: `enable primitive_index;` and view.wgsl.

struct Fragment {
    // The same positions as in stone.wgsl, to the bit: both passes share their depth.
    @invariant @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) first: u32,
}

// A draw's first triangle is told as its first instance.
@vertex
fn vertex(@location(0) position: vec3<f32>, @builtin(instance_index) first: u32) -> Fragment {
    return Fragment(view.clip_from_world * vec4<f32>(position, 1.0), first);
}

@fragment
fn fragment(in: Fragment, @builtin(primitive_index) triangle: u32) -> @location(0) u32 {
    return in.first + triangle + 1u;
}
