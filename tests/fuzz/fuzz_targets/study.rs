//! Reads a study.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::study(data));
