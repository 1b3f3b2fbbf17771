//! People's paths, sampled evenly.

use umbracast::geometry::DVec2;

/// One simulated step: 10 ms.
pub(super) const STEP_NS: i64 = 10_000_000;

/// One person's way, sampled evenly.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Counts from 0 in a drawn scene; of recorded people the number in their file.
    pub person: u32,
    /// Time of the first sample.
    pub start_ns: i64,
    /// From one sample to the next: 10 ms.
    pub step_ns: i64,
    /// Ground points of the body axis.
    pub positions_m: Vec<DVec2>,
    /// When the person came within 1 m of the goal; the body stays. `None`: never, as with replayed people.
    pub arrived_ns: Option<i64>,
    /// Standing height where the source knows it.
    pub height_m: Option<f64>,
}

/// A scene's people.
#[derive(Debug, Clone, PartialEq)]
pub struct Crowd {
    /// In order of `person`.
    pub trajectories: Vec<Trajectory>,
    /// Length of the scene.
    pub duration_ns: i64,
}

impl Crowd {
    /// The same people elsewhere.
    #[must_use]
    pub fn moved(mut self, by_m: DVec2) -> Self {
        if by_m != DVec2::ZERO {
            self.trajectories.iter_mut().flat_map(|way| &mut way.positions_m).for_each(|at| *at += by_m);
        }
        self
    }

    /// The same people so much later.
    #[must_use]
    pub fn later(mut self, by_ns: i64) -> Self {
        for way in &mut self.trajectories {
            way.start_ns += by_ns;
            way.arrived_ns = way.arrived_ns.map(|arrived_ns| arrived_ns + by_ns);
        }
        self.duration_ns += by_ns;
        self
    }
}

impl Trajectory {
    /// Ways from time 0 in steps of 10 ms, with the time of arrival of each.
    pub(super) fn from_steps(
        positions_m: Vec<Vec<DVec2>>,
        arrived_ns: impl IntoIterator<Item = Option<i64>>,
    ) -> Vec<Self> {
        let ways = positions_m.into_iter().zip(arrived_ns).enumerate();
        ways.map(|(person, (positions_m, arrived_ns))| Self {
            person: person as u32,
            start_ns: 0,
            step_ns: STEP_NS,
            positions_m,
            arrived_ns,
            height_m: None,
        })
        .collect()
    }

    /// Position and velocity at a time, by cubic (Hermite) interpolation; `None` before the first and after the
    /// last sample. A person is in the scene exactly while this is `Some`.
    pub fn at(&self, time_ns: i64) -> Option<(DVec2, DVec2)> {
        let end_ns = self.start_ns + self.step_ns * (self.positions_m.len() as i64 - 1);
        if self.positions_m.is_empty() || time_ns < self.start_ns || time_ns > end_ns {
            return None;
        }
        let step_s = self.step_ns as f64 * 1e-9;
        let offset = (time_ns - self.start_ns) as f64 / self.step_ns as f64;
        let i = (offset as usize).min(self.positions_m.len().saturating_sub(2));
        let u = offset - i as f64;
        let last = self.positions_m.len() as isize - 1;
        let p = |k: isize| {
            let k = i as isize + k;
            let sample = |k: isize| self.positions_m[k.clamp(0, last) as usize];
            // Straight on beyond the ends; a lone sample stands.
            if k < 0 {
                sample(0) * 2.0 - sample(1)
            } else if k > last {
                sample(last) * 2.0 - sample(last - 1)
            } else {
                sample(k)
            }
        };
        // Catmull-Rom tangents: half the difference of the neighbours.
        let (p0, p1) = (p(0), p(1));
        let (m0, m1) = ((p(1) - p(-1)) * 0.5, (p(2) - p(0)) * 0.5);
        let (u2, u3) = (u * u, u * u * u);
        let position = p0 * (2.0 * u3 - 3.0 * u2 + 1.0)
            + m0 * (u3 - 2.0 * u2 + u)
            + p1 * (-2.0 * u3 + 3.0 * u2)
            + m1 * (u3 - u2);
        let slope =
            (p1 - p0) * (6.0 * u - 6.0 * u2) + m0 * (3.0 * u2 - 4.0 * u + 1.0) + m1 * (3.0 * u2 - 2.0 * u);
        Some((position, slope / step_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_is_whole_at_both_ends_and_a_lone_sample_stands() {
        let way = |positions_m: Vec<DVec2>| Trajectory {
            person: 0,
            start_ns: 0,
            step_ns: 10_000_000,
            positions_m,
            arrived_ns: None,
            height_m: None,
        };
        let straight = way((0..5).map(|i| DVec2::new(0.01 * f64::from(i), 0.0)).collect());
        for time_ns in [0, 3_000_000, 20_000_000, 37_000_000, 40_000_000] {
            let (position, velocity) = straight.at(time_ns).unwrap();
            assert!(position.distance(DVec2::new(time_ns as f64 * 1e-9, 0.0)) < 1e-12, "{time_ns}");
            assert!(velocity.distance(DVec2::X) < 1e-9, "{time_ns}: {velocity}");
        }
        assert_eq!(straight.at(40_000_001), None);
        assert_eq!(way(vec![DVec2::X]).at(0), Some((DVec2::X, DVec2::ZERO)));
        assert_eq!(way(Vec::new()).at(0), None);
    }
}
