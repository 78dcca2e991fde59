//! Stories: what their words do, what is refused. One program, so that what the tests share is compiled and linked once.

mod behaviour;
mod check;
#[path = "../common/mod.rs"]
mod common;
mod hostile;
mod manual;
mod mutants;
mod workshop;
