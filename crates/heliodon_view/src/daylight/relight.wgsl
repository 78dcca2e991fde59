// Stone lit pixel by pixel (relight.rs). Prepended: display.wgsl with its constants, BLOCK.

// x, y, z: the numbers of three vertices (lower 22 bits), and ten bits each of the root of the albedo; w: the weights of the second and
// the third vertex in 16 bits each, from -1/2 to 3/2.
@group(1) @binding(0) var pixels: texture_2d<u32>;
@group(1) @binding(1) var depth: texture_2d<f32>;
@group(1) @binding(2) var light: texture_2d<f32>;

const NO_STONE: u32 = 0xffffffffu;
const NUMBER: u32 = 0x3fffffu;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u)) * 2.0 - 1.0, 0.0, 1.0);
}

fn light_of(word: u32) -> vec3<f32> {
    let number = word & NUMBER;
    return textureLoad(light, vec2<u32>(number % BLOCK, number / BLOCK), 0).rgb;
}

struct Shown {
    @builtin(frag_depth) depth: f32,
    @location(0) color: vec4<f32>,
}

@fragment
fn fragment(@builtin(position) place: vec4<f32>) -> Shown {
    let pixel = textureLoad(pixels, vec2<u32>(place.xy), 0);
    if (pixel.x == NO_STONE) {
        discard;
    }
    let weights = vec2<f32>(vec2<u32>(pixel.w & 0xffffu, pixel.w >> 16u)) * (2.0 / 65535.0) - 0.5;
    let lit = light_of(pixel.x) * (1.0 - weights.x - weights.y) + light_of(pixel.y) * weights.x + light_of(pixel.z) * weights.y;
    let root = vec3<f32>(pixel.xyz >> vec3<u32>(22u)) / 1023.0;
    return Shown(textureLoad(depth, vec2<u32>(place.xy), 0).r, vec4<f32>(display(lit * root * root, place.xy), 1.0));
}
