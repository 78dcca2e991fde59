// What a camera needs to draw the stone and the sky; `ViewUniform` in daylight/view.rs.
struct View {
    clip_from_world: mat4x4<f32>,
    // Directions on the far plane from clip coordinates, without the eye's position.
    direction_from_clip: mat4x4<f32>,
    // xyz: unit direction to the sun, w: chord on the unit sphere from the disc's centre to the outside of its soft edge.
    sun_direction: vec4<f32>,
    // rgb: exposed radiance of the disc (0: none), w: 1 / the soft edge's width in chords.
    sun_disc: vec4<f32>,
    // x, y: weights of the two sky maps, exposure included; z: 1 where what is guessed is told from what was seen; w: 1 where details are shown.
    sky_weights: vec4<f32>,
    // xyz: the eye, w: 1; in parallel projections 0.
    eye: vec4<f32>,
}

#ifdef ONE_VIEW
@group(0) @binding(0) var<uniform> view: View;
#endif
#ifdef BOTH_EYES
// Each entry point that needs its eye's sets it first.
@group(0) @binding(0) var<uniform> views: array<View, 2>;
var<private> view: View;
#endif
