//! Bakes of small sites, whole. One program, so that what the tests share is compiled and linked once.

mod actors;
mod borders;
mod changed;
mod details;
mod evidence;
mod light_map_parts;
mod panorama;
mod prepare;
mod scan;
mod texel_seams;
mod texels;
mod views;
mod waves;
mod weathering;
