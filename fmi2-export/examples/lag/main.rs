//! The smallest complete unit: `cargo build --example lag`, then `fmu-pack liblag.so --output DIR`.

pub mod model;

fmi2_export::export_fmus!(model::Lag);
