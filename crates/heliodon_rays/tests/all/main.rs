//! Rays against brute force. One program, so that what the tests share is compiled and linked once.

mod brute_force;
mod common;
mod refit;
mod robust;
mod visibility;
