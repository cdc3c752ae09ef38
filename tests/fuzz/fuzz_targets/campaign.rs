//! Reads a campaign.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::campaign(data));
