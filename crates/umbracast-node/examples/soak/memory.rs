//! What this process holds of the host's memory, and how much of that is in use.
//!
//! A backlog is freed when it was worked off, but the allocator keeps most of its pages. So what is resident tells of the deepest
//! backlog so far, and only what is in use tells whether something is kept that nobody needs.

use std::alloc::System;

use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

#[global_allocator]
static COUNTED: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const MIB: f64 = 1024.0 * 1024.0;

/// MiB that are resident.
pub fn resident_mib() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|kb| kb.trim().trim_end_matches(" kB").trim().parse::<f64>().ok())
        .map_or(f64::NAN, |kb| kb / 1024.0)
}

/// MiB that were asked for and are not given back.
pub fn in_use_mib() -> f64 {
    let stats = COUNTED.stats();
    stats.bytes_allocated.wrapping_sub(stats.bytes_deallocated) as f64 / MIB
}
