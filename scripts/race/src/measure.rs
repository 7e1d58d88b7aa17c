//! What a call took: its seconds, and what it added to the peak of the memory.

use std::time::Instant;

use decimate::decimate::peak_rss_bytes;
use serde::Serialize;

/// What one call took.
#[derive(Debug, Serialize)]
pub struct Measured {
    /// Wall-clock seconds.
    pub seconds: f64,
    /// By how many megabytes (10^6 bytes) the call raised the peak of the resident memory.
    pub megabytes: f64,
}

/// Calls `call` and returns its result and what it took.
///
/// On Linux the peak is set back to the present size before. Elsewhere only what the call leaves
/// behind counts as memory.
pub fn measure<T>(call: impl FnOnce() -> T) -> (T, Measured) {
    // Refused elsewhere, where there is no peak to set back.
    std::fs::write("/proc/self/clear_refs", "5").ok();
    let bytes = || peak_rss_bytes().unwrap_or(0);
    let before = bytes();
    let start = Instant::now();
    let result = call();
    let seconds = start.elapsed().as_secs_f64();
    let megabytes = bytes().saturating_sub(before) as f64 / 1e6;
    (result, Measured { seconds, megabytes })
}
