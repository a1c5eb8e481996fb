#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| planisphere_fuzz::read("gsd", bytes));
