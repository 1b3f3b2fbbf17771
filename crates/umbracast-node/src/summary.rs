//! What a node counts, and what it uses of its host.

use umbracast::Health;
use umbracast_live::latency::Latencies;
use umbracast_live::record::RecordStatus;

/// A node's account.
#[derive(Debug, Clone, Default)]
pub struct Summary {
    /// Packets, or clouds, that came.
    pub packets: u64,
    /// Those that were given up because the front end was busy.
    pub packets_lost: u64,
    /// Frames of the front end, of the stages, or told to those who look on.
    pub frames: u64,
    /// Messages that were given up because the stages were busy.
    pub skipped: u64,
    /// Frames that waited in vain for a front end, or of which a part did not come.
    pub incomplete: u64,
    /// Messages that came too late.
    pub late: u64,
    /// Messages that were not understood.
    pub broken: u64,
    /// Frames for which the priors did not come in time.
    pub priors_late: u64,
    /// Messages published, and their bytes.
    pub published: (u64, u64),
    /// From the close of a frame to the results of the last stage.
    pub latency: Latencies,
    /// Of that what was not spent in a stage.
    pub wire: Latencies,
    /// Whether it leads.
    pub leads: bool,
    /// What was skipped since the start.
    pub health: Health,
    /// Whether it knows the hall without people.
    pub empty_hall: bool,
    /// What is not as it should be now, in words.
    pub troubles: Vec<String>,
    /// The recorder's.
    pub recorded: RecordStatus,
}

/// Seconds of processor time and bytes held, where the system says so (Linux does).
pub(crate) fn load() -> Option<(f64, u64)> {
    /// Ticks a second and bytes a page of every Linux that Rust runs on.
    const TICKS_PER_S: f64 = 100.0;
    const PAGE_BYTES: u64 = 4096;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: f64 = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    let pages: u64 = fields.get(21)?.parse().ok()?;
    Some((ticks / TICKS_PER_S, pages * PAGE_BYTES))
}
