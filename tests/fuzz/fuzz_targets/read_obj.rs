//! Any bytes as a OBJ file.

#![no_main]

use decimate::io::Format;
use decimate_fuzz::reading::{PeakAlloc, attack_reader};
use libfuzzer_sys::fuzz_target;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

fuzz_target!(|bytes: &[u8]| attack_reader(Format::Obj, bytes, &HEAP));
