//! Calls functions of an FMU in any order.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::calls(data));
