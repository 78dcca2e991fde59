//! Pictures of the GPU (a software one will do) and what is decided before they are drawn. One program, so that what the tests share is compiled and linked once.

mod actors;
mod air;
#[path = "../../examples/common/mod.rs"]
mod common;
mod covering;
mod culling;
mod faults;
mod film;
mod hands;
mod room;
mod swarm;
