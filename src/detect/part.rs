//! A part of the foreground that may be a person.

use super::Cluster;
use crate::geometry::{DVec2, DVec3};

/// Some points, before it is known whether they are somebody.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Indices of its points, ascending.
    pub(super) points: Cluster,
    /// True for points that are somebody's only because one is expected there.
    pub(super) expected: bool,
    /// The person of the priors whose points these are, where that was found by who stands where.
    pub(super) owner: Option<usize>,
    /// Of the positions in plan view.
    pub(super) sum_m: DVec2,
    /// The highest point, above the floor below it.
    pub(super) top_m: f64,
}

impl Part {
    pub(super) fn new(moved_m: &[DVec3], points: Cluster) -> Self {
        let sum_m = points.iter().map(|&i| moved_m[i as usize].truncate()).sum();
        let top_m = points.iter().map(|&i| moved_m[i as usize].z).fold(0.0, f64::max);
        Self { points, expected: false, owner: None, sum_m, top_m }
    }

    pub(super) fn mean_m(&self) -> DVec2 {
        self.sum_m / self.points.len().max(1) as f64
    }
}
