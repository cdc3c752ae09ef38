//! Tests that drive the exported C functions of a library with two FMUs, as an importer does.
#![allow(clippy::borrow_as_ptr, reason = "calls read better with `&x`")]

mod counter;
#[path = "../counting/mod.rs"]
mod counting;
#[path = "../../examples/lag/model.rs"]
#[allow(unreachable_pub)]
mod lag;
mod support;

mod allocation;
mod calls;
mod exchange;
mod instances;
mod linked;
mod logging;
mod steps;
mod values;

fmi_export::export_fmus!(lag::Lag, counter::Counter);
