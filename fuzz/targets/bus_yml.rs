//! libFuzzer's entry to [`lexican_fuzz::bus_yml`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::bus_yml(data));
