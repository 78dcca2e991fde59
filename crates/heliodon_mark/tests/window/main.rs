//! The window, driven by mouse and keys without a display: marking, shapes, what is known, solving, undoing, saving, closing.

mod closing;
mod desk;
mod haste;
mod known;
mod lines;
mod marking;
#[path = "../../examples/scene/mod.rs"]
mod scene;
mod shapes;
