//! Stage 2: the distance between forecasts and true positions, and whether the stated spread is right.

use serde::{Deserialize, Serialize};
use umbracast::geometry::DVec2;
use umbracast::{STEPS, forecast::Gaussian2};

use crate::score::bootstrap::Pooled;
use crate::score::counts::{ratio, squared_mahalanobis};
use crate::score::instances::person_counts;
use crate::score::scene::TruthIndex;

/// Squared Mahalanobis distance within which 50 % of a plane Gaussian lies (chi-square, 2 degrees of freedom).
const CHI2_50: f64 = 1.386;
/// The same for 90 %.
const CHI2_90: f64 = 4.605;

/// Errors of one step, added up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct StepSums {
    /// Distances, metres.
    pub distance_m: f64,
    /// Negative log-likelihoods of the true position (density per m^2).
    pub nll: f64,
    /// True positions within the 50 % region.
    pub within_50: u64,
    /// True positions within the 90 % region.
    pub within_90: u64,
    /// Forecasts of this step with a spread (a covariance that is positive definite).
    pub spread: u64,
}

/// Errors of all forecasts of a scene, added up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Displacement {
    /// Persons at instants that count (whatever the links).
    pub instances: u64,
    /// Those matched to a confirmed track.
    pub matched: u64,
    /// Those matched who stay unarrived through the last step: what the errors are of.
    pub scored: u64,
    /// Index h - 1.
    pub steps: [StepSums; STEPS],
}

impl Displacement {
    /// `forecast(frame, person)` is what was foreseen for the person, `None` without a track.
    pub fn of(truth: &TruthIndex, forecast: impl Fn(u64, u32) -> Option<[Gaussian2; STEPS]>) -> Self {
        let mut sums = Self::default();
        for &person in &truth.persons {
            for &frame in &truth.frames {
                if !person_counts(truth, person, frame) {
                    continue;
                }
                sums.instances += 1;
                let Some(steps) = forecast(frame, person) else { continue };
                sums.matched += 1;
                let ahead = |h: usize| truth.person(frame + h as u64, person).filter(|row| !row.arrived);
                let Some(true_rows) = (1..=STEPS).map(ahead).collect::<Option<Vec<_>>>() else { continue };
                sums.scored += 1;
                for (step, (said, row)) in sums.steps.iter_mut().zip(steps.iter().zip(true_rows)) {
                    step.count(said, DVec2::new(row.x_m, row.y_m));
                }
            }
        }
        sums
    }

    /// Mean displacement at step h, metres (Table I of the paper).
    pub fn mean_m(&self, h: usize) -> Option<f64> {
        (self.scored > 0).then(|| self.steps[h - 1].distance_m / self.scored as f64)
    }

    /// Mean displacement over all steps, metres.
    pub fn average_m(&self) -> Option<f64> {
        (1..=STEPS).map(|h| self.mean_m(h)).sum::<Option<f64>>().map(|sum| sum / STEPS as f64)
    }

    /// Mean negative log-likelihood at step h, nats.
    pub fn nll(&self, h: usize) -> Option<f64> {
        let step = &self.steps[h - 1];
        (step.spread > 0).then(|| step.nll / step.spread as f64)
    }

    /// Shares of true positions within the 50 and the 90 % region at step h.
    pub fn coverage(&self, h: usize) -> Option<[f64; 2]> {
        let step = &self.steps[h - 1];
        Some([ratio(step.within_50, step.spread)?, ratio(step.within_90, step.spread)?])
    }

    /// Share of persons at instants that count who have a confirmed track.
    pub fn tracked_share(&self) -> Option<f64> {
        ratio(self.matched, self.instances)
    }

    /// Share of persons at instants that count whose displacement is scored.
    pub fn scored_share(&self) -> Option<f64> {
        ratio(self.scored, self.instances)
    }
}

