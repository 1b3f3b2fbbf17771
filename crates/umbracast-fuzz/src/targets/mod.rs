//! The targets. Each has a promise, a check of it, and small whole inputs to begin from.
//!
//! A new target is a `Target` beside the others of its kind and a line in [`TARGETS`].

mod settings;
mod step;
mod packets;
mod files;
mod tables;
mod own_tracks;
mod messages;
mod requests;
mod plans;

/// Where bytes come in.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name on the command line and in `fuzz/`.
    pub name: &'static str,
    /// Whole inputs, small ones.
    pub corpus: fn() -> Vec<Vec<u8>>,
    /// Gives an input to what reads it, and panics where the target's promise is broken. True where the input was
    /// understood.
    pub check: fn(&[u8]) -> bool,
}

/// Every target.
pub const TARGETS: [Target; 24] = [
    files::MCAP,
    tables::PARQUET,
    own_tracks::OWN_TRACKS,
    files::CSV,
    files::NDJSON,
    files::PETRACK,
    files::BVH,
    files::PCAP,
    files::PCD,
    settings::TOML,
    settings::NETWORKS,
    settings::CALIBRATION,
    packets::VELODYNE,
    packets::OUSTER,
    packets::HESAI,
    packets::ASSEMBLE,
    messages::NODES,
    messages::ROWS,
    messages::CLOUDS,
    messages::OBJECTS,
    messages::REPORTS,
    requests::HTTP,
    plans::PLANS,
    step::STEP,
];

/// The target of a name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
