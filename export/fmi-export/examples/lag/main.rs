//! The smallest complete FMU. Build it with `cargo build --example lag` and pack it with
//! `fmu-pack liblag.so --output DIR`.

pub mod model;

fmi_export::export_fmus!(model::Lag);
