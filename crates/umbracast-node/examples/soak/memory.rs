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
fn in_use_mib() -> f64 {
    let stats = COUNTED.stats();
    stats.bytes_allocated.wrapping_sub(stats.bytes_deallocated) as f64 / MIB
}

/// What was in use at many moments, in MiB.
#[derive(Debug, Default)]
pub struct InUse {
    looks_mib: Vec<f64>,
}

impl InUse {
    /// Looks once.
    pub fn look(&mut self) {
        self.looks_mib.push(in_use_mib());
    }

    /// MiB that no more than this share of the looks exceed: the median is .5, the most 0. A backlog only adds, so the last
    /// tenth of the looks says what is held where none waits.
    pub fn exceeded_by_mib(&mut self, share: f64) -> f64 {
        self.looks_mib.sort_by(|a, b| b.total_cmp(a));
        let at = (share * self.looks_mib.len() as f64) as usize;
        self.looks_mib.get(at).copied().unwrap_or(f64::NAN)
    }
}
