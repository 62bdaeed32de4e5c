#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| mesolux_fuzz::gltf(bytes));
