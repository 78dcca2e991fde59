// The stone's normals, out of what is baked, as a vertex buffer: lamps need them where a fragment is. Prepended: BLOCK, TEXELS
// (VertexLayout::normals_wgsl).

@group(0) @binding(0) var baked: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> normals: array<u32>;

@compute @workgroup_size(BLOCK)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    normals[id.x] = textureLoad(baked, vec2<u32>(id.x % BLOCK, id.x / BLOCK * TEXELS), 0).x;
}
