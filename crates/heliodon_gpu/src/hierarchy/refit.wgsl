// A hierarchy's boxes for where the vertices are now.
//
// The triangles of each node follow one another. So boxes are taken of sixteen triangles each, of sixteen such boxes, and so on; then each node puts
// its own together from at most thirty boxes of each size: no node waits for its children, and few dispatches do for all.

struct Refit {
    // Subtracted from everything.
    anchor: vec3<f32>,
    // Where rays start, metres off the surface; below 0 for what the mesh's size asks for.
    offset: f32,
    // Triangles, nodes, and how many sizes of boxes there are, the triangles' own among them.
    triangles: u32,
    nodes: u32,
    levels: u32,
    // What this dispatch is about: the size of boxes that it takes, how many of them, and workgroups in a row.
    level: u32,
    count: u32,
    row: u32,
    // How many boxes there are of the size below.
    below: u32,
    // Where in `boxes` those of each size begin; the triangles' own are not stored.
    first: array<vec4<u32>, 2>,
}

struct Box {
    low: vec3<f32>,
    high: vec3<f32>,
}

@group(0) @binding(0) var<uniform> refit: Refit;
// Fourth: 1, or 0 for one that is nowhere.
@group(0) @binding(1) var<storage, read> positions: array<vec4<f32>>;
// Three vertices for each place.
@group(0) @binding(2) var<storage, read> vertices: array<u32>;
// Three for each place, from the anchor; fourth: 0 where there is no triangle.
@group(0) @binding(3) var<storage, read_write> corners: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> boxes: array<Box>;
// The first place under each node, and the place behind its last.
@group(0) @binding(5) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(6) var<storage, read_write> nodes: array<Node>;
@group(0) @binding(7) var<storage, read_write> extent: Extent;

// Boxes of one size that make one of the next.
const FOLD: u32 = 16u;

// Farther than anything, and still finite times 1e20 (rays.wgsl).
const NOWHERE: f32 = 1e13;

// 16 roundings of 2^-24, see rays.wgsl.
const MARGIN: f32 = 9.5367432e-7;

fn nothing() -> Box {
    return Box(vec3<f32>(NOWHERE), vec3<f32>(-NOWHERE));
}

fn both(a: Box, b: Box) -> Box {
    return Box(min(a.low, b.low), max(a.high, b.high));
}

fn box_of(level: u32, i: u32) -> Box {
    if (level > 0u) {
        return boxes[refit.first[level / 4u][level % 4u] + i];
    }
    let a = corners[3u * i];
    if (a.w == 0.0) {
        return nothing();
    }
    let b = corners[3u * i + 1u].xyz;
    let c = corners[3u * i + 2u].xyz;
    return Box(min(min(a.xyz, b), c), max(max(a.xyz, b), c));
}

fn index(group: vec3<u32>, lane: u32) -> u32 {
    return (group.y * refit.row + group.x) * 64u + lane;
}

// The triangles' corners, together.
@compute @workgroup_size(64)
fn place(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = index(group, lane);
    if (i >= refit.count) {
        return;
    }
    let a = positions[vertices[3u * i]];
    let b = positions[vertices[3u * i + 1u]];
    let c = positions[vertices[3u * i + 2u]];
    let there = a.w * b.w * c.w;
    corners[3u * i] = vec4<f32>((a.xyz - refit.anchor) * there, there);
    corners[3u * i + 1u] = vec4<f32>((b.xyz - refit.anchor) * there, there);
    corners[3u * i + 2u] = vec4<f32>((c.xyz - refit.anchor) * there, there);
}

// Boxes of the next size.
@compute @workgroup_size(64)
fn join(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = index(group, lane);
    if (i >= refit.count) {
        return;
    }
    var all = nothing();
    for (var k = i * FOLD; k < min((i + 1u) * FOLD, refit.below); k++) {
        all = both(all, box_of(refit.level - 1u, k));
    }
    boxes[refit.first[refit.level / 4u][refit.level % 4u] + i] = all;
}

// The extent of the whole, from the boxes of the last size.
@compute @workgroup_size(1)
fn survey() {
    var all = nothing();
    for (var k = 0u; k < refit.count; k++) {
        all = both(all, box_of(refit.levels - 1u, k));
    }
    if (any(all.low > all.high)) {
        all = Box(vec3<f32>(0.0), vec3<f32>(0.0));
    }
    let half = 0.5 * (all.high - all.low);
    let near = max(abs(all.low), abs(all.high));
    let far = max(abs(refit.anchor + all.low), abs(refit.anchor + all.high));
    let reach = max(max(near.x, near.y), near.z);
    extent.center = refit.anchor + 0.5 * (all.low + all.high);
    // Rounding must not leave a corner outside.
    extent.radius = max(length(half) * 1.00001, 1e-30);
    extent.anchor = refit.anchor;
    extent.margin = reach * MARGIN;
    // As `start_offset` of hierarchy/mod.rs.
    let rounding = 1.9073486e-6 * max(max(max(far.x, far.y), far.z), reach);
    extent.offset = select(max(max(2e-4 * length(half), rounding), 1e-37), refit.offset, refit.offset >= 0.0);
}

// The nodes' boxes.
@compute @workgroup_size(64)
fn fit(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = index(group, lane);
    if (i >= refit.nodes) {
        return;
    }
    var range = ranges[i];
    var all = nothing();
    for (var level = 0u; level < refit.levels && range.x < range.y; level++) {
        let last = level + 1u == refit.levels;
        while (range.x < range.y && (last || range.x % FOLD != 0u)) {
            all = both(all, box_of(level, range.x));
            range.x++;
        }
        while (range.x < range.y && range.y % FOLD != 0u) {
            range.y--;
            all = both(all, box_of(level, range.y));
        }
        range /= vec2<u32>(FOLD);
    }
    // What holds nothing must not become something.
    let wider = select(0.0, extent.margin, all.low.x <= all.high.x);
    nodes[i].low = all.low - wider;
    nodes[i].high = all.high + wider;
}
