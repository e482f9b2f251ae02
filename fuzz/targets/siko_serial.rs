//! libFuzzer's entry to [`lexican_fuzz::siko_serial`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::siko_serial(data));
