// What shaders know of lamps: `LampsUniform` in lamps/uniform.rs.

const LAMPS: u32 = 8u;
const LAMP_TILES_ACROSS: u32 = 8u;
const LAMP_TILE_PX: f32 = 512.0;
const LAMP_BIAS: f32 = 2e-5;

struct Lamps {
    // xyz: where a lamp is, w: 1 / the square of its reach.
    place: array<vec4<f32>, 8>,
    // rgb: irradiance / pi one metre away, times exposure; w: 1 / the cosines over which a spot light fades.
    light: array<vec4<f32>, 8>,
    // xyz: unit direction of a spot light, w: the cosine at its edge.
    cone: array<vec4<f32>, 8>,
    // x: its first tile, below 0 where nothing casts shadows; y: its faces; z: what a texel is wide, one metre away.
    shadow: array<vec4<f32>, 8>,
    // World to clip space, for each tile.
    clip_from_world: array<mat4x4<f32>, 48>,
}

// Which of a lamp's tiles what lies `away` from it is in.
fn lamp_tile(shadow: vec4<f32>, away: vec3<f32>) -> u32 {
    let size = abs(away);
    let by_z = select(select(5u, 4u, away.z > 0.0), select(3u, 2u, away.y > 0.0), size.y >= size.z);
    let of_cube = select(by_z, select(1u, 0u, away.x > 0.0), size.x >= size.y && size.x >= size.z);
    return u32(max(shadow.x, 0.0)) + select(of_cube, 0u, shadow.y < 2.0);
}

// Where a tile shows what it has at `at`, texels from the first one's middle.
fn lamp_texel(tile: u32, at: vec2<f32>) -> vec2<f32> {
    let corner = vec2<f32>(f32(tile % LAMP_TILES_ACROSS), f32(tile / LAMP_TILES_ACROSS));
    return (corner + 0.5 + vec2<f32>(0.5, -0.5) * clamp(at, vec2<f32>(-0.99), vec2<f32>(0.99))) * LAMP_TILE_PX - 0.5;
}

// How light falls from a lamp to what is `to` it: with the square of the distance, faded out at the reach (B. Karis: "Real Shading in Unreal Engine 4", SIGGRAPH 2013) and at the cone's edge.
fn lamp_falls(lamp: u32, to: vec3<f32>) -> f32 {
    let square = max(dot(to, to), 1e-4);
    let cosine = -dot(lamps.cone[lamp].xyz, to) * inverseSqrt(square);
    let inside = clamp((cosine - lamps.cone[lamp].w) * lamps.light[lamp].w, 0.0, 1.0);
    let left = square * lamps.place[lamp].w;
    let window = clamp(1.0 - left * left, 0.0, 1.0);
    return window * window * inside * inside * (3.0 - 2.0 * inside) / square;
}
