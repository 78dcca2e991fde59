// Which points the light of each direction reaches, by rays: one invocation for a point and 32 directions, one word of the matrix.
//
// S. Woop, C. Benthin, I. Wald: "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. WGSL lets a compiler fuse a product and a sum, so an edge's function may
// round differently for the triangles on its two sides: what is within its rounding of an edge is inside (`EDGE`).

struct Rays {
    // Points that ask, points in all, directions, and the first word of this dispatch.
    asked: u32,
    points: u32,
    directions: u32,
    first: u32,
    nodes: u32,
    // Workgroups in a row of a dispatch.
    row: u32,
}

@group(0) @binding(0) var<uniform> rays: Rays;
@group(0) @binding(1) var<uniform> extent: Extent;
@group(0) @binding(2) var<storage, read> directions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4<f32>>;
// The points that ask, neighbours together.
@group(0) @binding(5) var<storage, read> order: array<u32>;
@group(0) @binding(6) var<storage, read> nodes: array<Node>;
@group(0) @binding(7) var<storage, read> corners: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read_write> bits: array<u32>;

// Of the products that an edge's function is the difference of, 4 roundings of 2^-24: both products, their difference, and this.
const EDGE: f32 = 2.3841858e-7;

// Steeper than this along an axis is not told apart from parallel.
const STEEPEST: f32 = 1e20;

// Axes i, j, k in cyclic order, k the direction's largest.
fn turned(v: vec3<f32>, k: u32) -> vec3<f32> {
    return select(select(v.xyz, v.zxy, k == 1u), v.yzx, k == 0u);
}

// Along the ray a corner, relative to its origin, is across, across and ahead.
fn sheared(corner: vec3<f32>, origin: vec3<f32>, k: u32, shear: vec3<f32>) -> vec3<f32> {
    let v = turned(corner - origin, k);
    return vec3<f32>(v.xy - shear.xy * v.z, v.z * shear.z);
}

// The function of an edge, and its rounding.
fn edge(a: vec3<f32>, b: vec3<f32>) -> vec2<f32> {
    let x = a.x * b.y;
    let y = b.x * a.y;
    return vec2<f32>(x - y, EDGE * (abs(x) + abs(y)));
}

// Whether a triangle lies ahead of a ray.
fn meets(at: u32, origin: vec3<f32>, k: u32, shear: vec3<f32>) -> bool {
    let a = sheared(corners[at].xyz, origin, k, shear);
    let b = sheared(corners[at + 1u].xyz, origin, k, shear);
    let c = sheared(corners[at + 2u].xyz, origin, k, shear);
    let low = min(min(a, b), c);
    let high = max(max(a, b), c);
    // Slivers' functions can all round to one sign far outside of them: their boxes know better.
    if (any(low.xy > vec2<f32>(0.0)) || any(high < vec3<f32>(0.0))) {
        return false;
    }
    let wa = edge(b, c);
    let wb = edge(c, a);
    let wc = edge(a, b);
    let w = vec3<f32>(wa.x, wb.x, wc.x);
    let rounding = vec3<f32>(wa.y, wb.y, wc.y);
    let det = w.x + w.y + w.z;
    let inside = (all(w >= -rounding) && det > 0.0) || (all(w <= rounding) && det < 0.0);
    // Its depth lies between its corners' however it rounds.
    let ahead = dot(w, vec3<f32>(a.z, b.z, c.z)) * sign(det) > 0.0;
    return inside && (low.z > 0.0 || (high.z > 0.0 && ahead));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let at = (group.y * rays.row + group.x) * 64u + lane;
    if (at >= rays.asked) {
        return;
    }
    let point = order[at];
    let n = normals[point].xyz;
    let origin = (positions[point].xyz - extent.anchor) + n * extent.offset;
    let word_at = rays.first + group.z;
    let first = word_at * 32u;
    let count = min(32u, rays.directions - first);
    // One loop for all directions: whoever's ray is done goes on to the next, and waits for no neighbour's.
    var word = 0u;
    var next = 0u;
    var i = rays.nodes;
    var k = 0u;
    var shear = vec3<f32>(0.0);
    var steps = vec3<f32>(0.0);
    loop {
        if (i >= rays.nodes) {
            var l = vec3<f32>(0.0);
            while (next < count) {
                l = directions[first + next].xyz;
                next++;
                if (dot(n, l) > 0.0) {
                    break;
                }
                l = vec3<f32>(0.0);
            }
            if (dot(n, l) <= 0.0) {
                break;
            }
            // Until it meets something.
            word |= 1u << (next - 1u);
            let m = abs(l);
            k = select(select(2u, 1u, m.y >= m.z), 0u, m.x >= m.y && m.x >= m.z);
            let d = turned(l, k);
            shear = vec3<f32>(d.xy / d.z, sign(d.z));
            let towards = select(vec3<f32>(-1.0), vec3<f32>(1.0), l >= vec3<f32>(0.0));
            steps = select(towards * STEEPEST, 1.0 / l, m > vec3<f32>(1.0 / STEEPEST));
            i = 0u;
            if (rays.nodes == 0u) {
                continue;
            }
        }
        let node = nodes[i];
        let t0 = (node.low - origin) * steps;
        let t1 = (node.high - origin) * steps;
        let near = min(t0, t1);
        let far = max(t0, t1);
        // Boxes are wider than what they hold by more than this rounds (`MARGIN` of refit.wgsl): each side 3 times 2^-24 of at most twice the greatest coordinate.
        if (max(max(max(near.x, near.y), near.z), 0.0) > min(min(far.x, far.y), far.z)) {
            i = node.next;
            continue;
        }
        i++;
        let place = node.leaf / 8u;
        for (var at = place; at < place + node.leaf % 8u; at++) {
            if (meets(3u * at, origin, k, shear)) {
                word &= ~(1u << (next - 1u));
                i = rays.nodes;
                break;
            }
        }
    }
    bits[word_at * rays.points + point] = word;
}
