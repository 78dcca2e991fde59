// The bounding sphere, and what rays need to know.
struct Extent {
    center: vec3<f32>,
    radius: f32,
    anchor: vec3<f32>,
    offset: f32,
    // By which boxes are wider than what they hold.
    margin: f32,
}

