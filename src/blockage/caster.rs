//! Casts a ray from every access point to every person, by the method of the config.

use super::Blockage;
use crate::Site;
use crate::config::BlockageConfig;
use crate::forecast::Forecast;
use crate::track::Track;

/// Casts.
#[derive(Debug)]
pub struct Caster {}

impl Caster {
    /// Needs the site's access points and where the UE is.
    pub fn new(_config: &BlockageConfig, _site: &Site) -> Self {
        Self {}
    }

    /// One blockage for each access point and confirmed track, access points first. `forecasts[i]` belongs to
    /// `tracks[i]`; `time_ns` is the frame's.
    pub fn cast(
        &mut self,
        _time_ns: i64,
        _tracks: &[Track],
        _forecasts: &[Forecast],
        blockages: &mut Vec<Blockage>,
    ) {
        blockages.clear();
    }
}
