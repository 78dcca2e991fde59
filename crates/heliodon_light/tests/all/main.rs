//! Light at points: against analytic values, and what it does with bad input. One program, so that what the tests share is compiled and linked once.

mod analytic;
mod common;
mod detail;
mod lattice;
mod receive;
mod reference;
mod robust;
mod traces;
