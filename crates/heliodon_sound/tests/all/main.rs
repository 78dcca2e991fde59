//! Sound: what is heard, from where, and what it does with bad input. One program, so that what the tests share is compiled and linked once.

mod device;
mod feeds;
mod geometry;
mod hostile;
mod smooth;
