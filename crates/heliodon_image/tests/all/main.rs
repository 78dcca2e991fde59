//! Pictures: formats, and detail textures. One program, so that what the tests share is compiled and linked once.

mod detail;
mod formats;
mod ktx2;
