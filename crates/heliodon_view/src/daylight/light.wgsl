// The light of a moment at every vertex (Callieri, Debevec, Pair, Scopigno: "A realtime immersive application with realistic
// lighting: The Parthenon", 2006, section 4, and bounced sunlight beyond it); heliodon_bundle::shade is its reference:
//
//   light = (w0 bit_t0 + w1 bit_t1) max(n.l, 0) E / pi  +  max(0, sum_i T_i S_i)  +  E max(0, sum_r b_r f_r)
//
// Prepended by VertexLayout::light_wgsl: BLOCK, GROUP, TEXELS, MASK_AT, CHANNELS. Appended: gather, which reads all but the mask,
// word by word, so that a driver need not decide anything for a word.
//
// Vertices lie in blocks of BLOCK; a block takes TEXELS rows, so that neighbours read neighbouring texels and only the mask words of
// the moment are read. Groups of GROUP vertices are lit that are listed.

struct Moment {
    // xyz: unit direction to the sun.
    sun_direction: vec4<f32>,
    // rgb: irradiance at normal incidence times exposure; over pi, and as it is.
    sun_over_pi: vec4<f32>,
    sun: vec4<f32>,
    // x, y: weights of the two mask bits.
    mask_weights: vec4<f32>,
    // Word and bit of the one and of the other.
    mask: vec4<u32>,
    // Coefficients times exposure.
    sky: array<vec4<f32>, 10>,
    // x: the value of each function of the bounced sunlight.
    bounce: array<vec4<f32>, 65>,
}

@group(0) @binding(0) var<uniform> moment: Moment;
@group(1) @binding(0) var<storage, read> groups: array<u32>;
@group(1) @binding(1) var baked: texture_2d<u32>;
// rgb: the light; a: how much of the sun's irradiance / pi in it comes straight from the sun, for what stands in its way.
@group(1) @binding(2) var<storage, read_write> light: array<vec2<u32>>;

// What fills the list's last workgroup.
const NO_GROUP: u32 = 0xffffffffu;

const HALF_MAX: vec3<f32> = vec3<f32>(65504.0);

// What number `index` of the coefficient-major, channel-minor list gives to red, green and blue.
fn to_channels(index: u32, value: f32) -> vec3<f32> {
    if (CHANNELS == 1u) {
        return vec3<f32>(value);
    }
    let channel = index % 3u;
    return value * vec3<f32>(f32(channel == 0u), f32(channel == 1u), f32(channel == 2u));
}

// What word `k` of the transfer gives: two numbers.
fn sky_part(k: u32, word: u32) -> vec3<f32> {
    let pair = unpack2x16float(word);
    return to_channels(2u * k, pair.x) * moment.sky[2u * k / CHANNELS].rgb
        + to_channels(2u * k + 1u, pair.y) * moment.sky[(2u * k + 1u) / CHANNELS].rgb;
}

// What word `k` of the bounced sunlight gives: a function's three channels, or two grey functions.
fn bounce_part(k: u32, word: u32) -> vec3<f32> {
    if (CHANNELS == 3u) {
        let steps = vec3<f32>(vec3<i32>(vec3<u32>(word << 23u, word << 14u, word << 5u)) >> vec3<u32>(23u));
        // The exponent of steps begins at -24.
        return steps * bitcast<f32>(((word >> 27u) + 103u) << 23u) * moment.bounce[k].x;
    }
    let pair = unpack2x16float(word);
    return vec3<f32>(pair.x * moment.bounce[2u * k].x + pair.y * moment.bounce[2u * k + 1u].x);
}

// What is baked, but for the mask, in the light of the moment.
struct Found {
    normal: u32,
    sky: vec3<f32>,
    bounced: vec3<f32>,
}

fn mask_word(at: vec2<u32>, word: u32) -> u32 {
    let number = MASK_AT + word;
    return textureLoad(baked, at + vec2<u32>(0u, number / 4u), 0)[number % 4u];
}

@compute @workgroup_size(BLOCK)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let group = groups[id.x / GROUP];
    if (group == NO_GROUP) {
        return;
    }
    let vertex = group * GROUP + id.x % GROUP;
    let at = vec2<u32>(vertex % BLOCK, vertex / BLOCK * TEXELS);
    let found = gather(at);

    let normal_xy = unpack2x16snorm(found.normal);
    var normal = vec3<f32>(normal_xy, 1.0 - abs(normal_xy.x) - abs(normal_xy.y));
    let fold = max(-normal.z, 0.0);
    normal.x -= select(-fold, fold, normal.x >= 0.0);
    normal.y -= select(-fold, fold, normal.y >= 0.0);
    normal = normalize(normal);

    let reached = moment.mask_weights.x * f32((mask_word(at, moment.mask.x) >> moment.mask.y) & 1u)
        + moment.mask_weights.y * f32((mask_word(at, moment.mask.z) >> moment.mask.w) & 1u);
    let direct = reached * max(dot(normal, moment.sun_direction.xyz), 0.0);
    var sum = direct * moment.sun_over_pi.rgb;
    sum += max(found.sky, vec3<f32>(0.0));
    sum += moment.sun.rgb * max(found.bounced, vec3<f32>(0.0));

    sum = min(sum, HALF_MAX);
    light[vertex] = vec2<u32>(pack2x16float(sum.rg), pack2x16float(vec2<f32>(sum.b, direct)));
}