impl StepSums {
    fn count(&mut self, said: &Gaussian2, truth_m: DVec2) {
        let d = truth_m - said.mean_m;
        self.distance_m += d.length();
        let spread = [said.xx_m2, said.xy_m2, said.yy_m2];
        let Some((squared, determinant)) = squared_mahalanobis(spread, d) else { return };
        self.nll += 0.5 * squared + 0.5 * determinant.ln() + std::f64::consts::TAU.ln();
        self.within_50 += u64::from(squared <= CHI2_50);
        self.within_90 += u64::from(squared <= CHI2_90);
        self.spread += 1;
    }
}

impl Pooled for Displacement {
    fn plus(&self, other: &Self, times: u64) -> Self {
        let steps = std::array::from_fn(|i| {
            let (mine, more) = (&self.steps[i], &other.steps[i]);
            StepSums {
                distance_m: mine.distance_m + times as f64 * more.distance_m,
                nll: mine.nll + times as f64 * more.nll,
                within_50: mine.within_50 + times * more.within_50,
                within_90: mine.within_90 + times * more.within_90,
                spread: mine.spread + times * more.spread,
            }
        });
        Self {
            instances: self.instances + times * other.instances,
            matched: self.matched + times * other.matched,
            scored: self.scored + times * other.scored,
            steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::hand_made::truth_of;

    fn at(x_m: f64, y_m: f64, variance_m2: f64) -> [Gaussian2; STEPS] {
        [Gaussian2 { mean_m: DVec2::new(x_m, y_m), xx_m2: variance_m2, xy_m2: 0.0, yy_m2: variance_m2 };
            STEPS]
    }

    #[test]
    fn a_forecast_3_4_off_is_5_m_off() {
        let truth = truth_of(1, 40, |_, _| false);
        let sums = Displacement::of(&TruthIndex::new(&truth), |_, _| Some(at(3.0, 4.0, 1.0)));
        assert_eq!((sums.scored, sums.mean_m(1), sums.mean_m(9)), (22, Some(5.0), Some(5.0)));
        assert_eq!(sums.average_m(), Some(5.0));
    }

    #[test]
    fn likelihood_and_regions_of_a_plane_gaussian() {
        let truth = truth_of(1, 19, |_, _| false);
        let scored = |x_m, variance_m2| {
            Displacement::of(&TruthIndex::new(&truth), |_, _| Some(at(x_m, 0.0, variance_m2)))
        };
        // 0.5 * 4 / 4 + ln(4) + ln(2 pi), the determinant being 16.
        let nll = scored(2.0, 4.0).nll(1).unwrap();
        assert!((nll - (0.5 + 4.0_f64.ln() + std::f64::consts::TAU.ln())).abs() < 1e-12);
        assert_eq!(scored(1.17, 1.0).coverage(1), Some([1.0, 1.0]));
        assert_eq!(scored(1.18, 1.0).coverage(1), Some([0.0, 1.0]));
        assert_eq!(scored(2.15, 1.0).coverage(1), Some([0.0, 0.0]));
    }

    #[test]
    fn a_forecast_without_spread_has_a_displacement_but_no_likelihood() {
        let truth = truth_of(1, 19, |_, _| false);
        let sums = Displacement::of(&TruthIndex::new(&truth), |_, _| Some(at(1.0, 0.0, 0.0)));
        assert_eq!((sums.mean_m(1), sums.nll(1), sums.coverage(1)), (Some(1.0), None, None));
    }

    #[test]
    fn who_arrives_within_the_steps_or_has_no_track_shows_in_the_share() {
        let mut truth = truth_of(2, 40, |_, _| false);
        truth.people.iter_mut().for_each(|row| row.arrived = row.frame >= 30);
        let index = TruthIndex::new(&truth);
        let sums = Displacement::of(&index, |_, person| (person == 0).then(|| at(0.0, 0.0, 1.0)));
        // Frames 9 to 29 count, two persons; of the one with a track, 9 to 20 stay unarrived.
        assert_eq!((sums.instances, sums.matched, sums.scored), (42, 21, 12));
        assert_eq!(sums.tracked_share(), Some(0.5));
    }
}
