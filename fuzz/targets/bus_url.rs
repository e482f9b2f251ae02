//! libFuzzer's entry to [`lexican_fuzz::bus_url`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::bus_url(data));
