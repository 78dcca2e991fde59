//! How triangles hang together: by position, whatever vertices their corners are, for a seam of texture or normals is no gap.

mod bodies;
mod buckets;
mod edges;
mod patches;
mod places;
mod union_find;

pub(crate) use bodies::{DIRECTIONS, Sense, scene, senses, turned_mostly, within};
pub(crate) use buckets::Buckets;
pub(crate) use edges::Edges;
pub(crate) use patches::{Patch, Patches};
pub(crate) use places::{NOWHERE, places, settle};
pub(crate) use union_find::UnionFind;
