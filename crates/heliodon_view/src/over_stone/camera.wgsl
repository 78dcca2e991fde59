// A camera and what it has drawn so far. `CameraUniform` of camera.rs writes it.

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
    // Unit direction that shadows come from: the sun's, or from above without one.
    shadow: vec4<f32>,
    world_from_clip: mat4x4<f32>,
    // x, y: where its picture begins, pixels; z, w: 2 / its sides.
    viewport: vec4<f32>,
}

@group(0) @binding(0) var<uniform> camera: Camera;
#ifdef ONE_SAMPLE
@group(0) @binding(1) var depth: texture_depth_2d;
#endif
#ifdef MANY_SAMPLES
@group(0) @binding(1) var depth: texture_depth_multisampled_2d;
#endif

// Metres along forward of what a pixel shows.
fn scene_depth(pixel: vec2<f32>) -> f32 {
    let z = textureLoad(depth, vec2<i32>(pixel), 0);
    return (camera.depth.x * z + camera.depth.y) / (z + camera.depth.w);
}

// Where that is in the world.
fn scene_place(pixel: vec2<f32>) -> vec3<f32> {
    let z = textureLoad(depth, vec2<i32>(pixel), 0);
    let ndc = (pixel - camera.viewport.xy) * camera.viewport.zw * vec2<f32>(1.0, -1.0) + vec2<f32>(-1.0, 1.0);
    let place = camera.world_from_clip * vec4<f32>(ndc, max(z, 1e-9), 1.0);
    return place.xyz / place.w;
}

// Bits of the fourteen corners of a strip around a box.
const BOX_X: u32 = 0x287au;
const BOX_Y: u32 = 0x02afu;
const BOX_Z: u32 = 0x31e3u;

fn box_corner(corner: u32) -> vec3<f32> {
    return vec3<f32>(vec3<u32>(BOX_X >> corner, BOX_Y >> corner, BOX_Z >> corner) & vec3<u32>(1u));
}

