// The depth of the mesh as each direction's light sees it: an instance for each direction, a tile of the atlas for each instance.
// All of the mesh lies in its bounding sphere, and all of the sphere in the tile, so that nothing is clipped.

@vertex
fn main(@location(0) p: vec4<f32>, @builtin(instance_index) tile: u32) -> @builtin(position) vec4<f32> {
    let q = light_space(basis(directions[maps.first + tile].xyz), p.xyz);
    let px = atlas_px(tile, q.xy);
    let clip = px / maps.atlas_px * 2.0 - 1.0;
    return vec4<f32>(clip.x, -clip.y, 0.5 - 0.5 * q.z, 1.0);
}
