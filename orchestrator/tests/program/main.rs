//! The program as its users run it, with FMUs in C.

mod bench;
mod campaign;
mod ends;
mod exchange;
mod fmi3;
mod foreign;
mod generated;
#[cfg(target_os = "linux")]
mod hostile;
mod isolation;
#[cfg(target_os = "linux")]
mod kills;
mod malformed;
mod names;
mod plot;
mod prelude;
mod results;
mod search;
mod sense;
mod table;
mod timing;
mod together;
mod units;
mod usage;
mod verdicts;
