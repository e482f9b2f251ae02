//! libFuzzer's entry to [`lexican_fuzz::xdd`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::xdd(data));
