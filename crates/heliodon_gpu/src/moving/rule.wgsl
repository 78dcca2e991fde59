// How a vertex moves, as heliodon_mesh::motion::rules says.
struct Rule {
    // Before its matrices; u32::MAX for the part of what nothing moves.
    position: vec3<f32>,
    part: u32,
    normal: vec3<f32>,
    // Where its influences begin; they end where the next rule's begin. Likewise its deltas.
    influences: u32,
    rest: vec3<f32>,
    deltas: u32,
    rest_normal: vec3<f32>,
    renews: u32,
}

