// Depth alone, from the sun or from a lamp, in a tile of a map.
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    return clip_from_world * vec4<f32>(position, 1.0);
}
