//! One cluster, one person: Haselich's split-merge, or evidence for one person more or fewer.

use super::{Cluster, Point, Prior};
use crate::config::DetectConfig;

/// Groups foreground points into people.
#[derive(Debug)]
pub struct Clusterer {}

impl Clusterer {
    /// With the switches of `detect`.
    pub fn new(_config: &DetectConfig) -> Self {
        Self {}
    }

    /// One cluster a person, in an order that does not depend on the order of the points.
    pub fn clusters(&mut self, _points: &[Point], _priors: &[Prior], clusters: &mut Vec<Cluster>) {
        clusters.clear();
    }
}
