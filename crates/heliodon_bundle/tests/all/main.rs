//! What is written to a bundle and read from it. One program, so that what the tests share is compiled and linked once.

mod arrays;
mod common;
mod detail;
mod display;
mod evidence;
mod export;
mod frozen;
mod grid;
mod hostile;
mod moment;
mod panorama;
mod parameters;
mod replacing;
mod round_trip;
mod scan;
mod site;
mod summaries;
mod texels;
mod valid_gltf;
mod views;
