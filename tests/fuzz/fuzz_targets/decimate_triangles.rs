//! Any triangle list with any options, decimated in every tier.

#![no_main]

use arbitrary::Unstructured;
use decimate_fuzz::{decimating, made, stay_on_one_thread};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    stay_on_one_thread();
    let mut bytes = Unstructured::new(bytes);
    let Ok(options) = made::options(&mut bytes) else {
        return;
    };
    if let Ok(Some(mesh)) = made::mesh(&mut bytes) {
        decimating::attack_decimation(&mesh, &options);
    }
});
