//! Objects that move, for demonstrations of light that is computed anew for every frame: a skeleton that walks, a curtain in the
//! wind, a mason's yard at work. Made by rule, the same bits on every machine and for any number of threads.

pub mod artisan;
pub mod cloth;
pub(crate) mod shape;
pub mod stoneyard;
#[cfg(test)]
mod tests;
pub mod walker;

pub use artisan::{Artisan, artisan};
pub use cloth::{Cloth, cloth};
pub use stoneyard::stoneyard;
pub use walker::walker;
