// Where a moving mesh stands in the world, and its light: from the sky as it follows, and from the sun.

struct Light {
    world_from_mesh: mat4x4<f32>,
    // To the sun, in the mesh's space; zero for none.
    sun: vec3<f32>,
    // How much of the way the sky's light goes to what it is now.
    follow: f32,
    // At normal incidence, over pi.
    irradiance: vec3<f32>,
    corners: u32,
    // Where in the world the lattice's first point is.
    origin: vec3<f32>,
    spacing: f32,
    size: vec3<u32>,
    // Workgroups in a row of a dispatch.
    row: u32,
}

@group(0) @binding(0) var<uniform> light: Light;
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> normals: array<vec4<f32>>;
// rgb: what the matrix makes of the sky.
@group(0) @binding(3) var<storage, read> gathered: array<vec4<f32>>;
// Bit 0: whether the mesh itself lets the sun through to the corner.
@group(0) @binding(4) var<storage, read> sunned: array<u32>;
// The part of the sun that reaches each point of the lattice, x fastest.
@group(0) @binding(5) var<storage, read> lattice: array<f32>;
// rgb: the sky's light as it was shown last.
@group(0) @binding(6) var<storage, read_write> sky: array<vec4<f32>>;
// The bits of three numbers a corner; after those of all, the unit normals in the world on the octahedron, 2 x snorm16.
@group(0) @binding(7) var<storage, read_write> world: array<u32>;
// Four half floats a corner: the light, and the part of the sun's irradiance / pi in it.
@group(0) @binding(8) var<storage, read_write> shown: array<vec2<u32>>;

const HALF_MOST: f32 = 65504.0;

fn reach(low: vec3<i32>, step: vec3<i32>) -> f32 {
    let at = vec3<u32>(min(low + step, vec3<i32>(light.size) - 1));
    return lattice[(at.z * light.size.y + at.y) * light.size.x + at.x];
}

// The part of the sun that reaches a place of the world.
fn reaches(place: vec3<f32>) -> f32 {
    let most = vec3<f32>(light.size) - 1.0;
    let at = clamp((place - light.origin) / light.spacing, vec3<f32>(0.0), most);
    let first = max(min(floor(at), most - 1.0), vec3<f32>(0.0));
    let part = at - first;
    let low = vec3<i32>(first);
    var sides = vec2<f32>(0.0);
    for (var z = 0; z < 2; z++) {
        let near = mix(reach(low, vec3<i32>(0, 0, z)), reach(low, vec3<i32>(1, 0, z)), part.x);
        let far = mix(reach(low, vec3<i32>(0, 1, z)), reach(low, vec3<i32>(1, 1, z)), part.x);
        sides[z] = mix(near, far, part.y);
    }
    return mix(sides.x, sides.y, part.z);
}

// Cigolle, Donow, Evangelakos, Mara, McGuire, Meyer: "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014.
fn octahedral(n: vec3<f32>) -> u32 {
    let sum = max(abs(n.x) + abs(n.y) + abs(n.z), 1e-30);
    let flat = n.xy / sum;
    let folded = (1.0 - abs(flat.yx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), flat >= vec2<f32>(0.0));
    return pack2x16snorm(select(flat, folded, n.z < 0.0));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let corner = (group.y * light.row + group.x) * 64u + lane;
    if (corner >= light.corners) {
        return;
    }
    let place = (light.world_from_mesh * vec4<f32>(positions[corner].xyz, 1.0)).xyz;
    world[3u * corner] = bitcast<u32>(place.x);
    world[3u * corner + 1u] = bitcast<u32>(place.y);
    world[3u * corner + 2u] = bitcast<u32>(place.z);
    var now = gathered[corner].rgb;
    // What was before the first light is not looked at.
    if (light.follow < 1.0) {
        let before = sky[corner].rgb;
        now = before + (now - before) * light.follow;
    }
    sky[corner] = vec4<f32>(now, 0.0);
    let normal = normals[corner].xyz;
    world[3u * light.corners + corner] = octahedral((light.world_from_mesh * vec4<f32>(normal, 0.0)).xyz);
    let cosine = max(dot(normal, light.sun), 0.0);
    var sun = 0.0;
    if (cosine > 0.0 && (sunned[corner] & 1u) == 1u) {
        sun = cosine * reaches(place);
        now += light.irradiance * sun;
    }
    let exposed = clamp(now, vec3<f32>(0.0), vec3<f32>(HALF_MOST));
    shown[corner] = vec2<u32>(pack2x16float(exposed.rg), pack2x16float(vec2<f32>(exposed.b, sun)));
}
