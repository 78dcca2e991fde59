//! The heliodon command line.
fn main() {}
