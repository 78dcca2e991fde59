//! How triangles hang together: by position, whatever vertices their corners are, for a seam of texture or normals is no gap.

mod buckets;
mod edges;
mod places;
mod union_find;

pub use buckets::Buckets;
pub use edges::{Edges, HalfEdge};
pub use places::{NOWHERE, places, settle};
pub use union_find::UnionFind;
