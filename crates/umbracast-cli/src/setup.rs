//! Turns arguments into what the crates need: configuration, weights, files (of `umbracast_io::setup`), and threads.

use umbracast::Error;
pub use umbracast_io::setup::*;

/// First seed of the test scenes (docs/CONVENTIONS.md).
pub const TEST_SEED: u64 = 200_000;

/// As many threads as asked for: 0 means one a core.
pub fn threads(asked: usize) -> usize {
    if asked == 0 { std::thread::available_parallelism().map_or(1, usize::from) } else { asked }
}

/// A pool of as many threads as asked for.
pub fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::new(format!("--threads {threads}: {e}")))?;
    Ok(pool.install(work))
}
