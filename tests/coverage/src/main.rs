#![no_main]

#[path = "../../src/fuzz/front.rs"]
mod front;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Err(fault) = front::survives(text) {
        panic!("{fault}");
    }
});
