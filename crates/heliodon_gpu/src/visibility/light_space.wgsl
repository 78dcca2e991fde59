// Where a point lies as the light of a direction sees it, and on which pixel of the atlas that is.

struct Maps {
    // Pixels of a tile and of the atlas, and tiles in a row.
    tile_px: f32,
    atlas_px: f32,
    across: u32,
    // The first direction of this batch, how many there are in it, and in all.
    first: u32,
    count: u32,
    points: u32,
    // How much nearer the map must be than the point, in texels.
    bias: f32,
    // Workgroups in a row of a dispatch.
    row: u32,
}

@group(0) @binding(0) var<uniform> maps: Maps;
@group(0) @binding(1) var<uniform> extent: Extent;
@group(0) @binding(2) var<storage, read> directions: array<vec4<f32>>;

// A texel's width around the sphere: what is looked up beside its edge is still the tile's own.
const MARGIN: f32 = 2.0;

// Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin: "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017. Its
// columns are two directions across and the direction to the light.
fn basis(l: vec3<f32>) -> mat3x3<f32> {
    let sign = select(-1.0, 1.0, l.z >= 0.0);
    let a = -1.0 / (sign + l.z);
    let b = l.x * l.y * a;
    return mat3x3<f32>(vec3<f32>(1.0 + sign * l.x * l.x * a, sign * b, -sign * l.x), vec3<f32>(b, sign + l.y * l.y * a, -l.y), l);
}

// Across, across, and towards the light, in radii.
fn light_space(axes: mat3x3<f32>, p: vec3<f32>) -> vec3<f32> {
    return ((p - extent.center) / extent.radius) * axes;
}

// Texels of one radius.
fn radius_px() -> f32 {
    return 0.5 * maps.tile_px - MARGIN;
}

// On the atlas: pixels to the right and downwards.
fn atlas_px(tile: u32, across: vec2<f32>) -> vec2<f32> {
    let corner = vec2<f32>(vec2<u32>(tile % maps.across, tile / maps.across)) * maps.tile_px;
    return corner + 0.5 * maps.tile_px + vec2<f32>(across.x, -across.y) * radius_px();
}
