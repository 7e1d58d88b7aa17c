//! Any bytes as a glTF file, binary or JSON as they begin.

#![no_main]

use decimate::io::Format;
use decimate_fuzz::reading::{PeakAlloc, attack_reader};
use libfuzzer_sys::fuzz_target;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

fuzz_target!(|bytes: &[u8]| attack_reader(Format::Glb, bytes, &HEAP));
