//! A part of the foreground that may be a person.

use super::Cluster;
use crate::geometry::{DVec2, DVec3};

/// Least points of a person.
pub(super) const POINTS_MIN: usize = 5;

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
        let mut part = Self { points, expected: false, owner: None, sum_m: DVec2::ZERO, top_m: 0.0 };
        part.look(moved_m);
        part
    }

    /// Finds out what follows from its points.
    pub(super) fn look(&mut self, moved_m: &[DVec3]) {
        let of = || self.points.iter().map(|&i| moved_m[i as usize]);
        self.sum_m = of().map(DVec3::truncate).sum();
        self.top_m = of().map(|point_m| point_m.z).fold(0.0, f64::max);
    }

    /// Along the larger deviation in plan view, as long as it.
    pub(super) fn axis_m(&self, moved_m: &[DVec3]) -> DVec2 {
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for &i in &self.points {
            let off = moved_m[i as usize].truncate() - self.mean_m();
            xx += off.x * off.x;
            xy += off.x * off.y;
            yy += off.y * off.y;
        }
        let larger = 0.5 * (xx + yy + ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt());
        DVec2::from_angle(0.5 * f64::atan2(2.0 * xy, xx - yy))
            * (larger / self.points.len().max(1) as f64).sqrt()
    }

    /// A step along this axis to either side of its mean.
    pub(super) fn ends_m(&self, axis_m: DVec2) -> [DVec2; 2] {
        [self.mean_m() - axis_m, self.mean_m() + axis_m]
    }

    pub(super) fn mean_m(&self) -> DVec2 {
        self.sum_m / self.points.len().max(1) as f64
    }
}
