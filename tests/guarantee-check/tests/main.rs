//! Tests of the crate, in one program.

mod check;
mod experiments;
mod plans;
mod shipped;
mod sums;
