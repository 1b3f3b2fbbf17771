//! What the page shows.

use std::sync::Arc;

use umbracast::Site;

use crate::clock::HostClock;
use crate::run::Counters;

/// What the page is about.
pub struct Watched {
    /// Where everything stands.
    pub site: Site,
    /// What is counted.
    pub counters: Arc<Counters>,
    /// The clock of the run.
    pub clock: HostClock,
    /// What it is that is shown: `live`, or a recording's name.
    pub title: String,
}
