//! Simulated LiDARs that give true sensor packets.

use umbracast::lidar::Packet;
use umbracast::{Error, Site};

use crate::body::Walker;

/// All sensors of a site in its hall.
#[derive(Debug)]
pub struct Sensors {}

impl Sensors {
    /// Traces the empty hall once for each sensor.
    ///
    /// # Errors
    /// A sensor model that cannot be simulated.
    pub fn new(_site: &Site, _seed: u64) -> Result<Self, Error> {
        Ok(Self {})
    }

    /// The packets of frame `index` (one list a sensor) and, for each walker, how many returns came from its
    /// body, all sensors together. Frames must be asked for in order.
    pub fn frame(&mut self, _index: u64, walkers: &[Walker]) -> (Vec<Vec<Packet>>, Vec<u32>) {
        (Vec::new(), vec![0; walkers.len()])
    }
}
