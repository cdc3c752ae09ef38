//! Reads a model description, and lists its faults.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::description(data));
