//! From the geometry that was scanned or modelled to the geometry that is drawn.
//!
//! [`Views`] says where eyes can be and what screen they look at; what no eye can tell apart need not be drawn.

pub mod borders;
pub mod clean;
mod interim;
mod paint;
pub mod purge;
#[cfg(test)]
mod shapes;
pub mod simplify;
pub mod solids;
pub mod split;
mod tell;
mod topology;
mod views;

pub use interim::{Interim, Nowhere};
pub use tell::Tell;
pub use views::{Screen, ViewCell, Views};
