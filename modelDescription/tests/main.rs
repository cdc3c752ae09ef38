//! Tests of the crate, in one program.

mod description;
mod program;
