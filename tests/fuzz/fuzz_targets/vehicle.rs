//! Reads the file of a vehicle.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::vehicle(data));
