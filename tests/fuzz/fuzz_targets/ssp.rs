//! Reads an SSP archive that holds this system structure.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::ssp(data));
