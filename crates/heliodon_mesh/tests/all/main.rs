//! Meshes: formats, and what they do with bad input. One program, so that what the tests share is compiled and linked once.

mod draco;
mod formats;
mod hostile;
mod second_uvs;
