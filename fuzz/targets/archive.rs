//! libFuzzer's entry to [`lexican_fuzz::archive`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::archive(data));
