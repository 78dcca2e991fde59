//! Pieces of a mesh and the bodies that they bound; places and edges themselves are [`heliodon_mesh::topology`]'s.

mod bodies;
mod patches;

pub(crate) use bodies::{DIRECTIONS, Sense, scene, senses, turned_mostly, within};
pub(crate) use patches::{Patch, Patches};
