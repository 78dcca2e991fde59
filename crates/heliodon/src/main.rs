//! Heliodon's program.
mod failure;
mod files;
mod film;
mod output;
mod progress;
mod values;
fn main() {}
