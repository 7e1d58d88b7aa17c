//! What the fuzz targets share: how bytes become files, triangle lists and options, and what must
//! hold of the answers.

pub mod decimating;
pub mod made;
pub mod reading;

/// Keeps the library on the fuzzer's thread, so that what an input does it does again.
pub fn stay_on_one_thread() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .use_current_thread();
        pool.build_global().expect("nothing made a pool before");
    });
}
