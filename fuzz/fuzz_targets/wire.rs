#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| epipole_fuzz::wire::run(data));
