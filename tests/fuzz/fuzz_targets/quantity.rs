//! Converts a number with a unit.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::quantity(data));
