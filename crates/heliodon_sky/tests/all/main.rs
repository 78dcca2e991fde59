//! Skies and suns against what is known of them. One program, so that what the tests share is compiled and linked once.

mod clear_skies;
mod day_lapse;
mod environment;
mod fit;
mod mappings;
mod real_probes;
mod solar_almanac;
mod sun_in_probes;
