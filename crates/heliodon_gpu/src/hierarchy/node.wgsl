// The node to visit next where its box is missed, and for a leaf the first of its places times eight, and how many there are; else 0.
struct Node {
    low: vec3<f32>,
    next: u32,
    high: vec3<f32>,
    leaf: u32,
}

