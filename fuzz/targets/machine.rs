//! libFuzzer's entry to [`lexican_fuzz::machine`].
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lexican_fuzz::machine(data));
