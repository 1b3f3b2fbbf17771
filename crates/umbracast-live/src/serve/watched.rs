//! What the page shows.

use std::sync::Arc;

use umbracast::Site;

use super::planned::Planner;
use crate::clock::HostClock;
use crate::heard::{Ear, Objects};
use crate::recording::Recording;
use crate::run::Counters;
use crate::whole::Whole;

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
    /// Where the whole scan is left while the page asks for it.
    pub whole: Arc<Whole>,
    /// The frames of a recording, where one is looked at.
    pub recording: Option<Arc<Recording>>,
    /// Who answers the page of `plan`; then that page is served in place of the one that watches.
    pub planner: Option<Planner>,
    /// Who takes what access points heard of devices, where somebody does.
    pub ear: Option<Ear>,
    /// Who takes lists of objects of another perception, as `umbracast_io::objects` reads them.
    pub objects: Option<Objects>,
}

impl Watched {
    /// A live run of that site, under that title.
    pub fn new(site: Site, counters: Arc<Counters>, clock: HostClock, title: impl Into<String>) -> Self {
        let (whole, title) = (Arc::default(), title.into());
        Self { site, counters, clock, title, whole, recording: None, planner: None, ear: None, objects: None }
    }
}
