//! Pieces of a mesh, the bodies that they bound, and points by where they are; places and edges themselves are [`heliodon_mesh::topology`]'s.

mod bodies;
mod cells;
mod patches;

pub(crate) use bodies::{DIRECTIONS, Sense, scene, senses, turned_mostly, within};
pub(crate) use cells::{Cells, mix};
pub(crate) use patches::{Patch, Patches};
