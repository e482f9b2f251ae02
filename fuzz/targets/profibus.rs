//! libFuzzer's entry to [`lexican_fuzz::profibus`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::profibus(data));
